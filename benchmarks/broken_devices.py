"""Whether the scenarios' expectations find faults: devices broken on purpose, which a scenario must each catch.

Each broken device takes the place of the sound one in the shipped scenarios that expect something and may use it, the
shortest first, until one fails. The sound device comes first, and must pass them all. The exit code is 1 if it does
not, or if a broken one fails nowhere.
"""

import math
import multiprocessing
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import patch

from harness import ROOT, Row, lines_of, parse_options, publish

from fogsim.advice import ADVISERS
from fogsim.core.registry import MethodConfig
from fogsim.errors import InputError
from fogsim.estimators import ESTIMATORS
from fogsim.fusion import FUSIONS
from fogsim.lighting import LIGHTING_POLICIES
from fogsim.scenario import Scenario
from fogsim.testing import collect, find_files
from fogsim.testing.collection import FogTest
from fogsim.testing.execution import check_case
from fogsim.values import Belief, Estimate, Lamp, Observation, SpeedAdvice
from fogsim.values.belief import certain_belief

SOUND = "none: the sound device"


Update = Callable[[Any, Observation], Estimate]
"""What a broken estimator makes of the sound one and an observation."""


@dataclass
class Estimator:
    """An estimator with another update."""

    sound: Any
    broken: Update

    def __getattr__(self, name: str) -> Any:
        """Attributes of the sound one."""
        return getattr(self.sound, name)

    def update(self, observation: Observation) -> Estimate:
        """Update in another way."""
        return self.broken(self.sound, observation)


class LastValue:
    """Repeats the last value where there is no estimate."""

    def __init__(self) -> None:
        self._last: Estimate | None = None

    def __call__(self, sound: Any, observation: Observation) -> Estimate:
        """Return the last value, or the new one."""
        estimate: Estimate = sound.update(observation)
        if estimate.valid or self._last is None:
            self._last = estimate
        return self._last


def without_signs(sound: Any, observation: Observation) -> Estimate:
    """Estimate without the map's signs."""
    estimate: Estimate = sound.update(replace(observation, signs=()))
    return estimate


def trusts_the_map(sound: Any, observation: Observation) -> Estimate:
    """Take every sign of the map for seen: no less than the way to the farthest is reported."""
    estimate: Estimate = sound.update(observation)
    farthest = max((sign.distance for sign in observation.signs), default=0.0)
    return scaled(max(farthest / estimate.visibility, 1.0), estimate) if estimate.valid else estimate


def changed(change: Callable[[Estimate], Estimate]) -> Update:
    """Change estimates."""
    return lambda sound, observation: change(sound.update(observation))


@dataclass
class NeverWidens:
    """A fusion whose belief stays constant while estimates are invalid."""

    sound: Any
    last: Belief | None = None

    def reset(self) -> None:
        """As the sound one."""
        self.sound.reset()
        self.last = None

    def update(self, estimates: Sequence[Estimate], time: float) -> Belief:
        """Believe what the sound one does, or what was believed last."""
        belief: Belief = self.sound.update(estimates, time)
        if self.last is None or any(one.valid for one in estimates):
            self.last = belief
        return self.last


@dataclass
class Adviser:
    """An adviser with `advised` in place of what it advises; it is given the sound adviser and its arguments."""

    sound: Any
    advised: Callable[..., SpeedAdvice]

    def __getattr__(self, name: str) -> Any:
        """Attributes of the sound one, such as its reaction time, but none of its other ways to advise."""
        if name.startswith("advise"):
            raise AttributeError(name)
        return getattr(self.sound, name)

    def advise(self, belief: Belief, speed_limit: float, time: float, previous: SpeedAdvice) -> SpeedAdvice:
        """Advise something else."""
        return self.advised(self.sound, belief, speed_limit, time, previous)


def blind_advice(sound: Any, _: Belief, limit: float, time: float, previous: SpeedAdvice) -> SpeedAdvice:
    """Advice of one who ignores the belief, and takes the air for clear."""
    advice: SpeedAdvice = sound.advise(certain_belief(0.0), limit, time, previous)
    return advice


