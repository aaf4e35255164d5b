"""The closed loop on real parts."""

import itertools
import math
from collections.abc import Iterable, Iterator
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from early_motorway import EARLY, ROUTES

import fogsim
from fogsim.errors import InputError, SimulationError
from fogsim.scenario import Scenario, build, scenario_from_config
from fogsim.simulation.advised_driving import spread_advice
from fogsim.simulation.loop import ClosedLoop, DriversFog
from fogsim.traffic.sumo_traffic import SumoTraffic
from fogsim.values import (
    Collision,
    Command,
    Display,
    Ending,
    FogBank,
    FogChange,
    FogField,
    Lamp,
    SpeedAdvice,
    Step,
    Stretch,
    StretchAdvice,
    TrafficState,
)
from tests.helpers.attached import GRID
from tests.helpers.command import run_python

SMALL = (EARLY, "camera.width=160", "camera.height=120", "duration_s=4")
BLIND = ("renderer=none", "estimators=[]")


def small(*overrides: str) -> Scenario:
    return fogsim.load_scenario("motorway_fog_bank", [*SMALL, *overrides])


@pytest.fixture(scope="module")
def foggy() -> list[Step]:
    return list(fogsim.run(small("fog.visibility_m=60"), seed=1))


def test_steps_follow_the_clocks_and_end_in_time(foggy: list[Step]) -> None:
    assert [s.index for s in foggy] == list(range(41))
    assert [s.time for s in foggy] == [i / 10 for i in range(41)]  # 3.8 is 3.8, not 3.8000000000000003
    assert [s.ending for s in foggy[:-1]] == [None] * 40
    assert foggy[-1].ending is Ending.TIME


def test_whoever_gets_a_step_may_change_its_arrays() -> None:
    def moved(changes: bool) -> float:
        with ClosedLoop(small(*BLIND)) as loop:
            steps = [loop.start(1)]
            while steps[-1].ending is None:
                for field in fields(TrafficState) if changes else ():
                    if isinstance(values := getattr(steps[-1].traffic, field.name), np.ndarray):
                        values[...] = 0
                steps.append(loop.advance(Command(SpeedAdvice(15.0))))
        return float(
            np.sum([steps[-1].traffic.position.sum(), steps[-1].traffic.length.sum(), steps[-1].route_position])
        )

    assert moved(changes=True) == moved(changes=False)


def test_a_command_is_decided_once_a_decision_period(foggy: list[Step]) -> None:
    changes = [s.index for a, s in itertools.pairwise(foggy) if s.command is not a.command]
    assert changes == list(range(1, 41, 5))


def test_advice_may_go_to_every_vehicle_near_the_ego() -> None:
    advised = (*BLIND, "fog.visibility_m=60", "advice={method: stopping_sight_distance, informed_by: truth}")
    ego, everybody = (
        list(fogsim.run(small(*advised, f"drivers.advised={whom}"), seed=1))[-1] for whom in ("ego", "all")
    )
    assert everybody.command.advice_reach == 1000.0
    assert not ego.command.is_for_others
    # 2 s at 2 m/s², after the delay of 2 s.
    assert np.mean(everybody.traffic.speed) < np.mean(ego.traffic.speed) - 2.0


def test_others_follow_advice_in_clear_air_too() -> None:
    advice = StretchAdvice(15.0, Stretch(0.0, 4000.0))
    with ClosedLoop(small("fog.visibility_m=inf", *BLIND)) as loop:
        before = mean_eastbound_speed(loop.start(1))
        for _ in range(40):
            step = loop.advance(Command(SpeedAdvice(15.0), stretches=(advice,)))
    assert mean_eastbound_speed(step) < before - 3.0


def mean_eastbound_speed(step: Step) -> float:
    """Of those who go the ego's way [m/s]."""
    return float(step.traffic.speed[[name.startswith("east") for name in step.traffic.ids]].mean())


def test_the_road_fills_once_where_the_way_is_written_and_anew_where_it_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    starts: list[int] = []
    start = SumoTraffic.start
    monkeypatch.setattr(SumoTraffic, "start", lambda self, seed: starts.append(seed) or start(self, seed))
    settings = ("fog.visibility_m=80", "duration_s=0.5", *BLIND)
    scenario = small(*settings)
    written = [step.traffic.position for step in fogsim.run(scenario, seed=1)]
    assert len(starts) == 1

    # The same way as a trip, which SUMO routes itself, so that no file tells it.
    demand = ROUTES.read_text(encoding="utf-8")
    trip = demand.replace('<vehicle id="ego"', '<trip id="ego" from="approach" to="exit"').replace(
        'type="ego_car" route="eastbound"', 'type="ego_car"'
    )
    (tmp_path / "trip.rou.xml").write_text(trip, encoding="utf-8")
    routed = small(*settings, f"traffic.routes=[{tmp_path / 'trip.rou.xml'}]")
    found = [step.traffic.position for step in fogsim.run(routed, seed=1)]
    assert len(starts) == 3
    # Not all of them have the same vehicles near the ego.
    for one, other in zip(found, written, strict=True):
        np.testing.assert_array_equal(one, other)


