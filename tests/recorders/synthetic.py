"""Synthetic steps: a car that drives into a fog bank behind another, with a drawn image for a camera."""

import dataclasses
import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fogsim.units import extinction_from_visibility
from fogsim.values import (
    Belief,
    Camera,
    Collision,
    Command,
    Ending,
    Estimate,
    Frame,
    Lamp,
    Leader,
    LeadMeasurement,
    Observation,
    SpeedAdvice,
    Step,
    TrafficState,
    TrafficStep,
    Truth,
    View,
)
from tests.helpers.vehicles import vehicles

METHODS = ("joint_road", "negru2013")
LOG_EXTINCTION = np.linspace(math.log(1e-4), math.log(0.3), 240)


def traffic(
    time: float, speed: float, acceleration: float = 0.0, *, x: float = 0.0, lamps: Lamp = Lamp.NONE
) -> TrafficState:
    """The ego "ego" in row 1, another car in row 0."""
    return vehicles(
        [x + 60.0, x],
        time=time,
        ids=("other", "ego"),
        speed=[20.0, speed],
        acceleration=[0.0, acceleration],
        lane="motorway_1",
        lamps=[0, int(lamps)],
    )


def belief(visibility: float, log_standard_deviation: float = 0.2) -> Belief:
    """A belief that is normal in ln k."""
    centre = math.log(extinction_from_visibility(visibility))
    weight = np.exp(-0.5 * ((LOG_EXTINCTION - centre) / log_standard_deviation) ** 2)
    return Belief(LOG_EXTINCTION, weight / weight.sum())


def estimate(method: str, visibility: float, **diagnostics: object) -> Estimate:
    """A valid estimate with a deviation of 10 %."""
    extinction = extinction_from_visibility(visibility)
    return Estimate(method, extinction, 0.1 * extinction, diagnostics=diagnostics)


def camera(width: int = 160, height: int = 120) -> Camera:
    """A camera that looks a little down."""
    return Camera(width, height, 0.9 * width, ((width - 1) / 2, (height - 1) / 2), 1.38, pitch=0.035)


def picture(visibility: float, camera: Camera) -> NDArray[np.uint8]:
    """Sky over a grey road with an edge line, in fog by Koschmieder's law with an airlight of 205."""
    rows = np.arange(camera.height, dtype=np.float64)[:, None] - camera.horizon_row
    columns = np.arange(camera.width, dtype=np.float64)[None, :] - camera.principal_point[0]
    distance = np.where(rows > 0, camera.row_distance / np.maximum(rows, 1e-3), np.inf)
    lateral = np.where(rows > 0, columns * camera.mount_height / np.maximum(rows, 1e-3), 0.0)
    road = np.where(np.abs(lateral) < 5.5, 75.0, 110.0)
    road = np.where(np.abs(np.abs(lateral) - 5.2) < 0.12, 230.0, road)
    weight = np.exp(-extinction_from_visibility(visibility) * distance)
    grey = np.where(rows > 0, 205.0 + (road - 205.0) * weight, 205.0)
    return np.repeat(grey.round().astype(np.uint8)[:, :, None], 3, axis=2)


def make_step(
    index: int = 0,
    *,
    time: float = 0.0,
    speed: float = 25.0,
    acceleration: float = 0.0,
    route_position: float = 0.0,
    leader: Leader | None = None,
    collisions: tuple[Collision, ...] = (),
    visibility: float = 100.0,
    visibility_ahead: float | None = None,
    estimates: tuple[Estimate, ...] = (),
    believed: Belief | None = None,
    advised: float = math.inf,
    lamps: Lamp = Lamp.NONE,
    image: NDArray[np.uint8] | None = None,
    lead: LeadMeasurement | None = None,
    ending: Ending | None = None,
) -> Step:
    """One step; whatever is not given is uneventful."""
    model = camera()
    pixels = np.full((model.height, model.width, 3), 128, np.uint8) if image is None else image
    ahead = visibility if visibility_ahead is None else visibility_ahead
    return Step(
        index=index,
        time=time,
        traffic=traffic(time, speed, acceleration, x=route_position, lamps=lamps),
        ego=1,
        route_position=route_position,
        speed_limit=130 / 3.6,
        leader=leader,
        collisions=collisions,
        truth=Truth(extinction_from_visibility(visibility), extinction_from_visibility(ahead)),
        view=View(np.zeros((1, 1, 3), np.float32), np.zeros((1, 1), np.float32), np.zeros((1, 1), np.int32)),
        observation=Observation(Frame(time, pixels, model), speed, lead),
        estimates=estimates,
        belief=belief(min(visibility, 5000.0)) if believed is None else believed,
        command=Command(SpeedAdvice(advised), lamps),
        ending=ending,
    )


