"""What the page shows: a moment of the drive in the chosen fog and light, its estimates, and the advice."""

import math
import multiprocessing
import os
import shlex
import signal
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from multiprocessing.pool import AsyncResult, Pool
from typing import Any, cast

import numpy as np

from fogsim.camera import CameraConfig
from fogsim.core.randomness import spawn_streams
from fogsim.core.registry import MethodConfig, Registry
from fogsim.dataset.directory import png
from fogsim.errors import InputError
from fogsim.estimators.protocol import Calibrations, TakesCalibrations
from fogsim.explore.recorded_drive import Moment, RecordedDrive
from fogsim.recorders.templating import data_url
from fogsim.scenario import Scenario
from fogsim.scenario.loading import override
from fogsim.simulation.advised_driving import AdvisedDriving
from fogsim.simulation.ego.equipment import EgoEquipment
from fogsim.simulation.ego.view_rendering import EgoView, ViewRenderer, view_of_world
from fogsim.simulation.run_config import RunConfig, WorldConfig
from fogsim.units import KMH_PER_MPS
from fogsim.values import Command, Estimate, Lamp, Observation, RoadNetwork, SignMap, Step, TrafficSnapshot
from fogsim.values.camera_response import eight_bit
from fogsim.values.light import lamp_names
from fogsim.values.script import Actions

CALIBRATING = "it is being calibrated for this camera and these lamps; its estimate follows"
"""Reason of an estimate that is not there yet."""

_MOST_KEPT = 20


class _NotReadyError(Exception):
    """A calibration is still being made."""


class Calibrator:
    """Makes the calibrations that methods ask for, one at a time, and keeps some."""

    def __init__(self) -> None:
        self._pool: Pool | None = None
        self._made: dict[tuple[Any, ...], AsyncResult[Any]] = {}
        self.awaited: set[str] = set()  # methods that had no estimate of a frame since this was cleared

    def without_waiting(self, method: MethodConfig) -> MethodConfig:
        """A method that has no estimate, for `CALIBRATING`, until its calibration is there."""
        return _Patient(**{one.name: getattr(method, one.name) for one in fields(method)}, calibrator=self)

    def take(self, make: Callable[..., Any], *arguments: Any) -> Any:
        """A calibration that was made; if it was not, begin it unless another one is being made."""
        key = make.__name__, *arguments
        made = self._made.get(key)
        if made is None and all(one.ready() for one in self._made.values()):
            if self._pool is None:
                # Ctrl-C is for this process: the other one inherits that it ignores it.
                before = signal.signal(signal.SIGINT, signal.SIG_IGN)
                try:
                    self._pool = multiprocessing.get_context("spawn").Pool(1, os.nice, (10,))
                finally:
                    signal.signal(signal.SIGINT, before)
            if len(self._made) == _MOST_KEPT:
                del self._made[next(iter(self._made))]
            made = self._made[key] = self._pool.apply_async(make, arguments)
        if made is None or not made.ready():
            raise _NotReadyError
        return made.get()

    def close(self) -> None:
        """End the other process; closing twice is allowed."""
        if self._pool is not None:
            self._pool.terminate()
        self._pool = None


@dataclass(frozen=True, slots=True)
class _Patient(MethodConfig):
    """A method whose calibrations come from a calibrator."""

    calibrator: Any = None

    def make(self, registry: Registry[Callable[..., Any]], *given: object) -> Any:
        made = MethodConfig.make(self, registry, *given)
        # Methods of users are guarded: what they raise is an error of theirs.
        is_own = type(made).__module__.startswith("fogsim.estimators.")
        return _PatientEstimator(made, self.calibrator) if is_own and isinstance(made, TakesCalibrations) else made


class _PatientEstimator:
    def __init__(self, own: Any, calibrator: Calibrator) -> None:
        self.method: str = own.method
        self.reset: Callable[[], None] = own.reset
        self._own, self._calibrator = own, calibrator

    def update(self, observation: Observation) -> Estimate:
        try:
            return cast("Estimate", self._own.update(observation))
        except _NotReadyError:
            self._calibrator.awaited.add(self.method)
            return Estimate.invalid(self.method, CALIBRATING)

    def take_calibrations(self, source: Calibrations) -> None:
        self._own.take_calibrations(_Asked(source, self._calibrator))


class _Asked:
    """A source whose calibrations are taken from a calibrator."""

    def __init__(self, source: Calibrations, calibrator: Calibrator) -> None:
        self._source, self._calibrator = source, calibrator

    def __getattr__(self, name: str) -> Callable[..., Any]:
        make = getattr(self._source, name)
        return lambda *arguments: self._calibrator.take(make, *arguments)


