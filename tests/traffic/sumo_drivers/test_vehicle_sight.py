"""Sight between any two vehicles: lines of sight, which side shows what, and the laws along them."""

import math
from types import SimpleNamespace
from typing import Any, cast

import pytest

from fogsim.atmosphere import FieldAccess
from fogsim.traffic import DriverSight
from fogsim.traffic.drivers.sight_kernels import BEARING, LINE, NEAREST
from fogsim.traffic.sumo.roster import Roster
from fogsim.traffic.sumo_drivers.vehicle_sight import DriversView, OwnLamps, VehicleSight
from fogsim.values import FogBank, FogField, Lamp
from fogsim.values.light import ALL_LAMPS, Side, dark_on
from tests.traffic.common import even

DAY, NIGHT = DriverSight(10_000.0), DriverSight(0.01)
DARK: OwnLamps = {"other": sum(dark_on(int(ALL_LAMPS), side) for side in Side)}
LENGTH, WIDTH = 5.0, 2.0
EAST = 90.0
PAIR = [("me", "other")]


def two_vehicles(
    ahead: float, left: float, turned: float, height: float = 0.0, observer: str = "passenger", top: float = 1.5
) -> Any:
    """What SUMO tells of me at the origin, bound for the east, and of a black vehicle.

    Its front bumper is so far ahead and to the left of mine; it is turned to the left by an angle [°], 2 m wide and so
    high (`top` [m]).
    """
    positions = {"me": (0.0, 0.0, 0.0), "other": (ahead, left, height)}
    angles = {"me": EAST, "other": EAST - turned}
    vehicle = SimpleNamespace(
        getPosition3D=positions.__getitem__,
        getAngle=angles.__getitem__,
        getSignals=lambda _: 0,
        getColor=lambda _: (0, 0, 0, 255),
        getLength=lambda _: LENGTH,
        getWidth=lambda _: WIDTH,
        getHeight=lambda _: top,
        getMinGap=lambda _: 2.5,
        getVehicleClass=lambda vehicle: observer if vehicle == "me" else "passenger",
        getShapeClass=lambda _: "",
    )
    return SimpleNamespace(vehicle=vehicle)


def sight_of(api: Any, fog: FieldAccess, sight: DriverSight) -> VehicleSight:
    return VehicleSight(DriversView(api, fog, sight, cast("Roster", None)))


def test_the_line_ends_at_the_nearest_part_whatever_side_it_shows() -> None:
    for ahead, left, turned, distance, bearing in [
        (35.0, 0.0, 0.0, 30.0, 0.0),  # its rear
        (30.0, 0.0, 180.0, 30.0, 0.0),  # its front
        (30.0, 0.0, 90.0, 29.0, 0.0),  # its side, the nearer one
        (30.0, -31.0, 90.0, math.hypot(29.0, 31.0), math.degrees(math.atan2(-31.0, 29.0))),  # from the right: a corner
        (30.0, -2.0, -90.0, 29.0, 0.0),  # crossing to the right, its middle before me
        (-20.0, 0.0, 0.0, 20.0, 180.0),  # behind me
        (2.0, 0.0, 0.0, NEAREST, None),  # where I am
    ]:
        (line,) = sight_of(two_vehicles(ahead, left, turned), even(100.0), DAY).lines_of_sight(PAIR)
        assert line[LINE] == pytest.approx(distance)
        if bearing is not None:
            assert abs(math.degrees(line[BEARING])) == pytest.approx(abs(bearing), abs=1e-9)
    (line,) = sight_of(two_vehicles(35.0, 0.0, 0.0, height=4.0), even(100.0), DAY).lines_of_sight(PAIR)
    assert line[LINE] == pytest.approx(math.hypot(30.0, 4.0))


@pytest.mark.parametrize("turned", [0.0, 90.0, 180.0])
def test_by_day_every_side_of_a_black_vehicle_is_seen_up_to_the_visibility(turned: float) -> None:
    for distance, expected in ((58.0, True), (62.0, False)):
        ahead = distance + {0.0: LENGTH, 90.0: WIDTH / 2.0, 180.0: 0.0}[turned]
        sight = sight_of(two_vehicles(ahead, 0.0, turned), even(60.0), DAY)
        assert sight.sees(PAIR, DARK) == [expected]


def test_at_night_low_beams_that_come_are_seen_farther_than_tail_lamps_and_these_than_a_side() -> None:
    def farthest(turned: float) -> int:
        views = (sight_of(two_vehicles(float(d), 0.0, turned), even(60.0), NIGHT) for d in range(10, 400))
        return sum(view.sees(PAIR, {})[0] for view in views)

    side, rear, front = farthest(90.0), farthest(0.0), farthest(180.0)
    assert side < rear < front


def test_at_night_own_head_lamps_show_only_what_is_in_their_beam() -> None:
    lit: OwnLamps = {**DARK, "me": int(Lamp.LOW_BEAM)}
    unlit: OwnLamps = {**DARK, "me": int(Lamp.POSITION)}
    ahead, beside = two_vehicles(25.0, 0.0, 0.0), two_vehicles(9.0, 20.0, 0.0)
    assert sight_of(ahead, even(400.0), NIGHT).sees(PAIR, lit) == [True]
    assert sight_of(ahead, even(400.0), NIGHT).sees(PAIR, unlit) == [False]
    assert sight_of(beside, even(400.0), NIGHT).sees(PAIR, lit) == [False]


def test_sight_goes_through_the_fog_that_lies_on_its_line() -> None:
    """A bank of 0.1/m between 10 and 40 m ahead, τ = 3 and more: it hides what is behind it, not what is beside it."""
    bank = FogBank((0.0, 0.0), (1.0, 0.0), 10.0, 40.0, 1.0, 0.1)
    fog = FieldAccess(FogField(0.001, (3000.0,) * 3, (bank,)))
    behind, aside = two_vehicles(65.0, 0.0, 0.0), two_vehicles(0.0, 60.0, 0.0)
    assert sight_of(behind, fog, DAY).sees(PAIR, DARK) == [False]
    assert sight_of(aside, fog, DAY).sees(PAIR, DARK) == [True]
    assert sight_of(aside, fog, DAY).sees([], DARK) == []
    nowhere = two_vehicles(-1073741824.0, -1073741824.0, 0.0)
    assert sight_of(nowhere, even(100.0), DAY).sees(PAIR, {}) == [False]


def test_who_sits_higher_looks_down_into_a_shallow_layer_of_fog() -> None:
    """A layer that ends 1.5 m above the road: a car's driver looks through all of it, a truck's through the last of it.

    From 2.33 m down to 1.2 m the line is within the layer for (1.5 − 1.2) / (2.33 − 1.2) of its length.
    """
    fog = FieldAccess(FogField(0.1, (3000.0,) * 3, top=1.5, top_edge=0.001))

    def farthest(observer: str) -> float:
        views = {d: sight_of(two_vehicles(float(d), 0.0, 180.0, observer=observer), fog, DAY) for d in range(5, 200)}
        return max(distance for distance, view in views.items() if view.sees(PAIR, DARK)[0])

    assert farthest("truck") / farthest("passenger") == pytest.approx((2.33 - 1.2) / (1.5 - 1.2), rel=0.04)
