"""Search for input that ends in anything but a result or one clear error: `python tools/fuzz.py --minutes 10`.

Hypothesis edits valid files as people and attackers do. Each entry point reads the results in a process of its own,
with limits on time and memory. An input that ends in another error than FogSim's, in a crash or a hang is shrunk and
kept in the corpus, which `tests/faults/test_fuzz_corpus.py` reads again.
"""

import argparse
import contextlib
import faulthandler
import hashlib
import io
import itertools
import json
import multiprocessing
import re
import resource
import shutil
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import imageio_ffmpeg
import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import seed as seeded
from hypothesis import strategies as st
from PIL import Image

import fogsim
from fogsim.core.registry.user_code import import_nothing
from fogsim.errors import FogSimError, LeftOutWarning, RenamedWarning, UnplayedWarning
from fogsim.estimators import ESTIMATORS
from fogsim.estimators.learned.onnx_model import read_model
from fogsim.offline.camera_file import load_calibration
from fogsim.offline.drive.sign_watch import load_sign_file
from fogsim.offline.drive.track_file import load_track
from fogsim.offline.input_paths import find_source
from fogsim.scenario.loading import load_cases, load_scenario
from fogsim.study import load_study
from fogsim.study.profiles import RunProfiles
from fogsim.study.run_file import STUDY_RUN, read_run
from fogsim.testing import collect
from fogsim.testing.odd.odd_file import read_odd
from fogsim.testing.odd.openodd_library import Coverage
from fogsim.traffic.road.configuration import configured_files, ignored_options
from fogsim.traffic.road.netconvert import opendrive_net
from fogsim.traffic.road.network import read_net
from fogsim.traffic.road.signs import sign_map
from fogsim.values.result_checks import checked_estimate

ROOT = Path(__file__).resolve().parents[1]
CORPUS = ROOT / "tests" / "data" / "fuzz"
"""A folder for each entry point, and in it a file for each input that was a finding once."""

SLICE = 20.0
"""Time after which another entry point has its turn [s]."""

LONGEST = 30.0
"""Time within which an input must have been read or refused [s]."""

MOST_MEMORY = 8 * 2**30
"""Address space of a process that reads [bytes]: numba and libsumo alone take 2 GiB of it."""


@dataclass(frozen=True)
class Entry:
    """A way by which a user's file comes in."""

    suffix: str  # ending of the file's name
    seeds: Sequence[bytes]  # valid contents that are changed
    read: Callable[[Path], object]  # reads the file, as the commands do


def _files(*patterns: str) -> list[bytes]:
    return [path.read_bytes() for pattern in patterns for path in sorted(ROOT.glob(pattern))]


CAMERA = b"""width: 64
height: 48
focal_length_px: 58.0
principal_point_px: [32, 24]
mount_height_m: 1.38
pitch_deg: 2.0
response: gamma
"""
SIGNS = b"""<additional>
<poi id="s" type="fogsim.sign.speed_limit" x="100" y="3" angle="90"><param key="value" value="100"/>
<param key="diameter" value="0.6"/></poi><poly id="w" type="building" shape="0,0 5,0 5,5" layer="1"/></additional>
"""
GPX = b"""<gpx version="1.1"><trk><trkseg><trkpt lat="50.0" lon="8.0"><time>2026-01-01T00:00:00Z</time></trkpt>
<trkpt lat="50.001" lon="8.0"><time>2026-01-01T00:00:05Z</time></trkpt></trkseg></trk></gpx>
"""
TRACK = b"time_s,latitude,longitude,speed_mps\n0,50.0,8.0,10\n1,50.0001,8.0,10\n2,50.0002,8.0,10\n"
GEOJSON = b"""{"type": "FeatureCollection", "features": [{"type": "Feature", "id": "s1",
"geometry": {"type": "Point", "coordinates": [8.0, 50.0005]},
"properties": {"kind": "speed_limit", "value": 27.8, "diameter": 0.6, "height": 2.2, "heading": 0.1}}]}
"""
MODULE = b"""import sys
class Mine:
    method = "mine:Mine"
    def __init__(self, camera, gain: float = 1.0):
        self.gain = gain
    def reset(self):
        self.count = 0
    def update(self, observation):
        value = observation.image.mean() * self.gain
        return Estimate("mine:Mine", value, 0.005)
from fogsim import Estimate
"""
MODULE_TOKENS = [
    b"sys.exit(0)", b"raise BaseException", b"raise KeyError('x')", b"1 / 0", b"None", b"return", b"import nothing",
    b"observation.image[:] = 0", b"yield 1", b"lambda: 0", b"object()", b"float('nan')", b"self.update(observation)",
    b"@property\n",
]  # fmt: skip


