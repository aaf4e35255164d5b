"""Traffic in fog against field studies: speeds, overdriving, headways and times to collision on a motorway."""

import math

from fogsim.reproduce.drivers.plan import REPORT_SEEDS, SIGNED, SIGNS, Case, Pair, Plan, Results
from fogsim.reproduce.drivers.road import Measures, PairMeasures, drive, follow, measured
from fogsim.reproduce.drivers.tables import picture, records, tables
from fogsim.reproduce.result import Reproduction, Steps, Watch, chosen_tables, unwatched
from fogsim.units import KMH_PER_MPS

NOTES = (
    "* one of the six sizes that are to be met within 30 %; of the reports only abstracts and summaries were seen",
    "free: 5 s or more behind the vehicle ahead (speeds at the smallest demand); followers: less (the middle demand)",
    "overdrives: too fast to stop within V_met by the Highway Code (0.67 s, 6.57 m/s²), by which the M4 was judged",
    "M4 flows are not published, and shares of headways depend on them: ours are those of 600 vehicles/h in a lane",
    "headways in clear air (0.5 to 2 s over the gap, in equal shares) and speeds (70 mph ± 10 %) belong to the demand, "
    "not to FogSim's drivers",
    "the free speed falls a little at 200 m already: who does not see a leader has no wish to overtake, and stays left",
    "SR281's more than half at ≤ 50 m is ours at 50 m: with the A16's 29 km/h at 30 m nobody overdrives there",
)


def reproduce(
    plan: Plan | None = None, *, quick: bool = False, table: str | None = None, watch: Watch = unwatched
) -> Reproduction:
    """Run traffic by demand and visibility next to published findings; there are no tables to choose from."""
    chosen_tables((), table)
    plan = plan or (Plan(seeds=REPORT_SEEDS[:2]) if quick else Plan())
    cases: tuple[Case | Pair, ...] = (*plan.cases, *plan.pairs)
    steps = Steps(len(cases) * len(plan.seeds) + 1, watch)
    runs: dict[Case | Pair, tuple[Measures | PairMeasures, ...]] = {}
    for case in cases:
        found = []
        for seed in plan.seeds:
            found.append(_run(case, seed, plan))
            steps.advance()
        runs[case] = tuple(found)
    results = Results(runs)
    shown = tables(results, plan)
    drawing = picture(results, plan)
    steps.advance()
    return Reproduction("drivers", records(results, plan), shown[0].rows, NOTES, drawing, shown)


def _run(case: Case | Pair, seed: int, plan: Plan) -> Measures | PairMeasures:
    overrides = plan.overrides(case)
    if isinstance(case, Pair):
        return follow(overrides, case.leader_speed, case.visibility, seed, plan.followers)
    advised = SIGNS[case.visibility] / KMH_PER_MPS if case.population == SIGNED else math.inf
    seen = drive(overrides, case.demand, case.visibility, seed, plan.seconds, advised)
    return measured(seen, case.visibility, plan.seconds)