def make_traffic_step(
    index: int = 0,
    *,
    time: float = 0.0,
    speed: float = 25.0,
    collisions: tuple[Collision, ...] = (),
    visibility: float = 100.0,
    visibilities: tuple[float, float] | None = None,
    command: Command | None = None,
    heard: tuple[float, float] = (math.inf, math.inf),
    ending: Ending | None = None,
) -> TrafficStep:
    """One step of traffic alone: two cars, of which the second has the speed, with what they see and have heard."""
    seen = [extinction_from_visibility(v) for v in visibilities or (visibility, visibility)]
    extinction = extinction_from_visibility(visibility)
    return TrafficStep(
        index=index,
        time=time,
        traffic=dataclasses.replace(traffic(time, speed, x=speed * time), advised_speed=np.array(heard)),
        collisions=collisions,
        truth=Truth(extinction, extinction, vehicle_extinctions=np.array(seen)),
        command=Command() if command is None else command,
        ending=ending,
    )


def drive(steps: int = 200, period: float = 0.2, *, width: int = 160, height: int = 120) -> Iterator[Step]:
    """A drive from 600 m of visibility into a bank of 90 m and out of it, with a leader that brakes."""
    rng = np.random.default_rng(7)
    model = camera(width, height)
    position, speed, gap = 0.0, 34.0, 95.0
    for index in range(steps):
        phase = index / steps
        visibility = _bank(phase)
        ahead = _bank(phase + 0.03)
        advised = math.inf if ahead > 450 else max(17.0, 35.0 * min(ahead / 300, 1.0))
        acceleration = float(np.clip(0.5 * (min(advised, 35.0) - speed), -3.0, 1.0))
        speed += acceleration * period
        position += speed * period
        leader_speed = 33.0 if phase < 0.27 else 12.0 if phase < 0.38 else 18.0
        gap = max(6.0, gap + (leader_speed - speed) * period)
        found = ahead * math.exp(0.06 * rng.standard_normal())
        rough = ahead * math.exp(0.15 * rng.standard_normal() + 0.1)
        rows = {
            "horizon_row": model.horizon_row,
            "inflection_row": model.horizon_row + model.row_distance * 1.5 / found,
        }
        yield make_step(
            index,
            time=(index + 1) * period,
            speed=speed,
            acceleration=acceleration,
            route_position=position,
            leader=Leader("other", gap, leader_speed) if gap < 150 else None,
            lead=LeadMeasurement(gap + 0.4, leader_speed - speed) if gap < 150 else None,
            visibility=visibility,
            visibility_ahead=ahead,
            estimates=(
                estimate("joint_road", found, **rows),
                estimate("negru2013", rough) if rng.random() < 0.7 else Estimate.invalid("negru2013", "no band"),
            ),
            believed=belief(ahead * math.exp(0.04 * rng.standard_normal()), 0.12),
            advised=advised,
            lamps=Lamp.LOW_BEAM | (Lamp.REAR_FOG | Lamp.FRONT_FOG if ahead < 120 else Lamp.NONE),
            image=picture(visibility, model),
        )


def _bank(phase: float) -> float:
    """Visibility along the drive [m]: soft edges at 0.3 and 0.75."""
    inside = 1 / (1 + math.exp(-(phase - 0.3) / 0.03)) - 1 / (1 + math.exp(-(phase - 0.75) / 0.03))
    return math.exp(math.log(600.0) + inside * (math.log(90.0) - math.log(600.0)))
