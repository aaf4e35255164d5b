"""Evaluations are nightly, except those that take seconds."""

import pytest

QUICK = {"test_drivers", "test_huang2015"}


def pytest_itemcollected(item: pytest.Item) -> None:
    if "done" in getattr(item, "fixturenames", ()) and item.path.stem not in QUICK:
        item.add_marker(pytest.mark.nightly)