def test_drivers_who_see_through_fog_drive_in_it_as_in_clear_air() -> None:
    settings = (*BLIND, "clocks.camera_period_s=0.5", "duration_s=3", "advice=none")
    seeing = small(*settings, "fog.visibility_m=30", "drivers.see_through_fog=true")
    clear = small(*settings, "fog.visibility_m=inf", "drivers.see_through_fog=true")
    in_fog = [step.traffic.position for step in fogsim.run(seeing, seed=1)]
    for position, step in zip(in_fog, fogsim.run(clear, seed=1), strict=True):
        np.testing.assert_array_equal(position, step.traffic.position)


@pytest.mark.parametrize(
    "visibility", [50.0, *(pytest.param(one, marks=pytest.mark.nightly) for one in (100.0, 200.0))]
)
def test_in_homogeneous_fog_the_belief_follows_the_truth_and_advice_follows_the_belief(visibility: float) -> None:
    scenario = fogsim.load_scenario(
        "motorway_fog_bank",
        [EARLY, "camera.width=320", "camera.height=240", "duration_s=8", f"fog.visibility_m={visibility}"],
    )
    last = list(fogsim.run(scenario, seed=2))[-1]
    assert last.truth.visibility == pytest.approx(visibility)
    assert last.truth.visibility_ahead == pytest.approx(visibility, rel=1e-3)
    assert last.belief.visibility == pytest.approx(visibility, rel=0.35)
    assert last.command.advice.speed < 110 / 3.6


def test_a_vehicle_knows_which_of_its_lamps_are_switched_on(foggy: list[Step]) -> None:
    first, *_, last = foggy
    assert first.observation.lamps == Lamp.POSITION | Lamp.LOW_BEAM
    assert last.observation.lamps == first.observation.lamps | Lamp.FRONT_FOG == last.command.lamps


def test_estimators_are_told_a_calibration_that_may_be_wrong() -> None:
    # An estimator that trusts the pitch it is told, before a road that stands out.
    snow = "fog={visibility_m: 80, ground_albedo: 0.8}"
    trusting = ("estimators=[{method: joint_road, parameters: {pitch_deviation: 0.0001}}]", "advice=none")
    wrong = small(snow, "camera.told.pitch_error_deg=0.5", "duration_s=0.5", *trusting)
    right = small(snow, "duration_s=0.5", *trusting)
    (*_, a), (*_, b) = fogsim.run(right, seed=1), fogsim.run(wrong, seed=1)
    assert np.array_equal(a.observation.image, b.observation.image)
    assert b.observation.frame.camera.pitch - a.observation.frame.camera.pitch == pytest.approx(np.radians(0.5))
    # A horizon that is told too high makes the road seem nearer: the fog seems denser.
    assert a.estimates[0].valid
    assert b.estimates[0].valid
    assert b.estimates[0].extinction > 1.05 * a.estimates[0].extinction


def fingerprint(steps: Iterable[Step]) -> list[bytes]:
    return [
        s.observation.image.tobytes() + s.traffic.position.tobytes() + s.belief.probability.tobytes() for s in steps
    ]


def test_the_same_seed_gives_the_same_run_bit_for_bit(foggy: list[Step]) -> None:
    again, other = (
        fingerprint(itertools.islice(fogsim.run(small("fog.visibility_m=60"), seed), 11)) for seed in (1, 2)
    )
    assert fingerprint(foggy[:11]) == again != other


def test_a_restarted_loop_replays_a_fresh_one() -> None:
    def drive(loop: fogsim.ClosedLoop) -> list[bytes]:
        def steps() -> Iterator[Step]:
            yield loop.start(5)
            for _ in range(6):
                yield loop.advance(Command())

        return fingerprint(steps())

    with fogsim.ClosedLoop(small()) as loop:
        first = drive(loop)
        assert drive(loop) == first


def test_traffic_runs_ahead_of_the_pictures_and_no_farther_than_the_end() -> None:
    def drive(periods: int) -> tuple[list[Step], float]:
        with ClosedLoop(small("duration_s=1.2")) as loop:
            steps = [loop.start(1)]
            while steps[-1].ending is None:
                steps.append(loop.advance(steps[-1].command, periods))
            return steps, loop._traffic._run.roster.time

    (single, ended), (ahead, ended_ahead) = drive(1), drive(5)
    assert ahead[-1].ending is Ending.TIME
    assert fingerprint(ahead) == fingerprint([*single[:-1:5], single[-1]])
    assert ended_ahead == ended == ahead[-1].traffic.time


def test_collisions_of_all_periods_count(monkeypatch: pytest.MonkeyPatch) -> None:
    with ClosedLoop(small("duration_s=1.2")) as loop:
        loop.start(1)
        hit, see = Collision(0.0, "one", "another", 5.0), loop._traffic.observe
        found = iter([(), (hit,), ()])
        monkeypatch.setattr(loop._traffic, "observe", lambda: replace(see(), collisions=next(found)))
        assert loop.advance(Command(), 3).collisions == (hit,)


