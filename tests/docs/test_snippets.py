"""What the pages print runs as it is printed: every block of Python by itself, and the command lines.

Stand-ins: a folder with the reader's own files for each page (see conftest.py), a motorway on which the ego departs
early, the port of a SUMO that is started, and for command lines a smaller camera, a shorter run and fewer frames than
the page asks for. All runs in one process,
since most of the time goes into its first frame.
"""

import ast
import json
import re
import shlex
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import gymnasium
import pytest
import typer

import fogsim_envs  # noqa: F401 - registers the environments
from fogsim.cli.app import app
from fogsim.scenario import catalogue, load_scenario
from tests.docs.test_tables import PAGES

CHECKOUT = Path(__file__).resolve().parents[2]
TEXTS = {str(page.relative_to(CHECKOUT)): page.read_text(encoding="utf-8") for page in PAGES}
PYTHON = {page: re.findall(r"```python\n(.*?)```", text, re.DOTALL) for page, text in TEXTS.items()}
LINES = {page: re.findall(r"^(?:    )?(fogsim .*)$", text, re.MULTILINE) for page, text in TEXTS.items()}
"""Command lines that stand by themselves."""
MENTIONS = {page: re.findall(r"`((?:fogsim|python) [^`]+)`", text) for page, text in TEXTS.items()}
"""Those within the text, perhaps with words in place of values."""

KNOWN: dict[str, Any] = typer.main.get_command(app).commands  # type: ignore[attr-defined]  # a group has commands
PARSED_ONLY = ("reproduce", "recover", "compile", "calibrate", "explore")
"""Commands that take minutes or run until interrupted, that need a run that was killed, or that `make test` has run."""
TRAINS = "stable_baselines3"
"""What takes a quarter of an hour and an extra: examples/train_agent.py is that, tried by hand."""
SERVES = "serve_forever"
"""What runs until it is ended; tests/advice/test_osi_controller.py starts it."""
TRUTH = "sut.advice={method: stopping_sight_distance, informed_by: truth}"
BLIND = ("--set", "renderer=none", "--set", "estimators=[]", "--set", TRUTH, "--case", "visibility=200 m,run=0")
SHORT = ("--set", "camera.width=64", "--set", "camera.height=48", "--set", "duration_s=0.5")

RUNNER = """
import json, os, pathlib, sys, traceback
from fogsim.cli.app import main
from fogsim.scenario import loading

known = loading.catalogue()
loading.catalogue = lambda: {**known, "motorway_fog_bank": pathlib.Path(early)}

def command(line):
    sys.argv = line
    try:
        main()
    except SystemExit as end:
        assert not end.code, f"exit code {end.code}"

failed, items, early = False, *sys.argv[1:3]
for page, folder, item in json.loads(items):
    os.chdir(folder)
    for stream in (sys.stdout, sys.stderr):
        print(f"== {page}: {item!r}", file=stream, flush=True)
    try:
        command(item) if isinstance(item, list) else exec(compile(item, page, "exec"), {"__name__": "__main__"})
    except Exception:
        failed = True
        traceback.print_exc()
    sys.stdout.flush()
sys.exit(failed)
"""

Run = Callable[..., "CompletedProcess[str]"]


def is_quick(line: list[str]) -> bool:
    """Whether a command line is run here: what shipped scenarios expect has tests of its own."""
    of_shipped = line[1] == "test" and bool(set(line[2:]) & set(catalogue()))
    return line[1] not in PARSED_ONLY and not of_shipped


def is_run(block: str) -> bool:
    """Whether a block of Python is run here."""
    return TRAINS not in block and SERVES not in block


def shortened(line: list[str]) -> list[str]:
    """A command line that takes less time: what the page itself sets comes later and counts."""
    name, rest = line[1], line[2:]
    return {
        "run": ["fogsim", name, *SHORT, "--no-video", "--no-report", *rest],
        "dataset": ["fogsim", name, *SHORT, *rest, "--frames", "2", "--every", "1"],
        "estimate": [*line, "--overwrite"],
        "study": [*line, "--check"],
        "campaign": ["fogsim", "validate", *rest[:1]],
        "view": [*line, *SHORT[:4]],
        # The README has one that fails, which the notebook shows.
        "test": [*line, *BLIND] if "my" in rest else ["fogsim", "validate", *rest[:1]],
    }.get(name, line)


