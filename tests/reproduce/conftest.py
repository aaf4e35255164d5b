"""Evaluations are nightly."""

import pytest


def pytest_itemcollected(item: pytest.Item) -> None:
    if "done" in getattr(item, "fixturenames", ()):
        item.add_marker(pytest.mark.nightly)