def entries() -> dict[str, Entry]:
    """All entry points."""

    def pictures(path: Path) -> None:
        for _ in find_source([path]).pictures():
            pass

    return {
        "scenario": Entry(
            ".yaml", _files("tests/data/road/scenario.yaml"), lambda p: load_cases(p, may_import=import_nothing)
        ),
        "test": Entry(
            ".fog.yaml",
            _files("scenarios/cut_in_at_15_m/scenario.yaml", "scenarios/pedestrian_crossing_fog/scenario.yaml"),
            lambda p: collect([p], may_import=import_nothing),
        ),
        "study": Entry(
            ".yaml",
            _files("scenarios/studies/highway_99.yaml", "scenarios/studies/which_sensor.yaml"),
            lambda p: load_study(p, may_import=import_nothing),
        ),
        "camera": Entry(".yaml", [CAMERA], load_calibration),
        "openscenario": Entry(".xosc", _files("tests/data/openscenario/*.xosc"), load_scenario),
        "opendrive": Entry(".xodr", _files("tests/data/openscenario/*.xodr"), opendrive_net),
        "net": Entry(".net.xml", _files("tests/data/road/*.net.xml"), read_net),
        "additional": Entry(
            ".add.xml", [SIGNS], lambda p: sign_map(read_net(ROOT / "tests/data/road/road.net.xml"), [p])
        ),
        "configuration": Entry(
            ".sumocfg", _files("tests/data/grid/*.sumocfg"), lambda p: (configured_files(p), ignored_options(p))
        ),
        "gpx": Entry(".gpx", [GPX], load_track),
        "track": Entry(".csv", [TRACK], load_track),
        "signs": Entry(".geojson", [GEOJSON], load_sign_file),
        "image": Entry(".png", [_image("PNG"), _image("JPEG"), _image("GIF"), _image("WEBP")], pictures),
        "network": Entry(".onnx", _files("tests/data/mean_network.onnx"), read_model),
        "video": Entry(".mp4", [_video()], pictures),
        "module": Entry(".py", [MODULE], _use_module),
        "odd": Entry(".odd.yaml", _files("fogsim/testing/odd/shipped/*.odd.yaml"), _read_odd),
        "openodd": Entry(".yaml", _files("fogsim/testing/odd/shipped/driving_in_fog.yaml"), _read_odd),
        "run": Entry(".json", [_run_file()], lambda p: read_run(p, STUDY_RUN)),
    }


def _image(kind: str) -> bytes:
    file = io.BytesIO()
    Image.linear_gradient("L").resize((64, 48)).convert("RGB").save(file, kind)
    return file.getvalue()


def _video() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        writer = imageio_ffmpeg.write_frames(f"{folder}/a.mp4", (64, 48))
        writer.send(None)
        for shade in (0, 100, 200):
            writer.send(bytes([shade]) * (64 * 48 * 3))
        writer.close()
        return Path(folder, "a.mp4").read_bytes()


def _run_file() -> bytes:
    metrics = {"ending": "time", "mean_speed_mps": 20.5, "collisions": 0, "minimum_gap_m": None}
    return json.dumps({"status": "complete", "metrics": metrics, "profiles": RunProfiles().to_json()}).encode()


def _use_module(path: Path) -> None:
    """Let a user's estimator read a frame."""
    camera = fogsim.Camera(width=8, height=8, focal_length=8, principal_point=(4, 4), mount_height=1.3, pitch=0.0)
    # A module is imported once under one name: each gets its own.
    name = f"m{hashlib.sha256(path.read_bytes()).hexdigest()[:12]}"
    shutil.copy(path, path.with_name(f"{name}.py"))
    method = ESTIMATORS.find(f"{name}:Mine", path.parent)(camera)
    method.reset()
    checked_estimate("mine:Mine", method.update(fogsim.Observation(np.zeros((8, 8, 3), np.uint8))))