@pytest.mark.nightly
def test_what_is_printed_runs(
    readers_folder: Callable[[str], Path], early_motorway: Path, python: Run, listening: int
) -> None:
    items: list[tuple[str, str, str | list[str]]] = []
    for page, text in TEXTS.items():
        lines = [shlex.split(line, comments=True) for line in LINES[page]]
        quick: list[str | list[str]] = [shortened(line) for line in lines if is_quick(line)]
        quick += [block.replace("8813", str(listening)) for block in PYTHON[page] if is_run(block)]
        folder = str(readers_folder(text)) if quick else ""
        items += [(page, folder, item) for item in quick]
    done = python(RUNNER, json.dumps(items), str(early_motorway))
    assert done.returncode == 0, done.stderr
    printed = dict.fromkeys(TEXTS, "")
    for part in re.split(r"^== ", done.stdout, flags=re.MULTILINE)[1:]:
        page, _, found = part.partition(":")
        printed[page] += found.partition("\n")[2]
    read = printed["docs/how_to/estimate.md"]
    estimates = [float(one) for one in re.findall(r"^(?:.* )?([\d.]+) \([\d.]+, ", read, re.MULTILINE)]
    assert estimates
    assert estimates == pytest.approx([80.0] * len(estimates), rel=0.05)
    told = [json.loads(line) for line in printed["docs/how_to/estimate.md"].splitlines() if line.startswith("{")]
    (example,) = re.findall(r"```json\n(.*?)```", TEXTS["docs/how_to/estimate.md"], re.DOTALL)
    assert {tuple(one) for one in told} == {tuple(json.loads(example))}
    loops = [
        list(map(float, row))
        for row in re.findall(r"^([\d.]+) ([\d.]+)\b", printed["docs/how_to/plugin.md"], re.MULTILINE)
    ]
    assert max(time for time, _ in loops) > 4.0
    assert loops[-1][1] == pytest.approx(120.0, rel=0.3)


def test_what_trains_can_be_read() -> None:
    blocks = [block for page in TEXTS for block in PYTHON[page] if TRAINS in block]
    assert blocks
    for block in blocks:
        compile(block, "page", "exec")
        for name in re.findall(r"fogsim/\w+-v\d", block):
            assert name in gymnasium.registry


def test_command_lines_parse() -> None:
    for page in TEXTS:
        for line in LINES[page]:
            _, name, *rest = shlex.split(line, comments=True)
            KNOWN[name].make_context(name, rest)


def test_options_exist() -> None:
    for page in TEXTS:
        for line in MENTIONS[page]:
            program, name, *rest = line.split()
            if name.startswith("--") or (name == "-m" and not rest[0].startswith("fogsim_envs")):
                # An option of the program itself, or another project's module.
                continue
            options = {part.partition("=")[0] for part in rest if part.startswith("--")}
            if program == "fogsim":
                assert options <= {name for one in KNOWN[name].params for name in (*one.opts, *one.secondary_opts)}, (
                    line
                )
            else:
                file = f"envs/{rest[0].replace('.', '/')}.py" if name == "-m" else name
                assert options <= _options_of(CHECKOUT / file), line


def _options_of(script: Path) -> set[str]:
    """Options that a script adds to a parser, or passes to `parse_options` of the benchmarks' harness."""
    text = script.read_text(encoding="utf-8")
    calls = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call)]
    keywords = [one.arg for call in calls if ast.unparse(call.func) == "parse_options" for one in call.keywords]
    own = {"--json"} | {f"--{name.replace('_', '-')}" for name in keywords if name}
    return own | set(re.findall(r'"(--[\w-]+)"', text))


SETTINGS = {
    page: settings
    for page in TEXTS
    if page.startswith("scenarios/") and (settings := re.findall(r"--set\s([\w.]+=[\w.-]+)", TEXTS[page]))
}


def test_settings_that_a_scenario_speaks_of_are_its_keys() -> None:
    for page, settings in SETTINGS.items():
        for setting in settings:
            load_scenario(str(CHECKOUT / Path(page).parent), [setting])