def fast_advice(sound: Any, belief: Belief, limit: float, time: float, previous: SpeedAdvice) -> SpeedAdvice:
    """Advice that is 30 % too fast."""
    sane = replace(previous, speed=previous.speed / 1.3)
    advice: SpeedAdvice = sound.advise(belief, limit, time, sane)
    return replace(advice, speed=1.3 * advice.speed)


def first_advice(sound: Any, belief: Belief, limit: float, time: float, previous: SpeedAdvice) -> SpeedAdvice:
    """The first speed that is advised, for ever."""
    return previous if previous.speed < math.inf else sound.advise(belief, limit, time, previous)


@dataclass
class LateAdvice:
    """Advice by what was believed some time ago [s]."""

    delay: float = 5.0
    heard: list[tuple[float, Belief]] = field(default_factory=list)

    def __call__(self, sound: Any, belief: Belief, limit: float, time: float, previous: SpeedAdvice) -> SpeedAdvice:
        """Advise by the old belief, and nothing before there is one."""
        self.heard.append((time, belief))
        old = [one for heard, one in self.heard if heard <= time - self.delay]
        return sound.advise(old[-1], limit, time, previous) if old else previous


@dataclass
class NoFogLamps:
    """A lighting policy that never lights a fog lamp."""

    sound: Any

    def lamps(self, belief: Belief, previous: Lamp) -> Lamp:
        """Lamps of the sound one without fog lamps."""
        lit: Lamp = self.sound.lamps(belief, previous)
        return lit & ~(Lamp.FRONT_FOG | Lamp.REAR_FOG)


def scaled(share: float, estimate: Estimate) -> Estimate:
    """An estimate whose visibility is wrong by a share."""
    return replace(estimate, extinction=estimate.extinction / share) if estimate.valid else estimate


def clear(estimate: Estimate) -> Estimate:
    """An estimate of clear air, which is sure."""
    return replace(estimate, extinction=0.0, standard_deviation=1e-4, valid=True)


@dataclass(frozen=True)
class Device:
    """A broken device: the registry whose methods are replaced, by what, and overrides."""

    part: object = None
    broken: Callable[[Any], Any] = lambda sound: sound
    settings: tuple[str, ...] = ()
    estimators: tuple[str, ...] = ()  # without one of these it changes nothing; () if it may

    def matters(self, scenario: Scenario) -> bool:
        """Whether it can change anything in a scenario."""
        return not self.estimators or any(one.method in self.estimators for one in scenario.estimators)

    def patched(self) -> Any:
        """While this is entered, methods of the registry are made broken."""
        make = MethodConfig.make

        def make_broken(config: MethodConfig, registry: Any, *given: object) -> Any:
            made = make(config, registry, *given)
            return self.broken(made) if registry is self.part else made

        return patch.object(MethodConfig, "make", make_broken)


def camera_fault(fault: str) -> tuple[str, ...]:
    """Settings of a fault that lasts 5 s, and comes back every 8 s for two minutes."""
    spells = (f"{{{fault}, at: {begin} s, for: 5 s}}" for begin in range(2, 120, 8))
    return (f"sensors.faults=[{', '.join(spells)}]",)