KEYS = {
    "visibility": "fog.visibility_m",
    "light": "light.illuminance_lx",
    "height": "camera.mount_height_m",
    "pitch": "camera.pitch_deg",
    "pitch_error": "camera.told.pitch_error_deg",
}
"""Keys of scenario files that the page sets, by the names of its sliders."""

OWN_LAMPS = {
    "none": Lamp.NONE,
    "low": Lamp.POSITION | Lamp.LOW_BEAM,
    "fog": Lamp.POSITION | Lamp.LOW_BEAM | Lamp.FRONT_FOG,
    "high": Lamp.POSITION | Lamp.LOW_BEAM | Lamp.HIGH_BEAM,
}
"""Lamps that the page lights on the ego."""

MOST_FRAMES = 40
"""Most frames before the moment that the estimators see, too."""


@dataclass(frozen=True, slots=True)
class Question:
    """What the page asks for."""

    time: float = 0.0  # Since the drive began [s]
    frames: int = 1  # How many the estimators have seen at that time
    chosen: Mapping[str, float] = field(default_factory=dict)  # Values by the names of `KEYS`
    lamps: Lamp | None = None  # The ego's, in place of those that it lit in the drive
    rear_fog: bool = False  # Whether all others light their rear fog lamps
    soon: bool = False  # Whether to leave out methods that are still being calibrated


def question(query: Mapping[str, str]) -> Question:
    """The question in a query string; InputError for what the page does not ask."""
    known = {"time", "frames", "lamps", "rear_fog", "soon", *KEYS}
    if unknown := query.keys() - known:
        raise InputError(f"unknown {', '.join(sorted(unknown))}; known are {', '.join(sorted(known))}")
    lamps = query.get("lamps")
    if lamps is not None and lamps not in OWN_LAMPS:
        raise InputError(f"lamps must be one of {', '.join(OWN_LAMPS)}, got {lamps!r}")
    return Question(
        time=_number(query, "time", 0.0, 86_400.0),
        frames=int(_number({"frames": "1", **query}, "frames", 1, MOST_FRAMES)),
        chosen={name: _number(query, name, -1e6, 1e6) for name in KEYS if name in query},
        lamps=None if lamps is None else OWN_LAMPS[lamps],
        rear_fog=query.get("rear_fog") == "on",
        soon=query.get("soon") == "on",
    )


def _number(query: Mapping[str, str], name: str, least: float, most: float) -> float:
    text = query.get(name, "0")
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not least <= number <= most:
        raise InputError(f"{name} must be a number from {least:g} to {most:g}, got {text!r}")
    return number


class _KeptScene:
    """Draws one scene for all answers: building it takes longer than all the rest."""

    def __init__(self) -> None:
        self._view: EgoView | None = None
        self._signs: SignMap | None = None

    def view(
        self, world: WorldConfig, camera: CameraConfig, network: RoadNetwork, signs: SignMap, body: str
    ) -> EgoView:
        """What draws the world; a new one only where other signs stand."""
        if isinstance(self._view, ViewRenderer) and signs is self._signs:
            self._view.change(world, camera)
        else:
            self.close()
            self._view, self._signs = view_of_world(world, camera, network, signs, body), signs
        return self._view

    def close(self) -> None:
        if self._view is not None:
            self._view.close()


