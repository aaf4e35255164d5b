"""Wrong arguments to the Python API: every entry point answers with one line that names the argument and the value."""

import contextlib
import functools
import math
import pickle
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

import gymnasium
import numpy as np
import pytest

import fogsim
import fogsim.core.parameters
import fogsim_envs
from fogsim.core.parameters import NUMBER_OR_NAN, check_of, checked_parameters
from fogsim.dataset import depth, instance_mask, write_dataset
from fogsim.errors import InputError, SimulationError, UnknownNameError
from fogsim.estimators import ESTIMATORS, extinction_bound, make
from fogsim.fusion import make as make_fusion
from fogsim.script import all_of, negated, signal, to_yaml
from fogsim.simulation.recording import record_run
from fogsim.traffic.sumo.libsumo_link import load_libsumo
from fogsim.values import FogField
from fogsim.values.result_checks import checked_command
from fogsim_envs.camera_wrapper import FogCameraWrapper
from fogsim_envs.corridor import CorridorWeights, FogCorridorEnv
from fogsim_envs.demonstrations import record_demonstrations
from fogsim_envs.rewards import RewardWeights
from fogsim_envs.task import Episode, FogAdvisoryFastEnv, FogDistribution, ScenarioDistribution, TaskWeights
from fogsim_envs.task.surrogate import SurrogateTable
from fogsim_envs.vector import make_vector

GRID = Path(__file__).resolve().parents[1] / "data" / "grid"
ENVIRONMENTS = [one for one in gymnasium.registry if one.startswith("fogsim/")]
CAMERA = fogsim.Camera(64, 48, 60.0, (31.5, 23.5), 1.4)
IMAGE = np.zeros((48, 64, 3), np.uint8)
FAST = functools.partial(FogAdvisoryFastEnv, overrides=["duration_s=5"])
SIGN = ("sign", "speed_limit", 22.2, 80.0, -5.0, 0.9)
WRONG = [5, "x", [5], {"a": "b"}, object(), math.nan, np.zeros((2, 3))]
"""What no block, object or choice may be."""


def refusal(call: Callable[..., object], *arguments: Any, **options: Any) -> str:
    with pytest.raises(InputError) as error:
        call(*arguments, **options)
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.filterwarnings("ignore:.*render_mode")  # Gymnasium's own
def test_arguments_of_environments() -> None:
    for argument, values in [
        ("overrides", ["fog.visibility_m=80", 5, [5], {"fog.visibility_m": 80}]),
        ("image_size", ["a", (1,), (0, 0), (-1, 5), (1.5, 2), (10**9, 10**9), (160, 120, 3), 160]),
        ("reward_weights", [[1], {"progress": "x"}, {"a": "b"}, {1: 2}, math.nan, 5]),
        ("continuous", ["yes", 1, None]),
        ("render_mode", ["x"]),
        ("scenario", [5, [5], math.nan]),
        ("environment", [5, None, "nowhere-v0", "CartPole-v1"]),
        ("config", [5, "x", {"simulation_frequency": 0}]),
        ("visibility", ["x", None, math.nan, 0.0]),
        ("way", ["x", None, math.nan, -1.0]),
        ("timeout", ["x", None, math.nan, 0, -1]),
        ("split", ["x", 5, None]),
        ("observation", ["x", 5, None]),
        ("scenario_distribution", WRONG[:5]),
        ("fog_distribution", WRONG[:5]),
        ("surrogate", [5, "nowhere.json"]),
        ("overides", [[]]),
    ]:
        for name in ENVIRONMENTS:
            spec = gymnasium.spec(name)
            module, _, kind = str(spec.entry_point or spec.vector_entry_point).partition(":")
            make = gymnasium.make if spec.entry_point else gymnasium.make_vec
            known = fogsim.core.parameters.accepted_parameters(getattr(__import__(module, fromlist=[kind]), kind))
            for value in values:
                told = refusal(make, name, **{argument: value})
                if argument in known:
                    assert argument in told or value is None or isinstance(value, str)
                else:
                    assert f"unknown parameter '{argument}'; " in told
            if argument == "overides" and "overrides" in known:
                assert "did you mean 'overrides'? Known: " in told


