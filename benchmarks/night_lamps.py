"""Lamps that follow the belief by night, against an oracle's: the same policy, drive and seed, informed by the truth.

`informed` is the share of decisions whose belief says enough to act on, `differs` the share of time in which the lamps
are not the oracle's, `high beams` that of the oracle's time with high beams in which the belief lights them too, and
`uninformed` how many decisions light high beams or fog lamps on a belief that says too little (never, if all is well).
The first two seconds of a run, in which nothing has been seen yet, count. The ego drives at a fixed speed, so that both
runs of a pair meet the same traffic. At 100 and 120 m the oracle stands at a limit of the policy, and the smallest
error of an estimate decides; the last line leaves these out.

`--choose` prints what constants of the night model and of the fusion do in another pool of drives, from which they
were chosen: other visibilities of four scenarios and seed 100. `valid` is the share of images with an estimate,
`bounded` that with a bound alone, `ratio` the median of estimated over true visibility, `holds` and `belief holds` the
shares of 90 % intervals of images and of informed beliefs that hold the truth.
"""

from collections.abc import Iterator
from itertools import pairwise
from types import ModuleType
from typing import Any

import numpy as np
from harness import Row, lines_of, parse_options, progress, publish

import fogsim
from fogsim import estimators, fusion
from fogsim.estimators.night import night_road
from fogsim.fusion import grid_filter
from fogsim.lighting import LIGHTING_POLICIES
from fogsim.values import Lamp, Step

SPEED = 15.0  # [m/s]
CASES = {
    "clear_night": ("20 km",),
    "rural_night_fog": ("70 m", "200 m", "2000 m"),
    "rural_night_alone": ("80 m",),
    "rural_night_oncoming": ("120 m", "200 m"),
    "tail_lamp_failure": ("100 m", "70 m"),
    "night_motorway_fog": ("150 m, bank of 100 m",),
    "street_lit_town": ("100 m", "60 m"),
}
AT_LIMITS = ("100 m", "120 m")
"""Visibilities at which the oracle itself is at a limit of `gallen2014`: 100 m, or 120 m with its hysteresis."""

OPTIONAL_LAMPS = Lamp.HIGH_BEAM | Lamp.FRONT_FOG | Lamp.REAR_FOG


CHOICE_POOL = {
    "rural_night_fog": ("50 m", "120 m", "400 m"),
    "rural_night_oncoming": ("80 m", "250 m"),
    "rural_night_alone": ("150 m",),
    "tail_lamp_failure": ("60 m", "180 m"),
}
CHOICE_SEED, CHOICE_SECONDS = 100, 20.0
CHOICES: tuple[tuple[ModuleType, str, tuple[Any, ...]], ...] = (
    (night_road, "HALO", (0.02, 0.03, 0.06)),
    (night_road, "MOST_MISFIT", tuple({True: most, False: 2.5} for most in (1.0, 2.0, 4.0))),
    (night_road, "LEAST_LAMPLIGHT", (0.5, 0.75)),
    (night_road, "COMMON", (0.7, 0.95)),
    (grid_filter, "COMMON_TIME", (2.0, 5.0)),
)


def settings(scenario: str, visibility: str) -> Iterator[str]:
    """Overrides of a scenario: its fog, a fixed speed, and nothing that the lamps do not need."""
    yield from ("expect={}", "vary={}", "end_on_collision=false")
    yield f"advice={{method: fixed_speed, parameters: {{speed: {SPEED}}}}}"
    if scenario != "night_motorway_fog":
        yield f"fog.visibility={visibility}"
    if scenario == "rural_night_fog":
        yield from ("timeline=[]", "duration_s=30")
    if scenario in ("clear_night", "night_motorway_fog"):
        yield "duration_s=60"


def drive(scenario: str, visibility: str, policy: str, informed_by: str, seed: int) -> list[Step]:
    """Steps of one run."""
    lighting = f"lighting={{method: {policy}, informed_by: {informed_by}}}"
    loaded = fogsim.load_scenario(scenario, [*settings(scenario, visibility), lighting])
    return list(fogsim.run(loaded, seed=seed))


def record(scenario: str, visibility: str, policy: str, seeds: int) -> Row:
    """What was found in the pairs of runs of a case."""
    count = differ = informed = both = oracles = uninformed = 0
    for seed in range(seeds):
        runs = [drive(scenario, visibility, policy, informed_by, seed) for informed_by in ("belief", "truth")]
        for ours, true in zip(*runs, strict=False):
            count += 1
            differ += ours.command.lamps != true.command.lamps
            oracles += Lamp.HIGH_BEAM in true.command.lamps
            both += Lamp.HIGH_BEAM in ours.command.lamps and Lamp.HIGH_BEAM in true.command.lamps
        for before, after in pairwise(runs[0]):
            informed += before.belief.is_informed()
            decided = after.command is not before.command
            uninformed += decided and not before.belief.is_informed() and bool(after.command.lamps & OPTIONAL_LAMPS)
    return {
        "scenario": scenario,
        "visibility": visibility,
        "policy": policy,
        "frames": count,
        "informed_pct": 100.0 * informed / max(count - seeds, 1),
        "differs_pct": 100.0 * differ / max(count, 1),
        "high_beams_pct": 100.0 * both / oracles if oracles else None,
        "uninformed_lit": uninformed,
    }