class Explorer:
    """Answers questions about one drive of a scenario."""

    def __init__(self, scenario: Scenario, name: str, seed: int, settings: Sequence[str] = ()) -> None:
        self._scenario, self._seed = scenario, seed
        self._command = ["fogsim", "run", name, f"--seed={seed}", *_as_options(settings)]
        self.drive = RecordedDrive(scenario.run_config(), seed)
        self._scene, self._calibrator = _KeptScene(), Calibrator()

    def answer(self, asked: Question, is_outdated: Callable[[], bool] = lambda: False) -> dict[str, Any] | None:
        """What a moment looks like and what follows from it, as JSON; None if the question is outdated meanwhile.

        The same question always has the same answer, if not `soon`: the estimators begin with the first of its frames.
        """
        last = self.drive.reach(asked.time, is_outdated)
        if last is None:
            return None
        moments = self.drive.moments[: last + 1]
        settings = self._settings(asked)
        scenario = override(self._scenario, settings) if settings else self._scenario
        config = scenario.run_config()
        self._calibrator.awaited.clear()
        if asked.soon:
            config = replace(config, estimators=tuple(map(self._calibrator.without_waiting, config.estimators)))
        seen = _look(config, moments, self._equipment(config), asked, is_outdated)
        if seen is None:
            return None
        step, command, frames = seen
        image = eight_bit(step.observation.image, config.camera.camera.bits)
        return {
            "scenario": scenario.name,
            "description": scenario.description,
            "fault": self.drive.fault,
            "time": step.time,
            "duration": self.drive.moments[-1].time if self.drive.is_over else scenario.duration_s,
            "frames": frames,
            "image": data_url(png(image), "image/png"),
            "values": {
                "visibility": _finite(step.truth.visibility),
                "light": step.truth.illuminance,
                "height": config.camera.on(step.traffic.types[step.ego]).mount_height,
                "pitch": scenario.camera.pitch_deg,
                "pitch_error": scenario.camera.told.pitch_error_deg,
            },
            "estimates": [_estimate(estimate) for estimate in step.estimates],
            "calibrating": sorted(self._calibrator.awaited),
            "belief": _belief(step),
            "advice": _advice(step, command),
            "command": shlex.join([*self._command, *_as_options(settings)]),
        }

    def _settings(self, asked: Question) -> list[str]:
        """The choices as a user would set them."""
        settings = [f"{KEYS[name]}={value:g}" for name, value in asked.chosen.items()]
        if "visibility" in asked.chosen and self._scenario.fog.visibility_m is None:
            # Expectations may name the banks.
            expect = ["expect={}"] if self._scenario.expect else []
            settings = ["fog.outside_visibility_m=null", "fog.banks=[]", *expect, *settings]
        return settings

    def _equipment(self, config: RunConfig) -> EgoEquipment:
        equipment = EgoEquipment(config, self._scene.view)
        first = self.drive.moments[0].snapshot
        network = self.drive.network
        equipment.start_run(spawn_streams(self._seed), lambda: network, first.state.types[first.ego])
        return equipment

    def close(self) -> None:
        """End the simulation and the calibrations, and free the renderer."""
        self.drive.close()
        self._scene.close()
        self._calibrator.close()


def _look(
    config: RunConfig,
    moments: list[Moment],
    equipment: EgoEquipment,
    asked: Question,
    is_outdated: Callable[[], bool],
) -> tuple[Step, Command, int] | None:
    """The last of some moments as the equipment sees it after the frames before, the advice, and their number."""
    policy, command = AdvisedDriving(config.advice, 1), Command()
    first = max(0, len(moments) - asked.frames)
    period = config.periods.camera_period
    step = None
    for index, moment in enumerate(moments):
        if index >= first:
            if is_outdated():
                return None
            snapshot = _with_lamps(moment.snapshot, asked)
            step = equipment.complete_step(index, moment.time, snapshot, command, None)
            command = policy.decide(step, command)
        actions = moment.actions
        if actions == Actions():
            continue
        # What is chosen by hand stays so, whatever the script does.
        equipment.begin(
            replace(
                actions,
                fog=() if "visibility" in asked.chosen else actions.fog,
                light=() if "light" in asked.chosen else actions.light,
            ),
            moment.time,
            moment.time + period,
        )
    return None if step is None else (step, command, len(moments) - first)


def _with_lamps(snapshot: TrafficSnapshot, asked: Question) -> TrafficSnapshot:
    """A moment with the chosen lamps."""
    if asked.lamps is None and not asked.rear_fog:
        return snapshot
    lamps = snapshot.state.lamps.copy()
    own = lamps[snapshot.ego]
    if asked.rear_fog:
        lamps |= np.int32(Lamp.REAR_FOG)
    lamps[snapshot.ego] = own if asked.lamps is None else int(asked.lamps)
    return replace(snapshot, state=replace(snapshot.state, lamps=lamps))


def _as_options(settings: Iterable[str]) -> Iterator[str]:
    return (f"--set={setting}" for setting in settings)


def _finite(number: float) -> float | None:
    return number if math.isfinite(number) else None


def _estimate(estimate: Estimate) -> dict[str, Any]:
    low, high = estimate.visibility_interval
    return {
        "method": estimate.method,
        "visibility": _finite(estimate.visibility) if estimate.valid else None,
        "low": _finite(low),
        "high": _finite(high),
        "reason": "" if estimate.valid else str(estimate.diagnostics.get("reason", "")),
    }


def _belief(step: Step) -> dict[str, Any]:
    low, high = (step.belief.visibility_quantile(share) for share in (0.05, 0.95))
    return {
        "visibility": _finite(step.belief.visibility),
        "low": _finite(low),
        "high": _finite(high),
        "informed": step.belief.is_informed(),
    }


def _advice(step: Step, command: Command) -> dict[str, Any]:
    speeds = [command.advice.speed, *(stretch.speed for stretch in command.stretches)]
    return {
        "speed": _kmh(min(speeds)),
        "limit": _kmh(step.speed_limit),
        "own_speed": _kmh(step.observation.speed),
        "lamps": lamp_names(command.lamps).replace("_", " ").split("+"),
        "warning": "" if command.warning is None else command.warning.value,
    }


def _kmh(speed: float) -> float | None:
    return _finite(speed * KMH_PER_MPS)