def test_arguments_of_the_corridor_and_of_what_environments_are_given() -> None:
    for argument in ["scenario", "fog_distribution", "overrides", "reward_weights", "timeout", "split"]:
        told = refusal(FogCorridorEnv, **{argument: 5.5 if argument != "timeout" else "x"})
        assert argument in told
    for make_one, argument, value in [
        (RewardWeights, "progress", math.nan),
        (RewardWeights, "comfort", 1.0),
        (TaskWeights, "collision", math.inf),
        (TaskWeights, "lamps", 1.0),
        (CorridorWeights, "delay", "much"),
        (FogDistribution, "visibility", (50.0,)),
        (FogDistribution, "visibility", math.nan),
        (FogDistribution, "clear_share", 1.5),
        (ScenarioDistribution, "lanes", (0,)),
        (ScenarioDistribution, "lanes", ("two",)),
        (ScenarioDistribution, "drivers", {"unaffected": "often"}),
        (ScenarioDistribution, "light", 5),
        (Episode, "driver", "reckless"),
        (Episode, "settings", 5),
        (FogCameraWrapper, "env", 5),
    ]:
        assert argument in refusal(make_one, **{argument: value})


def test_arguments_of_vector_environments_and_demonstrations() -> None:
    assert "num_envs" in refusal(make_vector, num_envs=0)
    assert "context" in refusal(make_vector, context="thread")
    assert "did you mean 'overrides'" in refusal(make_vector, "fogsim/FogAdvisoryFast-v1", overides=[])
    assert "episodes" in refusal(record_demonstrations, "rule", "fogsim/FogAdvisoryFast-v1", 0, "x/y-v1")
    assert "discount" in refusal(fogsim_envs.evaluate, "rule", discount=math.nan)
    assert "seeds" in refusal(fogsim_envs.evaluate, "rule", seeds=[-1])


@pytest.fixture
def fast() -> Iterator[gymnasium.Env[Any, Any]]:
    made = FAST()
    yield made
    made.close()


def test_a_reset_that_is_refused_leaves_the_episode_as_it_was(fast: gymnasium.Env[Any, Any]) -> None:
    fast.reset(seed=3)
    expected = fast.step([12, 0])[0]
    for arguments in [
        {"options": 5},
        {"options": {"overides": []}},
        {"options": {"overrides": "fog.visibility_m=80"}},
        {"options": {"overrides": 5}},
        {"options": {"overrides": [5]}},
        {"options": {"overrides": ["fog.visibility_m=never"]}},
        {"options": {"scenario": 5}},
        {"options": {"visibility": math.nan}},
        {"options": {"driver": 5}},
        {"options": {"episode": {}}},
        {"options": {"episode": {"settings": 5, "driver": "observed", "light": "", "script": ""}}},
        {"options": {5: 5}},
        {"seed": -1},
        {"seed": 1.5},
        {"seed": "x"},
    ]:
        fast.reset(seed=3)
        refusal(fast.reset, **arguments)
        refusal(fast.step, "x")
        refusal(fast.step, [math.nan, 0])
        assert np.array_equal(fast.step([12, 0])[0], expected)
    # Seeds may have any whole type.
    assert np.array_equal(fast.reset(seed=np.int64(5))[0], fast.reset(seed=5)[0])


def test_options_of_version_0() -> None:
    with gymnasium.make("fogsim/FogAdvisory-v0", image_size=(32, 24)) as env:
        for options in ({"overides": []}, {"overrides": 5}, {"visibility": 60.0}):
            assert "reset(): options['" in refusal(env.reset, options=options)
        refusal(env.reset, options=5)
        refusal(env.reset, seed=-1)


@pytest.mark.filterwarnings("ignore:.*ERROR")  # Gymnasium's own about its workers
def test_an_error_from_another_process_is_the_same_error() -> None:
    made = make_vector("fogsim/FogAdvisoryFast-v1", num_envs=1, overrides=["duration_s=5"])
    unknown = pytest.raises(UnknownNameError, match=r"unknown driver 'reckless'; known: ")
    with contextlib.closing(made) as envs, unknown:
        envs.reset(options={"driver": "reckless"})
    error = UnknownNameError("driver", "reckless", ("observed", "too_fast"))
    copied = pickle.loads(pickle.dumps(error))  # noqa: S301 - our own
    assert (type(copied), str(copied)) == (UnknownNameError, str(error))