def drives_to_choose_from() -> Iterator[list[Step]]:
    """Every third step of the drives of the pool, with the oracle's lamps."""
    for scenario, visibilities in CHOICE_POOL.items():
        for visibility in visibilities:
            lighting = "lighting={method: gallen2014, informed_by: truth}"
            overrides = [*settings(scenario, visibility), "timeline=[]", f"duration_s={CHOICE_SECONDS}", lighting]
            overrides.append("estimators=[joint_road]")  # a quick one: the drives depend on none
            yield list(fogsim.run(fogsim.load_scenario(scenario, overrides), seed=CHOICE_SEED))[::3]


def choice_row(drives: list[list[Step]]) -> Row:
    """What the estimator and the fusion make of the drives, with their constants as they are."""
    answers, beliefs, ratios, valid = [], [], [], 0
    for steps in drives:
        estimator = estimators.make("night_road", steps[0].observation.frame.camera)
        filter_ = fusion.make("grid_filter")
        for step in steps:
            truth, found = step.truth.visibility_ahead, estimator.update(step.observation)
            belief = filter_.update([found], step.time)
            if found.valid or found.bounds is not None:
                answers.append(found.visibility_interval[0] <= truth <= found.visibility_interval[1])
            if found.valid:
                valid += 1
                ratios.append(found.visibility / truth)
            if belief.is_informed():
                beliefs.append(belief.visibility_quantile(0.05) <= truth <= belief.visibility_quantile(0.95))
    count = sum(map(len, drives))
    shares = [valid / count, (len(answers) - valid) / count, np.median(ratios), np.mean(answers), np.mean(beliefs)]
    names = ("valid", "bounded", "ratio", "holds", "belief holds")
    return {name: f"{share:.2f}" for name, share in zip(names, shares, strict=True)}


def choices() -> list[Row]:
    """A record of each value of each constant."""
    drives, rows = list(drives_to_choose_from()), []
    as_chosen = choice_row(drives)
    for module, name, values in CHOICES:
        chosen = getattr(module, name)
        for value in progress(values, name):
            setattr(module, name, value)
            shown = value[True] if isinstance(value, dict) else value
            head = {"constant": name, "value": f"{shown}{' (chosen)' if value == chosen else ''}"}
            rows.append({**head, **(as_chosen if value == chosen else choice_row(drives))})
        setattr(module, name, chosen)
    return rows


def docs_table(found: list[Row]) -> list[str]:
    """Lines of the table of docs/explanation/night.md."""
    rows = []
    for one in found:
        high = "–" if one["high_beams_pct"] is None else f"{one['high_beams_pct']:.0f}"
        cells = (f"{one['informed_pct']:.0f}", f"{one['differs_pct']:.1f}", high, str(one["uninformed_lit"]))
        rows.append((one["scenario"], one["visibility"], str(one["frames"]), *cells))
    clear_of_limits = [one for one in found if one["visibility"] not in AT_LIMITS]
    for label, chosen in (("all", found), ("all but 100 and 120 m", clear_of_limits)):
        frames = sum(one["frames"] for one in chosen)
        differ = sum(one["differs_pct"] * one["frames"] for one in chosen) / frames
        uninformed = sum(one["uninformed_lit"] for one in chosen)
        rows.append((label, "", str(frames), "", f"{differ:.1f}", "", str(uninformed)))
    heads = ("scenario", "V_met", "frames", "informed [%]", "differs [%]", "high beams [%]", "uninformed")
    return lines_of(heads, rows)


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        docs=("explanation/night.md", "night lamps"),
        seeds=(3, "pairs of runs of each case"),
        policy=("gallen2014", "policy", sorted(LIGHTING_POLICIES)),
        choose=(False, "print what the constants do in the pool of choice"),
    )
    if given.choose:
        given.table = ("explanation/night.md", "night choices")
        publish(given, choices())
        return
    cases = [(scenario, visibility) for scenario, seen in CASES.items() for visibility in seen]
    found = [record(*case, given.policy, given.seeds) for case in progress(cases, "cases")]
    publish(given, found, docs_table)


if __name__ == "__main__":
    main()
