"""Huang (2015): tables 4.1, 4.2, 4.3, 5.1, 5.2 and 5.3 and the image confidence curves."""

from collections.abc import Mapping, Sequence

import numpy as np

from fogsim.calibration.staged_road import StagedVehicle, road_renderer
from fogsim.estimators import make
from fogsim.estimators.huang2015_medians import Huang2015Repair
from fogsim.render import Renderer
from fogsim.reproduce.huang2015_chase import Chase, drawn, fogged
from fogsim.reproduce.huang2015_figures import (
    LAST,
    TABLES,
    VARIANTS,
    Case,
    Results,
    cells,
    error_table,
    figures,
    records,
    seen_visibility,
    wanted_cases,
)
from fogsim.reproduce.huang2015_picture import Tracked, picture
from fogsim.reproduce.huang2015_published import TABLE_4_1
from fogsim.reproduce.paper_cells import chosen_tables
from fogsim.reproduce.result import Cell, Reproduction, Rows, Steps, TitledTable, Watch, unwatched
from fogsim.reproduce.road_sweeps import DRIVES, steps_of, swept
from fogsim.values import Camera, Estimate, Observation

CAMERA = Camera(800, 600, 5600.0, (399.5, 299.5), mount_height=1.0)
"""λ = 5600 px·m and H = 1 m are eq. 4.11's; the thesis states no size of image."""

VEHICLE = StagedVehicle(length=4.7, width=1.8, height=1.45, paint=(0.03, 0.05, 0.12))
"""The vehicle that is followed: the thesis shows dark ones and does not state their size."""

SAMPLES = 3
"""Samples a pixel side: with one, a number plate of 15 rows is 15 or 16 rows high, and variances scatter by 6 %."""

_PICTURED = (150.0, 500.0)
"""Visibilities of figure 4.9's confidence curves [m]."""

_NOTES = (
    "The thesis states neither size of image nor camera; its vehicles are clipped by hand from a simulator's pictures,"
    " which seem to be without noise. Ours: 800x600 px, airlight at 200 of 255 levels, noise of photons and read-out"
    " only where it says 'noisy', a radar's range with 0.25 m of noise; the estimator finds and follows the vehicle.",
    "Its eq. 4.11 has f = 1.4 mm, 400 px/mm and H = 1 m, which makes λ = 560 px·m, and says 5600. Table 4.1 decides:"
    " its first estimates lie 15, 11, 18, 20 and 12 rows below the true inflections if λ = 5600 (it speaks of '10"
    " pixels inaccuracy'), and 1 to 2 rows if it is 560. So its camera has a long lens, and so has ours: a car at 25 m"
    " is 400 px wide.",
    "As published, the optimisation takes the bottom row's luminance for the road's own. It is fogged: with this lens"
    " that row is 19 m away and has 141 levels where the road has 19 (V_met = 50 m), so V_met is too large.",
    "As published, variances are taken on the vehicle's body, 0.68 × 0.55 of its width. A noisy range changes how much"
    " sky next to its roof a larger window holds, and by that the ratio of two variances by up to 25 %.",
    "As published, noise adds to every variance; without noise, 8 bits leave steps of flat paint that nothing dithers.",
    "25 to 90 m every 5 m are 14 pictures over 65 m, not 13 over 75 m. Table 5.1 has tracks of up to 250 m: that"
    " vehicle is followed to 275 m.",
    "Corrected stands in table 4.2 for the ratio of variances that its extinction means: it compares no variances.",
    "An interval of 40 m leaves two pictures and so one ratio; the corrected variant needs three.",
)