def test_a_table_of_the_surrogate(tmp_path: Path) -> None:
    path = tmp_path / "table.json"
    for text in ("[]", "{}", '{"method": 5}', "x", '{"method": "a", "edges": [[1], [1, 2]]}'):
        path.write_text(text, encoding="utf-8")
        refusal(SurrogateTable.load, path)
    path.write_text(SurrogateTable.load().as_json().replace('"edges": [', '"edges": [1, '), encoding="utf-8")
    assert "shape" in refusal(SurrogateTable.load, path)


ENTRIES: dict[str, tuple[Callable[..., object], dict[str, Any], str]] = {
    "run": (fogsim.run, {}, "scenario"),
    "run traffic": (fogsim.run_traffic, {}, "scenario"),
    "ClosedLoop": (fogsim.ClosedLoop, {}, "scenario"),
    "connect": (fogsim.connect, {}, "scenario"),
    "attach to a scenario": (fogsim.attach, {"api": None, "ego": "ego"}, "scenario"),
    "record_run": (record_run, {"seed": 0, "out": "x"}, "scenario"),
    "write_dataset": (write_dataset, {"out": "x", "frames": 1}, "scenario"),
    "depth": (depth, {}, "step"),
    "instance_mask": (instance_mask, {}, "step"),
    "semantic_mask": (fogsim.semantic_mask, {}, "step"),
    "transmission": (fogsim.transmission, {}, "step"),
    "to_yaml": (to_yaml, {}, "scenario"),
    "make": (functools.partial(make, "negru2013"), {}, "camera"),
    "make_fusion": (make_fusion, {}, "name"),
    "extinction_bound": (functools.partial(extinction_bound, CAMERA), {}, "scene"),
    "frame": (fogsim.Observation, {}, "frame"),
    "lead": (fogsim.Observation, {"frame": IMAGE}, "lead"),
    "signs": (fogsim.Observation, {"frame": IMAGE}, "signs"),
    "light": (fogsim.Observation, {"frame": IMAGE}, "light"),
    "lamps": (fogsim.Observation, {"frame": IMAGE}, "lamps"),
    "reports": (fogsim.Observation, {"frame": IMAGE}, "reports"),
    "right": (fogsim.Observation, {"frame": IMAGE}, "right"),
    "image": (fogsim.Frame, {"time": 0.0, "camera": CAMERA}, "image"),
    "camera": (fogsim.Frame, {"time": 0.0, "image": IMAGE}, "camera"),
    "second image": (fogsim.SecondView, {"baseline": 0.5}, "image"),
    "banks": (FogField, {"extinction": 0.1, "airlight": (1.0, 1.0, 1.0)}, "banks"),
    "airlight": (FogField, {"extinction": 0.1}, "airlight"),
}


def test_objects_of_the_wrong_type() -> None:
    for entry, (call, others, argument) in ENTRIES.items():
        for value in [*WRONG, IMAGE / 255.0, IMAGE.astype(np.int64)]:
            assert argument in refusal(call, **others, **{argument: value}) or isinstance(value, str), entry


def test_numbers_of_the_wrong_type() -> None:
    for call, argument in [
        (functools.partial(fogsim.Frame, image=IMAGE, camera=CAMERA), "time"),
        (functools.partial(fogsim.Observation, IMAGE), "speed"),
        (functools.partial(fogsim.Observation, IMAGE), "camera_setback"),
        (functools.partial(fogsim.LeadMeasurement, 30.0), "relative_speed"),
        (functools.partial(fogsim.LightMeasurement), "illuminance"),
        (functools.partial(fogsim.SignSighting, *SIGN), "height"),
        (functools.partial(fogsim.SecondView, IMAGE), "baseline"),
        (functools.partial(FogField, airlight=(1.0, 1.0, 1.0)), "extinction"),
        (functools.partial(fogsim.Camera, 64, 48, principal_point=(1, 2), mount_height=1.0), "focal_length"),
    ]:
        for value in (None, "a", [1.0], True, object(), np.zeros(2), 1j):
            assert argument in refusal(call, **{argument: value})


def test_estimators_refuse_what_is_no_observation() -> None:
    for method in ESTIMATORS:
        estimator = make(method, CAMERA)
        for value in (None, *WRONG, IMAGE, fogsim.Frame(0.0, IMAGE, CAMERA)):
            assert refusal(estimator.update, value).startswith("update(): observation must be an Observation, got ")
        refusal(estimator.update)