def _read_odd(path: Path) -> None:
    """Read a binding of the shipped domain, or a domain by the shipped binding."""
    domain, binding = (ROOT / "fogsim/testing/odd/shipped" / name for name in ("driving_in_fog.yaml", "fog.odd.yaml"))
    if path.name.endswith(".odd.yaml"):
        shutil.copy(domain, path.parent)
    else:
        shutil.copy(path, path.with_name(domain.name))
        path = Path(shutil.copy(binding, path.parent))
    Coverage(read_odd(str(path)))


HOSTILE = [
    b"", b"nan", b".nan", b"-inf", b".inf", b"1e400", b"1e308", b"-1", b"0", b"1e-320", b"9" * 400, b"true", b"null",
    b"~", b"[]", b"{}", b"[" * 3000, b"<a>" * 3000, b"{a: " * 300, b"x" * 70_000, b"\x1b[31m", b"\0", b"\n", b"a\xffb",
    "é𝕏".encode(), b":100:", b"[red]", b"../../../etc/passwd", b"/dev/zero", b"os:system", b"*a", b"&a [*a]",
    b"!!python/name:os.system", b'<!DOCTYPE a [<!ENTITY e "x">]>', b'encoding="klingon"', b'encoding="utf-16"', b"ego",
    b"60 m", b"-1 s", b"1e300 s", b"$undefined", b"${1 / 0}", b"2026-02-30T25:61:00", b"' '", b"\xef\xbb\xbf", b"%s",
    b"\\", b"'", b'"', b"<", b"]]>",
]  # fmt: skip
"""What is put in place of a word, a number or a text."""

_TOKEN = re.compile(rb"[A-Za-z_][\w.]*|-?\d[\d.eE+-]*|\"[^\"]*\"|'[^']*'|[^\s\w]")


def _changed(content: bytes, edits: Sequence[tuple[str, float, float, bytes]]) -> bytes:
    """Apply edits: what is done, where as a share of the content, how much, and with what."""
    for what, where, much, token in edits:
        words = list(_TOKEN.finditer(content))
        start = int(where * len(content))
        end = min(len(content), start + 1 + int(much * much * 0.3 * len(content)))
        if what == "replace" and words:
            start, end = words[min(int(where * len(words)), len(words) - 1)].span()
            content = content[:start] + token + content[end:]
        elif what == "delete":
            content = content[:start] + content[end:]
        elif what == "repeat":
            content = content[:end] + content[start:end] * (1 + int(20 * much)) + content[end:]
        elif what == "insert":
            content = content[:start] + token + content[start:]
        elif what == "truncate":
            content = content[:start]
        elif what == "swap" and len(words) > 1:
            one, other = sorted({int(where * (len(words) - 1)), int(much * (len(words) - 1))} | {0, len(words) - 1})[:2]
            (a, b), (c, d) = words[one].span(), words[other].span()
            content = content[:a] + content[c:d] + content[b:c] + content[a:b] + content[d:]
    return content


class FindingError(AssertionError):
    """An input that ended in something else than a result or one clear error."""


@contextlib.contextmanager
def _only_clear_errors() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # Syntax of users' modules is theirs.
        for category in (UnplayedWarning, LeftOutWarning, RenamedWarning, SyntaxWarning):
            warnings.simplefilter("ignore", category)
        try:
            yield
        except FogSimError as error:
            lines = str(error).splitlines()
            if not lines or not all(line.isprintable() and line.strip() for line in lines):
                raise FindingError(f"message that cannot be printed: {error!r}") from error
        except Exception as error:
            raise FindingError(f"{type(error).__name__}: {error}") from error


