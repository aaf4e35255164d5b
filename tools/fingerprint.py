"""Print what must be the same on every x86-64 processor and after every tidying, as JSON, or compare two such prints.

    python tools/fingerprint.py > here.json
    python tools/fingerprint.py --compare here.json there.json

Shapes and scenes are hashes. A short drive by day and one by night are hashes of what was drawn and of the frames'
bytes, decisions, the text of metrics.json, and numbers, which must agree to 1e-9 of their size; so is what every method
of the day makes of a vehicle that drives away. The other parts are what users get: steps of every environment, files of
a study, verdicts of `fogsim test`, lines of `fogsim estimate` and `fogsim reproduce --quick`, and what OpenSCENARIO
files become. Arguments name parts: python tools/fingerprint.py night shapes. With --compare the differences are listed,
and the exit code is 1 if there are any. Frames are drawn by FogSim's own renderer; what OpenGL draws is its driver's.
"""

import argparse
import dataclasses
import hashlib
import json
import math
import re
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from PIL import Image

import fogsim
import fogsim_envs  # noqa: F401 - registers the environments
from fogsim.calibration.staged_road import ILLUMINANCE, StagedVehicle, straight_road
from fogsim.estimators import ESTIMATORS, make
from fogsim.metrics import RunMetrics
from fogsim.recorders import write_json
from fogsim.render import make_renderer
from fogsim.reproduce.huang2015_chase import Chase
from fogsim.scenario import build
from fogsim.scene import SIGN_KINDS, build_scene
from fogsim.traffic.road.network import read_net, road_network
from fogsim.values import Camera, Estimate, RoadNetwork, Sign, SignMap, Step

TOLERANCE, NOTHING = 1e-9, 1e-12
DATA = Path(__file__).resolve().parents[1] / "tests" / "data"
TOWN = DATA / "grid" / "grid.net.xml"
COMMON = (
    "duration_s=1",
    "renderer=cpu",
    "camera.width=160",
    "camera.height=120",
    "camera.stereo={baseline_m: 1}",
    "sensors.scatterometer={}",
    f"estimators=[{', '.join(ESTIMATORS)}]",
)
CHASED = Camera(240, 180, 216.0, (119.5, 89.5), mount_height=1.3, pitch=0.03)
RANGES = tuple(12.0 + 3.0 * number for number in range(9))
VISIBILITY = 100.0
DRIVES = {
    "day": (
        "motorway_fog_bank",
        ("fog={outside_visibility_m: 150, banks: [{start_m: 20, end_m: 600, edge_m: 60, visibility_m: 60}]}",),
    ),
    "night": ("night_motorway_fog", ("street_lamps=true",)),
}

STEPS = 4
"""Of each environment."""

STUDY = """
scenario: motorway_fog_bank
settings: [duration_s=4, camera.width=160, camera.height=120, renderer=cpu]
factors: {policy: {none: [advice=none], ssd: [advice=stopping_sight_distance]}}
seeds: 1
baseline: {policy: none}
"""
TESTED = ("cut_in_at_15_m", "radar_dropout", "traffic_lights")
PAPERS = ("huang2015",)


def shapes() -> dict[str, str]:
    """Hash of every shape and of all else in the scenes of a motorway and of a town."""
    found = {}
    setup = build.traffic_setup(fogsim.load_scenario("motorway_fog_bank"))
    routes = {"motorway": (setup.net, ("approach", "bank", "exit")), "town": (TOWN, ("A0B0",))}
    for place, (net, route) in routes.items():
        network = road_network(read_net(net), route)
        scene = build_scene(network, _signs(network), np.random.default_rng(1), street_lamps=True)
        for name, shape in scene.shapes.items():
            found[f"{place} {name}"] = _digest(shape)
        found[f"{place} ground"] = _digest(scene.ground)
        found |= {f"{place} places of {batch.shape}": _digest(batch) for batch in scene.scenery}
    return found


def _signs(network: RoadNetwork) -> SignMap:
    """One sign of every kind."""
    x, y, z = network.route[0].tolist()
    places = [(x + 20.0 * number, y - 8.0, z + 2.2) for number in range(len(SIGN_KINDS))]
    signs = [
        Sign(f"a {kind}", kind, 80 / 3.6, place, 0.3, 0.75) for kind, place in zip(SIGN_KINDS, places, strict=True)
    ]
    return SignMap(tuple(signs))


