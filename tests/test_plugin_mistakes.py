"""An ego that is not there, in a loop that the user writes."""

from pathlib import Path

import pytest

import fogsim
from fogsim.traffic.sumo.libsumo_link import load_libsumo

GRID = Path(__file__).resolve().parent / "data" / "grid"


def test_an_ego_that_never_came_is_told_at_the_end() -> None:
    libsumo = load_libsumo()
    libsumo.start(["sumo", "-c", str(GRID / "grid.sumocfg"), "--step-length", "0.5", "--no-step-log"])
    try:
        session = fogsim.attach(libsumo, ego="vehicle3", visibility=120.0)
        for _ in range(40):
            libsumo.simulationStep()
            assert session.observe() is None
        with pytest.warns(UserWarning, match=r"ego 'vehicle3' did not appear while.*those that did: veh3, .* more"):
            session.close()
        session.close()
    finally:
        libsumo.close()


def test_a_session_that_never_looked_says_nothing() -> None:
    libsumo = load_libsumo()
    libsumo.start(["sumo", "-c", str(GRID / "grid.sumocfg"), "--step-length", "0.5", "--no-step-log"])
    try:
        fogsim.attach(libsumo, ego="vehicle3", visibility=120.0).close()
    finally:
        libsumo.close()
