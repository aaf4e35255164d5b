"""No method sees the truth: not in the loop, not through its imports (contracts), not through what it is given."""

import ast
import dataclasses
import enum
import pickle
import zlib
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from early_motorway import EARLY
from osi3.osi_motionrequest_pb2 import MotionRequest
from tiny_network import write_network, write_policy

import fogsim
from fogsim.advice.agent import AGENT_STATE
from fogsim.estimators import ESTIMATORS
from fogsim.values import (
    Camera,
    CameraPose,
    Estimate,
    FogField,
    FogReport,
    Frame,
    LeadMeasurement,
    LightMeasurement,
    Observation,
    SignMap,
    SignSighting,
    Step,
    TrafficState,
    Truth,
)
from tests.helpers.command import run_python
from tests.helpers.osi_peer import framed, osi_peer

TRUTHFUL = ("render", "traffic", "atmosphere", "scene", "camera", "sensors", "scenario", "simulation")
"""Modules of fogsim that know the truth."""

UNSEEN = {"Truth", "Step", "View", "FogField", "FogBank", "FogChange", "FogPatches", "CameraPose", "TrafficState"} | {
    "TrafficSnapshot", "Leader", "Collision", "Scene", "Mesh", "Batch", "RoadNetwork", "Lights", "LightSources"
}  # fmt: skip
"""Value types that hold it."""