def test_what_scenarios_and_runs_are_named_by() -> None:
    scenario = fogsim.load_scenario("motorway_fog_bank")
    for value in (None, *WRONG):
        refusal(fogsim.load_scenario, value)
        refusal(fogsim.load_scenario, "motorway_fog_bank", value)
        refusal(make, value, CAMERA)
    for seed in (-1, 1.5, None, "x", math.nan, True):
        for call in (fogsim.run, fogsim.run_traffic):
            assert "seed" in refusal(call, scenario, seed)
    assert "traffic" in refusal(fogsim.run, scenario, 0, 5)
    for option, value in (
        ("port", "8813"), ("port", 0), ("port", 10**6), ("host", 5), ("timeout", None), ("order", "x"), ("retries", -1),
    ):  # fmt: skip
        assert option in refusal(fogsim.connect, scenario, **{option: value})
    for option, value in (("recorders", "table"), ("recorders", [5]), ("recorders", 5), ("out", 5), ("watch", 5)):
        assert option in refusal(record_run, **{"scenario": scenario, "seed": 0, "out": "nowhere", option: value})
    assert not Path("nowhere").exists()


def test_commands() -> None:
    for field in ["lamps_of", "advised_speeds", "stretches", "advice", "lamps", "control", "warning"]:
        for value in WRONG:
            assert field in refusal(checked_command, fogsim.Command(**{field: value})) or value == {"a": "b"}


def test_conditions() -> None:
    for value in (None, *WRONG):
        refusal(all_of, value)
        refusal(negated, value)
    for value in (None, 5, [5]):
        refusal(signal, value)


def test_calls_that_do_not_fit() -> None:
    assert refusal(fogsim.Observation).endswith("missing a required argument: 'frame'")
    told = refusal(fogsim.Observation, IMAGE, sped=3.0)
    assert told.startswith("Observation: unknown parameter 'sped'; did you mean 'speed'? Known: frame, speed")
    assert refusal(fogsim.LeadMeasurement, 1.0, 2.0, 3.0).endswith("too many positional arguments")


def test_errors_within_a_call_stay_what_they_are() -> None:
    @checked_parameters
    def fails(number: int) -> None:
        raise TypeError(f"of the user's own: {number}")

    with pytest.raises(TypeError, match="of the user's own: 3"):
        fails(3)


def test_what_annotations_of_classes_allow() -> None:
    for annotation, good, bad, told in [
        (np.ndarray, [IMAGE], [[1]], "an array"),
        (tuple[int, str], [(1, "a"), [1, "a"]], [(1,), (1, 2), 5], "2 values, each a whole number"),
        (tuple[int, ...], [(), [1], np.ones(2, int)], [(1.5,), "ab", 5], "a list, each a whole number"),
        (dict[str, int], [{}, {"a": 1}], [5, []], "a mapping"),
        (dict[str, int], [], [{1: 1}], "a mapping, each key text"),
        (Path | str, ["a", Path("a")], [5], "a path or text"),
        (Callable[[], int], [len], [5], "callable"),
        (Annotated[float, NUMBER_OR_NAN], [1, math.inf, math.nan], ["a", True], "a number"),
        (Literal["fork", "spawn"], ["fork"], ["forc"], "'fork' or 'spawn' (did you mean 'fork'?)"),
        (Any, [5], [], ""),
    ]:
        check = check_of(annotation, classes=True) or (lambda _: None)
        assert [check(value) for value in good] == [None] * len(good)
        assert [check(value) for value in bad] == [told] * len(bad)


@pytest.mark.parametrize("steps", [2, 16, 30])
def test_a_simulation_that_is_loaded_under_a_session(steps: int) -> None:
    """Whether its time has then gone back, on by one step, or far on."""
    libsumo, arguments = load_libsumo(), ["-c", str(GRID / "grid.sumocfg"), "--step-length", "0.5", "--no-step-log"]
    libsumo.start(["sumo", *arguments])
    try:
        session = fogsim.attach(
            libsumo, ego="veh0", visibility=100.0, settings=("renderer=none", "estimators=[]"), drivers=False
        )
        for _ in range(15):
            libsumo.simulationStep()
            step = session.observe()
        libsumo.load(arguments)
        for _ in range(steps):
            libsumo.simulationStep()
        for call in (session.observe, functools.partial(session.advise, step)):
            with pytest.raises(SimulationError, match="was loaded again while FogSim was using it: attach to it"):
                call()
        refusal(session.advise, None)
        session.close()
    finally:
        libsumo.close()
