"""Foes at junctions: SUMO's own answer, and none where nobody has the right of way, for there SUMO would crash."""

import contextlib
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import sumo

from fogsim.traffic.sumo.libsumo_link import load_libsumo
from fogsim.traffic.sumo_drivers.junction_sight import JunctionFoes, unregulated_junctions
from tests.traffic.common import NET, QUIET

CROSSING_WAYS = (("A1B1", "B1C1"), ("B0B1", "B1B2"), ("C1B1", "B1A1"))


@contextlib.contextmanager
def crossing(folder: Path, kind: str) -> Iterator[Any]:
    """Cars that meet at junctions of a kind."""
    net, routes = folder / "cross.net.xml", folder / "cross.rou.xml"
    grid = ["--grid", "--grid.number", "3", "--default-junction-type", kind, "-o", str(net)]
    subprocess.run([Path(sumo.SUMO_HOME, "bin", "netgenerate"), *grid], check=True, capture_output=True)
    cars = (f'<vehicle id="{a}" depart="0"><route edges="{a} {b}"/></vehicle>' for a, b in CROSSING_WAYS)
    routes.write_text(f"<routes>{''.join(cars)}</routes>", encoding="utf-8")
    with contextlib.closing(load_libsumo()) as libsumo:
        libsumo.start(["sumo", "-n", str(net), "-r", str(routes), "--no-step-log", "--no-warnings"])
        yield libsumo


def foes_met(libsumo: Any) -> set[str]:
    """Everybody who is anybody's foe on the way."""
    foes, met = JunctionFoes(libsumo), set()
    for _ in range(25):
        libsumo.simulationStep()
        met.update(foe[0] for driver in libsumo.vehicle.getIDList() for foe in foes.ahead_of(driver, 80.0))
    return met


def test_foes_are_sumos_own_and_none_where_nobody_has_the_right_of_way(tmp_path: Path) -> None:
    assert unregulated_junctions(tmp_path / "elsewhere.net.xml") == frozenset()
    with crossing(tmp_path, "priority") as libsumo:
        assert not unregulated_junctions(tmp_path / "cross.net.xml")
        assert JunctionFoes(libsumo).are_there
        assert foes_met(libsumo) == {first for first, _ in CROSSING_WAYS}
    with crossing(tmp_path, "unregulated") as libsumo:
        assert "B1" in unregulated_junctions(tmp_path / "cross.net.xml")
        assert foes_met(libsumo) == set()


def test_on_a_motorway_without_ramps_there_are_none() -> None:
    with contextlib.closing(load_libsumo()) as libsumo:
        libsumo.start(["sumo", "-n", str(NET), *QUIET])
        assert any(lane.startswith(":") for lane in libsumo.lane.getIDList())
        assert not JunctionFoes(libsumo).are_there
