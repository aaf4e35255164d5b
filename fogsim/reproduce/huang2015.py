"""Huang (2015): tables 4.1, 4.2, 4.3, 5.1, 5.2 and 5.3 and the image confidence curves."""

from collections.abc import Sequence

import numpy as np

from fogsim.calibration.staged_road import road_renderer
from fogsim.estimators import make
from fogsim.estimators.huang2015_medians import Huang2015Repair
from fogsim.render import Renderer
from fogsim.reproduce.huang2015_chase import Chase, Scene, drawn, fogged
from fogsim.reproduce.huang2015_picture import Tracked, picture
from fogsim.reproduce.huang2015_plan import CAMERA, LAST, VARIANTS, VEHICLE, Case, Plan
from fogsim.reproduce.huang2015_tables import NOTES, records, tables, verdicts
from fogsim.reproduce.result import Reproduction, Steps, Watch, unwatched
from fogsim.reproduce.road_sweeps import steps_of, swept
from fogsim.values import Estimate, Observation


def reproduce(plan: Plan | None = None, *, watch: Watch = unwatched) -> Reproduction:
    """Run the evaluation again.

    Parameters
    ----------
    plan : Plan, optional
        A part of it; all by default.
    watch : Watch
        Told of every frame of every case that is done.

    Returns
    -------
    Reproduction
        A record for each case of a variant: its table, what was set, the thesis' figure and ours.
    """
    plan = plan or Plan()
    rng = np.random.default_rng(2015)
    cases = _cases(plan)
    # Each of the rough method's images is a step, and so is the picture.
    frames = sum(len(case.frames) for case in cases)
    steps = Steps(frames + len(plan.methods) + 1 + steps_of(plan.drives), watch)
    with road_renderer() as renderer:
        results: dict[Case, dict[float, Estimate]] = {}
        for way in ((False, False), (True, False), (False, True)):
            results |= _followed(renderer, [case for case in cases if (case.back, case.noisy) == way], rng, steps)
        rough = _rough(drawn(renderer, CAMERA, None, 0.0), plan.methods, rng, steps)
        shown = [Tracked(v, {name: results[Case(v, name)][LAST] for name in VARIANTS}) for v in plan.ratios]
        drawing = picture(renderer, Chase(CAMERA, VEHICLE), shown)
        steps.advance()
        sweeps, swept_tables = swept("huang2015_rough", Huang2015Repair, renderer, steps, plan.drives)
    found, told = records(results, rough, plan), tables(results, rough, plan)
    notes, all_tables = (*NOTES, *verdicts(found)), (*told, *swept_tables)
    return Reproduction("huang2015", tuple(found), told[0].rows, notes, drawing, all_tables, tuple(sweeps))


def _cases(plan: Plan) -> list[Case]:
    """Every case once."""
    found: dict[Case, None] = {}
    for name in VARIANTS:
        for visibility in {*plan.methods, *plan.ratios, *plan.tracks, *plan.references}:
            found[Case(visibility, name)] = None
        for visibility in plan.methods:
            found |= dict.fromkeys((Case(visibility, name, back=True), Case(visibility, name, noisy=True)))
        for interval, visibilities in plan.intervals.items():
            found |= dict.fromkeys(Case(v, name, interval) for v in visibilities)
        found |= dict.fromkeys(Case(v, name, start=start) for v in plan.references for start in plan.starts)
    return list(found)


def _followed(
    renderer: Renderer, cases: Sequence[Case], rng: np.random.Generator, steps: Steps
) -> dict[Case, dict[float, Estimate]]:
    """Show every frame to the estimators that want it; all of one way and one sensor."""
    estimators = {
        case: make("huang2015_lead", CAMERA, as_published=case.variant == "published", spacing=case.interval)
        for case in cases
    }
    results: dict[Case, dict[float, Estimate]] = {case: {} for case in cases}
    wanted: dict[float, dict[float, list[Case]]] = {}
    for case in cases:
        for ahead in case.frames:
            wanted.setdefault(ahead, {}).setdefault(case.visibility, []).append(case)
    order = sorted(wanted, reverse=any(case.back for case in cases))
    chase = Chase(CAMERA, VEHICLE, noisy=any(case.noisy for case in cases))
    for ahead, seen in chase.seen(renderer, {ahead: list(wanted[ahead]) for ahead in order}, rng):
        for visibility, observation in seen.items():
            for case in wanted[ahead][visibility]:
                results[case][ahead] = estimators[case].update(observation)
                steps.advance()
    return results


def _rough(
    scene: Scene, visibilities: Sequence[float], rng: np.random.Generator, steps: Steps
) -> dict[float, dict[str, Estimate]]:
    """Estimates from the road alone, by visibility and variant."""
    found: dict[float, dict[str, Estimate]] = {}
    for visibility in visibilities:
        seen = Observation(fogged(scene, visibility, 200.0, rng, noisy=False))
        found[visibility] = {
            name: make("huang2015_rough", CAMERA, as_published=name == "published").update(seen) for name in VARIANTS
        }
        steps.advance()
    return found