def try_input(entry: Entry, content: bytes, folder: Path) -> None:
    """Let an entry point read a content."""
    path = folder / f"input{entry.suffix}"
    path.write_bytes(content)
    for name in ("road/road.net.xml", "road/road.rou.xml", "openscenario/two_lanes.xodr"):
        if not (folder / Path(name).name).exists():
            shutil.copy(ROOT / "tests" / "data" / name, folder)
    with _only_clear_errors():
        entry.read(path)


def _search(name: str, seed: int, seconds: float, folder: Path) -> None:
    """Search an entry point in this process; the last input tried is in the folder, and why it is a finding."""
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    entry, until = entries()[name], time.monotonic() + seconds
    tokens = st.sampled_from([*HOSTILE, *(MODULE_TOKENS if name == "module" else [])]) | st.binary(max_size=8)
    share = st.floats(0.0, 0.999)
    what = st.sampled_from(["replace", "replace", "replace", "delete", "repeat", "insert", "truncate", "swap"])
    edits = st.lists(st.tuples(what, share, share, tokens), min_size=1, max_size=4)
    count = 0

    @settings(
        max_examples=200,
        database=None,
        deadline=None,
        suppress_health_check=list(HealthCheck),
        report_multiple_bugs=False,
    )
    @given(st.sampled_from(range(len(entry.seeds))), edits)
    def attempt(which: int, edits: list[tuple[str, float, float, bytes]]) -> None:
        nonlocal count
        if time.monotonic() > until:
            return
        count += 1
        content = _changed(entry.seeds[which], edits)
        (folder / "last").write_bytes(content)
        faulthandler.dump_traceback_later(LONGEST, exit=True)
        try_input(entry, content, folder)
        faulthandler.cancel_dump_traceback_later()

    while time.monotonic() < until:
        try:
            seeded(seed)(attempt)()
        except FindingError as finding:
            report = "".join(traceback.format_exception(finding))
            (folder / "finding").write_text(report, encoding="utf-8", errors="backslashreplace")
            return
        seed += 1_000_003
        (folder / "count").write_text(str(count))


def _turn(name: str, seed: int, seconds: float) -> tuple[int, str | None]:
    """Give an entry point its turn in a new process: how many inputs it read, and the finding, if there is one."""
    with tempfile.TemporaryDirectory(prefix="fogsim-fuzz-") as made:
        folder = Path(made)
        process = multiprocessing.get_context("spawn").Process(target=_search, args=(name, seed, seconds, folder))
        process.start()
        process.join(seconds + 4 * LONGEST)
        process.kill()
        process.join()
        why = (folder / "finding").read_text() if (folder / "finding").exists() else None
        if why is None and process.exitcode != 0:
            why = f"its process ended with {process.exitcode}: a crash, too much memory, or more than {LONGEST:g} s"
        if why is not None and (folder / "last").exists():
            content = (folder / "last").read_bytes()
            kept = CORPUS / name / hashlib.sha256(content).hexdigest()[:16]
            kept.parent.mkdir(parents=True, exist_ok=True)
            kept.write_bytes(content)
            why = f"{why}\nkept as {kept.relative_to(ROOT)}"
        count = (folder / "count").read_text() if (folder / "count").exists() else "0"
        return int(count), why


def main(arguments: Sequence[str]) -> int:
    """Search for some time; 1 if anything was found."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=0, help="another seed tries other inputs")
    parser.add_argument("--only", action="append", help="an entry point; may be given several times")
    chosen = parser.parse_args(arguments)
    found, names = [], chosen.only or list(entries())
    until, tried = time.monotonic() + 60.0 * chosen.minutes, dict.fromkeys(names, 0)
    for number, name in enumerate(itertools.cycle(names)):
        left = until - time.monotonic()
        if left <= 0.0:
            break
        count, why = _turn(name, chosen.seed * 1_000 + number, max(min(SLICE, left), 1.0))
        tried[name] += count
        if why is not None:
            found.append(f"{name}: {why}")
            print(f"FOUND {found[-1]}", flush=True)  # noqa: T201 - what the command says
        print(f"{name}: {tried[name]} inputs", flush=True)  # noqa: T201
    print(f"{sum(tried.values())} inputs of {len(names)} entry points, {len(found)} findings")  # noqa: T201
    for one in found:
        print(one)  # noqa: T201
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