@pytest.fixture(scope="module")
def methods(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Every method that is registered, and a network of the pixels' mean where its extra is installed."""
    network = tmp_path_factory.mktemp("network") / "mean.onnx"
    guests = [f"onnx:{write_network(network)}"] if find_spec("onnx") and find_spec("onnxruntime") else []
    return sorted([*ESTIMATORS, *guests])


def drive(methods: list[str], controller: str = "cruise_control", seconds: float = 1.0) -> list[Step]:
    """A few frames in traffic with the methods."""
    written = ", ".join(f"{{method: '{name}'}}" for name in methods)
    size = (EARLY, "camera.width=320", "camera.height=240", f"duration_s={seconds}", "fog.visibility_m=80")
    sensors = "sensors.scatterometer={}", "sensors.reports.roadside={camera: {}, every_m: 500, period_s: 1, delay_s: 0}"
    methods_under_test = f"estimators=[{written}]", f"controller={controller}"
    scenario = fogsim.load_scenario("motorway_fog_bank", [*size, *sensors, *methods_under_test])
    return list(fogsim.run(scenario, seed=1))


@pytest.fixture(scope="module")
def as_it_is(methods: list[str]) -> list[Step]:
    return drive(methods)


def essence(estimate: Estimate) -> tuple[object, ...]:
    """What must be the same bit for bit."""
    found = estimate.diagnostics
    told = tuple(found.get(key) for key in ("reason", "horizon_row", "inflection_row", "airlight", "road", "class"))
    return estimate.method, estimate.extinction, estimate.standard_deviation, estimate.valid, told


def check_same(honest: list[Step], misled: list[Step]) -> None:
    for a, b in zip(honest, misled, strict=True):
        assert np.array_equal(a.observation.image, b.observation.image)
        assert a.observation.reports == b.observation.reports
        for one, other in zip(a.estimates, b.estimates, strict=True):
            assert essence(one) == essence(other), f"{one.method}, frame {a.index}"
        assert np.array_equal(a.belief.probability, b.belief.probability)
        assert a.command == b.command


def test_the_drive_tells_each_method_apart(as_it_is: list[Step], methods: list[str]) -> None:
    """What follows would hold of methods that never say anything: most of these do."""
    telling = {estimate.method for step in as_it_is for estimate in step.estimates if estimate.valid}
    assert [estimate.method for estimate in as_it_is[0].estimates] == methods
    guests = {name for name in methods if name.startswith("onnx:")}
    assert telling >= {"negru2013", "zhu2015", "huang2015", "huang2015_rough", "joint_road", "scatterometer"} | guests
    assert as_it_is[-1].observation.lead is not None
    assert len({report.source for step in as_it_is for report in step.observation.reports}) >= 5


@pytest.fixture
def false_world(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another fog, visibility, calibration, place, distances, instances and leader than what was drawn and measured."""
    from fogsim.sensors import measure_lead
    from fogsim.simulation.ego.fog_reports import FogReports
    from fogsim.simulation.ego.view_rendering import ViewRenderer

    rng = np.random.default_rng(4)
    render, heard = ViewRenderer.render, FogReports.heard

    def false_truth(
        fog: FogField, pose: CameraPose, camera: Camera, signs: SignMap, traffic: TrafficState, *_: object
    ) -> Truth:
        k = float(rng.uniform(0.0, 0.2))
        wrong = dataclasses.replace(camera, pitch=-camera.pitch, mount_height=9.0, focal_length=77.0)
        place = dataclasses.replace(pose, position=(0.0, 0.0, 50.0), heading=pose.heading + 1.0)
        false_fog, others = dataclasses.replace(fog, extinction=k), np.full(len(traffic.ids), k)
        return Truth(k, 0.5 * k, wrong, place, false_fog, dataclasses.replace(signs), others)

    def render_falsely(self, *arguments):
        view, radiance = render(self, *arguments)
        shuffled = dataclasses.replace(
            view, distance=rng.permuted(view.distance), instance=rng.permuted(view.instance), radiance=1.0 - radiance
        )
        return shuffled, radiance

    def measure_another(leader, *arguments):
        return measure_lead(leader and dataclasses.replace(leader, vehicle_id=f"v{rng.integers(99)}"), *arguments)

    def hear_in_another_fog(self, time, state, ego, fog, sent):
        there = dataclasses.replace(state, position=state.position + rng.normal(0.0, 100.0, state.position.shape))
        return heard(self, time, there, ego, dataclasses.replace(fog, extinction=float(rng.uniform(0.0, 0.2))), sent)

    monkeypatch.setattr("fogsim.simulation.ego.equipment.fog_truth", false_truth)
    monkeypatch.setattr(FogReports, "heard", hear_in_another_fog)
    monkeypatch.setattr("fogsim.simulation.ego.measurements.measure_lead", measure_another)
    monkeypatch.setattr(ViewRenderer, "render", render_falsely)


@pytest.mark.usefixtures("false_world")
def test_a_false_truth_changes_nothing(as_it_is: list[Step], methods: list[str]) -> None:
    """Reports of roadside cameras stay the same too."""
    misled = drive(methods)
    assert misled[3].truth.visibility != as_it_is[3].truth.visibility
    assert not np.array_equal(misled[3].view.distance, as_it_is[3].view.distance)
    check_same(as_it_is, misled)


@pytest.fixture
def controllers(tmp_path: Path) -> Iterator[list[str]]:
    """Controllers from elsewhere, whose request changes with every value that they are given."""

    def answer(content: bytes) -> list[bytes]:
        request = MotionRequest()
        request.desired_state.acceleration.x = -zlib.crc32(content) / 2**32
        return [framed(request.SerializeToString())]

    with osi_peer(answer) as port:
        found = [f"{{method: osi, parameters: {{port: {port}, timeout: 60, frames: true}}, delay: 0 s}}"]
        if find_spec("onnx") and find_spec("onnxruntime"):
            policy = write_policy(tmp_path / "policy.onnx", np.linspace(0.05, 0.1, len(AGENT_STATE))[:, None])
            found.append(f"{{method: 'onnx:{policy}', delay: 0 s}}")
        yield found


def test_controllers_from_elsewhere_get_no_truth(controllers: list[str], request: pytest.FixtureRequest) -> None:
    honest = [drive(["negru2013"], one, 0.5) for one in controllers]
    request.getfixturevalue("false_world")
    for one, steps in zip(controllers, honest, strict=True):
        check_same(steps, drive(["negru2013"], one, 0.5))
        assert len({step.command.control for step in steps}) > len(steps) // 2


ALLOWED = (
    Observation,
    Frame,
    Camera,
    LeadMeasurement,
    LightMeasurement,
    SignSighting,
    FogReport,
    float,
    int,
    str,
    type(None),
    enum.Enum,
)


def parts(value: object):
    yield value
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from parts(getattr(value, field.name))
    elif isinstance(value, tuple):
        for one in value:
            yield from parts(one)


def test_an_observation_holds_pixels_calibration_and_measurements_alone(as_it_is: list[Step]) -> None:
    for step in as_it_is:
        for part in parts(step.observation):
            if isinstance(part, np.ndarray):
                assert part.dtype == np.uint8
                # Nothing else hangs on the pixels' memory.
                assert part.base is None or np.asarray(part.base).size == part.size
            else:
                assert isinstance(part, (*ALLOWED, tuple)), type(part)


REPLAY = """
import pickle, sys
from pathlib import Path

class Wall:
    def find_spec(self, name, path=None, target=None):
        parts = name.split(".")
        if parts[0] in {blocked_libraries!r} or parts[0] == "fogsim" and parts[1:2] and parts[1] in {blocked!r}:
            raise ImportError(name + " knows the truth")
        return None

sys.meta_path.insert(0, Wall())
from fogsim.estimators import ESTIMATORS
camera, observations = pickle.loads(Path(sys.argv[1]).read_bytes())
estimators = [ESTIMATORS[name](camera) for name in {methods!r}]
found = [[(e.method, e.extinction, e.standard_deviation, e.valid) for e in (m.update(o) for m in estimators)]
         for o in observations]
Path(sys.argv[2]).write_bytes(pickle.dumps(found))
"""


def test_observations_alone_give_the_same_where_no_truth_can_be_imported(
    as_it_is: list[Step], methods: list[str], tmp_path: Path
) -> None:
    """In another process that cannot import renderer, traffic, fog or anything else that knows the truth."""
    observations = [step.observation for step in as_it_is]
    frame = observations[0].frame
    assert isinstance(frame, Frame)
    (tmp_path / "seen").write_bytes(pickle.dumps((frame.camera, observations)))
    program = REPLAY.format(
        blocked=TRUTHFUL,
        blocked_libraries=("libsumo", "traci", "sumolib", "OpenGL", "highway_env"),
        methods=methods,
    )
    run_python("-W", "error", "-c", program, tmp_path / "seen", tmp_path / "found")
    found = pickle.loads((tmp_path / "found").read_bytes())  # noqa: S301 - what this test has just written
    assert found == [[essence(one)[:4] for one in step.estimates] for step in as_it_is]


def unseen_names(source: str) -> set[str]:
    """Truthful value types that a module imports by name."""
    return {
        alias.name
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("fogsim")
        for alias in node.names
    } & UNSEEN


@pytest.mark.parametrize("package", ["advice", "estimators", "vision", "fusion"])
def test_no_type_that_holds_the_truth_is_imported(package: str) -> None:
    """Import contracts see modules; `from fogsim.values import Truth` would pass them."""
    assert unseen_names("from fogsim.values import Camera, Truth") == {"Truth"}
    for module in (Path(fogsim.__file__).parent / package).rglob("*.py"):
        assert not unseen_names(module.read_text(encoding="utf-8")), module
