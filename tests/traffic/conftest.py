"""What tests of the traffic share."""

from collections.abc import Iterator

import pytest

from fogsim.traffic.sumo.libsumo_link import LibsumoLink


@pytest.fixture
def link() -> Iterator[LibsumoLink]:
    """SUMO in this process, which ends with the test."""
    link = LibsumoLink()
    yield link
    link.end()