def drive(name: str) -> dict[str, Any]:
    """What came of a short drive."""
    scenario, overrides = DRIVES[name]
    told: dict[str, Any] = {"frames": [], "drawn": [], "decisions": [], "numbers": {}}
    metrics = RunMetrics()
    for step in fogsim.run(fogsim.load_scenario(scenario, [*COMMON, *overrides]), seed=1):
        metrics.update(step)
        told["frames"].append(_hash(step.observation.frame.image))
        told["drawn"].append(_digest(step.view))
        told["decisions"].append(_decisions(step))
        told["numbers"] |= {f"{step.index} {key}": value for key, value in _numbers(step)}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "metrics.json")
        write_json(file, metrics.summary().to_json())
        told["metrics"] = file.read_text().splitlines()
    return told


def chase() -> dict[str, Any]:
    """What every method says of a vehicle that drives away in fog."""
    told: dict[str, Any] = {"frames": [], "valid": {name: [] for name in ESTIMATORS}, "numbers": {}}
    estimators = [make(name, CHASED) for name in ESTIMATORS]
    scene = build_scene(straight_road(), SignMap(()), np.random.default_rng(0))
    chased = Chase(CHASED, StagedVehicle()).seen(
        make_renderer("cpu", scene, illuminance=ILLUMINANCE),
        dict.fromkeys(RANGES, (VISIBILITY,)),
        np.random.default_rng(1),
    )
    for ahead, seen in chased:
        observation = seen[VISIBILITY]
        told["frames"].append(_hash(observation.frame.image))
        for one in (estimator.update(observation) for estimator in estimators):
            told["valid"][one.method].append(one.valid)
            told["numbers"] |= {f"{ahead:g} m, {key}": value for key, value in _told(one)}
    return told


def environments() -> dict[str, Any]:
    """Hashes of what each environment gives at its reset and in steps with random actions."""
    ids = sorted(name for name in gymnasium.registry if name.startswith("fogsim/"))
    return {name: _rollout(name) for name in ids}


def _rollout(name: str) -> list[str]:
    with warnings.catch_warnings(action="ignore", category=DeprecationWarning):
        # A batch of environments is registered as a batch alone.
        env: Any = gymnasium.make(name) if gymnasium.spec(name).entry_point else gymnasium.make_vec(name, num_envs=2)
    env.action_space.seed(1)
    given = [env.reset(seed=1), *(env.step(env.action_space.sample()) for _ in range(STEPS))]
    hashes = [_hash(*_arrays(one)) for one in given]
    env.close()
    return hashes


def _arrays(value: object) -> Iterator[np.ndarray[Any, Any]]:
    """Numbers of nested containers, in order; what is no number as its text."""
    if isinstance(value, Mapping):
        yield from _arrays([[key, value[key]] for key in sorted(value)])
    elif isinstance(value, list | tuple):
        for one in value:
            yield from _arrays(one)
    elif isinstance(value, np.ndarray | np.generic | bool | int | float):
        yield np.asarray(value)
    else:
        yield np.frombuffer(f"{value!r} ".encode(), np.uint8)


def study() -> list[str]:
    """Rows of a study of two policies."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "advice.yaml")
        file.write_text(STUDY)
        _command("study", file, "--out", Path(folder, "out"))
        return [re.sub(r"[0-9a-f]{12,}", "", row) for row in Path(folder, "out", "study.csv").read_text().splitlines()]


def verdicts() -> list[str]:
    """Cases of tests with their outcomes and messages, without times."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "junit.xml")
        _command("test", *TESTED, "--junit", file, "--no-evidence", codes=(0, 1))
        return [
            _portable(re.sub(r' (time|timestamp|hostname)="[^"]*"', "", row)) for row in file.read_text().splitlines()
        ]


def estimates() -> list[str]:
    """Lines of `fogsim estimate` with every method of the day over a few frames."""
    scenario = fogsim.load_scenario(DRIVES["day"][0], [*COMMON[:1], *COMMON[2:4], "renderer=cpu", *DRIVES["day"][1]])
    with tempfile.TemporaryDirectory() as folder:
        for step in fogsim.run(scenario, seed=2):
            Image.fromarray(step.observation.frame.image).save(Path(folder, f"{step.index:03}.png"))
        return _command("estimate", folder, "--method", "all", "--json").replace(folder, "").splitlines()


def reproduced() -> list[str]:
    """Records of a paper's evaluation."""
    return [row for paper in PAPERS for row in _command("reproduce", paper, "--quick", "--json").splitlines()]


def openscenario() -> dict[str, list[str]]:
    """What each OpenSCENARIO file of the tests becomes, as a hash, what is said of it, and why it is refused."""
    return {file.name: _converted(file) for file in sorted((DATA / "openscenario").rglob("*.xosc"))}