def test_a_restarted_loop_lays_road_and_fog_along_the_egos_new_route(tmp_path: Path) -> None:
    (tmp_path / "demand.rou.xml").write_text(
        """<routes><routeDistribution id="ways">
        <route id="west" edges="B0A0" probability="0.5"/><route id="east" edges="A0B0" probability="0.5"/>
        </routeDistribution><vehicle id="ego" depart="0" route="ways"/></routes>""",
        encoding="utf-8",
    )
    files = f'<net-file value="{GRID / "grid.net.xml"}"/><route-files value="demand.rou.xml"/>'
    (tmp_path / "own.sumocfg").write_text(f"<configuration>{files}</configuration>", encoding="utf-8")
    fog = ("fog.outside_visibility_m=1000", "fog.banks=[{start_m: 5, end_m: 40, edge_m: 5, visibility_m: 50}]")
    scenario = scenario_from_config(tmp_path / "own.sumocfg", "ego", [*BLIND, *fog])

    def began(loop: ClosedLoop, seed: int) -> tuple[list[float], tuple[FogBank, ...]]:
        route, fog = loop.start(seed).truth.route, loop._fog
        return route[0].tolist(), fog.banks

    with ClosedLoop(scenario) as loop:
        again = [began(loop, seed) for seed in range(4)]
    assert len({tuple(start) for start, _ in again}) == 2
    for seed, found in enumerate(again):
        with ClosedLoop(scenario) as loop:
            assert found == began(loop, seed), seed


def test_a_run_that_is_over_does_not_go_on() -> None:
    with fogsim.ClosedLoop(small("duration_s=0.1", *BLIND)) as loop:
        with pytest.raises(SimulationError, match="not been started"):
            loop.advance(Command())
        loop.start(1)
        with pytest.raises(InputError, match="periods: expected at least 1, got 0"):
            loop.advance(Command(), 0)
        assert loop.advance(Command()).ending is Ending.TIME
        with pytest.raises(SimulationError, match="is over"):
            loop.advance(Command())


def test_importing_starts_no_sumo_and_no_gl() -> None:
    """Nor do runs load a reader of scenario files."""
    code = (
        "import sys, fogsim.simulation.plugin, fogsim.simulation.recording\n"
        "assert not {'fogsim.scenario', 'pydantic'} & set(sys.modules)\n"
        "import fogsim, fogsim_envs, fogsim.render, fogsim.scene, fogsim.simulation.loop\n"
        "assert not {'libsumo', 'OpenGL', 'pyrender'} & set(sys.modules), sorted(sys.modules)"
    )
    run_python("-c", code)


def test_public_names_are_there() -> None:
    for name in fogsim.__all__:
        assert getattr(fogsim, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = fogsim.nonsense
    assert Path(fogsim.__file__).with_name("py.typed").is_file()


def test_advice_goes_to_everybody_near_the_ego_only_if_the_scenario_says_so() -> None:
    told = Command(advice=SpeedAdvice(20.0))
    alone, everybody = (
        build.advice_config(fogsim.load_scenario("motorway_fog_bank", [f"drivers.advised={whom}"]))
        for whom in ("ego", "all")
    )
    assert spread_advice(told, alone) is told
    assert spread_advice(told, everybody) == replace(told, advice_reach=1000.0)
    assert not spread_advice(Command(), everybody).is_for_others
    stretch = "drivers.advised_stretch={start_m: 500, end_m: inf, display: message_sign}"
    signs = build.advice_config(fogsim.load_scenario("motorway_fog_bank", ["drivers.advised=stretch", stretch]))
    shown = StretchAdvice(20.0, Stretch(500.0), Display.MESSAGE_SIGN)
    assert spread_advice(told, signs) == replace(told, stretches=(shown,))


def test_the_fog_of_the_drivers_moves_on_with_time() -> None:
    entered = []
    traffic = SimpleNamespace(enter_fog=entered.append)
    changes = (FogChange(0.0, 1.0, -math.inf, 100.0), FogChange(10.0, 3.0, -math.inf, 100.0))
    thickening = FogField(0.01, (1.0,) * 3, changes=changes)
    fog = DriversFog()
    fog.set_time(5.0)
    assert not fog.is_entered
    fog.enter(thickening, traffic)
    assert fog.is_entered
    seen = []
    for time in (0.0, 5.0, 10.0):
        fog.set_time(time)
        seen.append(float(entered[0].extinction(np.array([0.0, 0.0, 1.0]))))
    assert len(entered) == 1
    assert seen == pytest.approx([0.01, 0.02, 0.03])


def test_drivers_and_the_camera_are_in_the_patches_of_the_runs_seed() -> None:
    settings = (EARLY, *BLIND, "fog={visibility_m: 60, patches: {correlation_length_m: 50}}")
    with ClosedLoop(fogsim.load_scenario("motorway_fog_bank", settings)) as loop:
        patches = [loop.start(seed).truth.fog.patches for seed in (1, 2, 1)]
        assert loop._drivers_fog.matches(loop.start(2).truth.fog)
    assert patches[0] == patches[2] != patches[1]