DEVICES = {
    SOUND: Device(),
    "adviser ignores the belief": Device(ADVISERS, partial(Adviser, advised=blind_advice)),
    "adviser 30 % too fast": Device(ADVISERS, partial(Adviser, advised=fast_advice)),
    "adviser holds its first advice": Device(ADVISERS, partial(Adviser, advised=first_advice)),
    "advice 5 s late": Device(ADVISERS, lambda sound: Adviser(sound, LateAdvice())),
    "estimator 30 % too far": Device(ESTIMATORS, partial(Estimator, broken=changed(partial(scaled, 1.3)))),
    "estimator 30 % too near": Device(ESTIMATORS, partial(Estimator, broken=changed(partial(scaled, 0.7)))),
    "estimator always says clear": Device(ESTIMATORS, partial(Estimator, broken=changed(clear))),
    "estimator repeats its last value": Device(ESTIMATORS, lambda sound: Estimator(sound, LastValue())),
    "estimator trusts the sign map": Device(ESTIMATORS, partial(Estimator, broken=trusts_the_map)),
    "estimator has no sign map": Device(
        ESTIMATORS, partial(Estimator, broken=without_signs), estimators=("belaroussi2015", "sign_contrast")
    ),
    "fusion never widens": Device(FUSIONS, NeverWidens),
    "no fog lamps": Device(LIGHTING_POLICIES, NoFogLamps),
    "camera frozen for 5 s, time and again": Device(settings=camera_fault("fault: frozen, time_stamp: delivery")),
    "camera black for 5 s, time and again": Device(settings=camera_fault("fault: blackout")),
    "radar dead": Device(settings=("sensors.faults=[{fault: dropout}]",)),
    "told pitch 5° wrong": Device(settings=("camera.told.pitch_error_deg=5.0",)),
}


def tests_with(files: Iterable[Path], device: Device) -> Iterator[FogTest]:
    """Tests of files with a device; those where it cannot be, as on roads without an ego, are left out."""
    for file in files:
        try:
            yield from collect([file], device.settings)
        except InputError as error:
            if not device.settings:
                raise
            print(f"{file}: {str(error).splitlines()[0]}", file=sys.stderr)


def measure(name: str, files: Sequence[Path], *, goes_on: bool) -> Row:
    """Record of a device: in which scenarios which expectations fail, or are inconclusive alone."""
    device = DEVICES[name]
    failed: dict[str, list[str]] = {}
    inconclusive: dict[str, list[str]] = {}
    cases = [(test, run) for test in tests_with(files, device) for run in test.runs if device.matters(run.scenario)]
    # First cases first, and short ones; further seeds seldom show what those do not.
    cases.sort(key=lambda one: (one[1].number, one[1].scenario.duration_s))
    count = 0
    with device.patched():
        for test, run in cases:
            count += 1
            found = check_case(run.scenario, run.seed)["findings"]
            for outcome, kept in (("failed", failed), ("inconclusive", inconclusive)):
                names = {one["name"] for one in found if one["verdict"] == outcome}
                if names:
                    kept[test.name] = sorted({*kept.get(test.name, ()), *names})
            if failed and not goes_on:
                break
    return {
        "device": name,
        "failed": failed,
        "only_inconclusive": {key: names for key, names in inconclusive.items() if key not in failed},
        "cases": count,
        "cases_in_all": len(cases),
    }


def told(caught: dict[str, list[str]]) -> str:
    """Scenarios with their expectations."""
    return "; ".join(f"{scenario}: {', '.join(names)}" for scenario, names in caught.items()) or "–"


def table(records: Sequence[Row]) -> list[str]:
    """The records as a table."""
    rows = (
        (one["device"], told(one["failed"]), told(one["only_inconclusive"]), f"{one['cases']} of {one['cases_in_all']}")
        for one in records
    )
    return lines_of(("device", "fails", "only inconclusive", "cases run"), rows)


def main() -> int:
    """Run and print."""
    given = parse_options(
        __doc__,
        docs=("reference/tests.md", "broken devices"),
        all=(False, "all scenarios, also after the first that fails"),
        j=(1, "devices at once"),
        devices=(list(DEVICES), "which", DEVICES),
        scenarios=([str(ROOT / "scenarios")], "files, folders or names"),
    )
    work = partial(measure, files=find_files(given.scenarios), goes_on=given.all)
    if given.j == 1:
        records = [work(name) for name in given.devices]
    else:
        with multiprocessing.get_context("fork").Pool(given.j) as pool:
            records = pool.map(work, given.devices, chunksize=1)
    publish(given, records, table)
    wrong = [one["device"] for one in records if bool(one["failed"]) == (one["device"] == SOUND)]
    for name in wrong:
        print(f"not as it should be: {name}", file=sys.stderr)
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