def _converted(file: Path) -> list[str]:
    with warnings.catch_warnings(record=True, action="always") as caught:
        try:
            became = _hash(*_arrays(_portable(fogsim.load_scenario(file).model_dump_json())))
        except fogsim.InputError as refusal:
            became = str(refusal)
    return [_portable(text) for text in (became, *(str(warning.message) for warning in caught))]


def _portable(text: str) -> str:
    """A text without this machine's folders."""
    return re.sub(r"[^\s\"']*/(?=openscenario/|scenarios/)", "", text)


def _command(*arguments: str | Path, codes: tuple[int, ...] = (0,)) -> str:
    """What a command of FogSim prints."""
    done = subprocess.run(  # noqa: S603 - FogSim's own command
        [sys.executable, "-m", "fogsim", *arguments], capture_output=True, text=True, check=False, timeout=1200
    )
    if done.returncode not in codes:
        raise RuntimeError(f"fogsim {arguments[0]} ended with {done.returncode}: {done.stderr[-2000:]}")
    return done.stdout


def _decisions(step: Step) -> str:
    valid = " ".join(f"{estimate.method} {estimate.valid}" for estimate in step.estimates)
    return f"{step.command.advice.speed!r} {int(step.command.lamps)} {len(step.traffic.ids)} {valid}"


def _numbers(step: Step) -> Iterator[tuple[str, float]]:
    for estimate in step.estimates:
        yield from _told(estimate)
    yield "believed deviation", step.belief.log_standard_deviation
    yield "believed visibility", step.belief.visibility
    yield "route", step.route_position
    for row, vehicle in enumerate(step.traffic.ids):
        for name in ("position", "heading", "speed", "acceleration"):
            for place, value in enumerate(np.ravel(getattr(step.traffic, name)[row]).tolist()):
                yield f"{vehicle} {name} {place}", value


def _told(estimate: Estimate) -> Iterator[tuple[str, float]]:
    yield f"{estimate.method} k", estimate.extinction
    yield f"{estimate.method} deviation", estimate.standard_deviation


def _digest(value: Any) -> str:
    """Hash of all arrays of a dataclass."""
    arrays = [getattr(value, field.name) for field in dataclasses.fields(value)]
    return _hash(*(array for array in arrays if isinstance(array, np.ndarray)))


def _hash(*arrays: Any) -> str:
    digest = hashlib.sha256()
    for array in arrays:
        digest.update(f"{array.dtype} {array.shape}".encode())
        # Zero has one sign more than it has values.
        digest.update(np.ascontiguousarray(array + array.dtype.type(0)).tobytes())
    return digest.hexdigest()[:16]


def differences(here: Any, there: Any, where: str = "") -> Iterator[str]:
    """What does not agree, one line each."""
    if isinstance(here, dict) and isinstance(there, dict):
        for key in sorted(here.keys() | there.keys()):
            yield from differences(here.get(key), there.get(key), f"{where}/{key}")
    elif isinstance(here, list) and isinstance(there, list) and len(here) == len(there):
        for number, pair in enumerate(zip(here, there, strict=True)):
            yield from differences(*pair, f"{where}/{number}")
    elif isinstance(here, float) and isinstance(there, float):
        if not math.isclose(here, there, rel_tol=TOLERANCE, abs_tol=NOTHING):
            yield f"{where}: {here!r} here, {there!r} there"
    elif here != there:
        yield f"{where}: {here!r} here, {there!r} there"


PARTS: Mapping[str, Callable[[], Any]] = {
    "shapes": shapes,
    **{name: partial(drive, name) for name in DRIVES},
    "chase": chase,
    "environments": environments,
    "study": study,
    "verdicts": verdicts,
    "estimates": estimates,
    "reproduced": reproduced,
    "openscenario": openscenario,
}


def main() -> int:
    """Print, or compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}; all of them by default")
    parser.add_argument("--compare", type=Path, nargs=2, metavar="FILE")
    told = parser.parse_args()
    if unknown := set(told.parts) - set(PARTS):
        parser.error(f"expected parts out of {', '.join(PARTS)}, got {', '.join(sorted(unknown))}")
    if told.compare is None:
        print(json.dumps({part: PARTS[part]() for part in told.parts or PARTS}, indent=1))  # noqa: T201 - the result
        return 0
    found = list(differences(*(json.loads(file.read_text()) for file in told.compare)))
    print("\n".join(found) or "the same")  # noqa: T201 - the result
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