def reproduce(*, quick: bool = False, table: str | None = None, watch: Watch = unwatched) -> Reproduction:
    """Follow vehicles through fog; `quick` ends the chase where the thesis' ends and runs each sweep once."""
    wanted = figures(chosen_tables(TABLES, table))
    more = [Case(v, back=back, noisy=not back) for v in TABLE_4_1 for back in (True, False)]
    if quick or table is not None:
        more = []
    cases = wanted_cases(wanted, [*more, *map(Case, _PICTURED)])
    road = sorted({figure.visibility for figure in wanted if figure.case is None})
    drives = 0 if table is not None else 1 if quick else DRIVES
    steps = Steps(sum(len(c.frames(last)) for c, last in cases.items()) + len(road) + 1 + steps_of(drives), watch)
    rng = np.random.default_rng(2015)
    with road_renderer() as renderer:
        results: dict[Case, dict[str, dict[float, Estimate]]] = {}
        for way in ((False, False), (True, False), (False, True)):
            alike = {case: last for case, last in cases.items() if (case.back, case.noisy) == way}
            results |= _followed(renderer, alike, rng, steps) if alike else {}
        rough = _rough(renderer, road, rng, steps)
        shown = [Tracked(v, {name: results[Case(v)][name][LAST] for name in VARIANTS}) for v in _PICTURED]
        drawing = picture(renderer, Chase(CAMERA, VEHICLE, samples=SAMPLES), shown)
        steps.advance()
        sweeps: list[dict[str, Cell]] = []
        more_tables: tuple[TitledTable, ...] = ()
        if drives:
            sweeps, more_tables = swept("huang2015_rough", Huang2015Repair, renderer, steps, drives)
    compared = cells(wanted, results, rough)
    tables = [TitledTable("Median error against the truth, of figures that are given", error_table(wanted, compared))]
    if more:
        tables.append(TitledTable("Beyond the thesis: V_met [m] on the way back, and noisy", _ways(more, results)))
    return Reproduction(
        "huang2015",
        tuple(records(wanted, more, results, rough)),
        tables[0].rows,
        _NOTES,
        drawing,
        (*tables, *more_tables),
        tuple(sweeps),
        tuple(compared),
    )


def _followed(
    renderer: Renderer, cases: Mapping[Case, float], rng: np.random.Generator, steps: Steps
) -> dict[Case, dict[str, dict[float, Estimate]]]:
    """Show every frame to the estimators that need it; all of one way and one sensor."""
    estimators = {
        (case, name): make("huang2015_lead", CAMERA, as_published=name == "published", spacing=case.interval)
        for case in cases
        for name in VARIANTS
    }
    results: dict[Case, dict[str, dict[float, Estimate]]] = {case: {name: {} for name in VARIANTS} for case in cases}
    wanted: dict[float, dict[float, list[Case]]] = {}
    for case, last in cases.items():
        for ahead in case.frames(last):
            wanted.setdefault(ahead, {}).setdefault(case.visibility, []).append(case)
    order = sorted(wanted, reverse=any(case.back for case in cases))
    chase = Chase(CAMERA, VEHICLE, noisy=any(case.noisy for case in cases), samples=SAMPLES)
    for ahead, seen in chase.seen(renderer, {ahead: list(wanted[ahead]) for ahead in order}, rng):
        for visibility, observation in seen.items():
            for case in wanted[ahead][visibility]:
                for name in VARIANTS:
                    results[case][name][ahead] = estimators[case, name].update(observation)
                steps.advance()
    return results


def _rough(
    renderer: Renderer, visibilities: Sequence[float], rng: np.random.Generator, steps: Steps
) -> dict[float, dict[str, Estimate]]:
    """Estimates from the road alone, by visibility and variant."""
    scene = drawn(renderer, CAMERA, None, 0.0)
    found: dict[float, dict[str, Estimate]] = {}
    for visibility in visibilities:
        seen = Observation(fogged(scene, visibility, 200.0, rng, noisy=False))
        found[visibility] = {
            name: make("huang2015_rough", CAMERA, as_published=name == "published").update(seen) for name in VARIANTS
        }
        steps.advance()
    return found


def _ways(more: Sequence[Case], results: Results) -> Rows:
    rows: list[tuple[str, ...]] = [("V_met", "way", *VARIANTS)]
    for case in more:
        last = case.frames()[-1]
        found = [seen_visibility(results[case][name][last]) for name in VARIANTS]
        shown = ["—" if visibility is None else f"{visibility:.0f}" for visibility in found]
        rows.append((f"{case.visibility:.0f}", "back" if case.back else "noisy", *shown))
    return tuple(rows)
