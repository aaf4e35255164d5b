"""A town in SUMO, or another simulation, as a user starts it, to attach FogSim to."""

import contextlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import traci

from fogsim.traffic.sumo.libsumo_link import load_libsumo

GRID = Path(__file__).resolve().parents[1] / "data" / "grid"
ARGUMENTS = ["-c", str(GRID / "grid.sumocfg"), "--step-length", "0.5", "--no-step-log", "--seed", "1"]


@contextlib.contextmanager
def libsumo_in_town(arguments: Sequence[str] = ARGUMENTS) -> Iterator[Any]:
    with contextlib.closing(load_libsumo()) as library:
        library.start(["sumo", *arguments])
        yield library


def conduct(api: Any, vehicle: str) -> tuple[float, ...]:
    """What FogSim may change about a vehicle."""
    get = api.vehicle
    gain = float(get.getParameter(vehicle, "laneChangeModel.lcSpeedGain"))
    speeds, modes = (get.getMaxSpeed, get.getSpeedFactor), (get.getSpeedMode, get.getLaneChangeMode)
    return (*(one(vehicle) for one in (*speeds, get.getTau, *modes)), gain)


@contextlib.contextmanager
def traci_in_town(sumo_process: Callable[..., Any], arguments: Sequence[str] = ARGUMENTS) -> Iterator[Any]:
    with sumo_process(arguments) as (port, _):
        connection = traci.connect(port, numRetries=100, host="127.0.0.1", waitBetweenRetries=0.1)
        yield connection
        connection.close()
