"""Tables state when they were measured and what has changed since; one command measures them again."""

import fcntl
import json
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

CHECKOUT = Path(__file__).resolve().parents[2]
DOCS = CHECKOUT / "docs"

PAGE = """# A page

<!-- table: width -->

| road | width [m] |
| --- | --- |
| any | 3.5 |

<!-- end of table -->

<!-- table: twice -->

| road | twice [m] |
| --- | --- |
| any | 7.0 |

<!-- end of table -->

More.
"""
TABLES = """# Reproducibility

<!-- table: measured tables -->

<!-- end of measured tables -->

<!-- table: tables by hand -->

<!-- end of tables by hand -->
"""
ROAD = '''"""Roads."""

WIDTH = 3.5  # [m]


def wide() -> float:
    """The width."""
    return WIDTH
'''
SCRIPT = f"""import sys
from pathlib import Path
sys.path[:0] = [".", {str(DOCS)!r}]  # before the FogSim that is installed
import page_tables
from fogsim import road

name, times = sys.argv[1], float(sys.argv[2])
page_tables.ROOT = Path.cwd()
cells = ("any", f"{{times * road.wide():.1f}}")
page_tables.write_table("page.md", name, page_tables.lines_of(("road", name + " [m]"), [cells]))
"""
WIDTH = ("width", "python benchmarks/roads.py width 1")
TWICE = ("twice", "python benchmarks/roads.py twice 2")
FAILS = ("twice", "python benchmarks/roads.py twice 9 && exit 3")
BUSY = ("width", f"{WIDTH[1]} && if test ! -e stopped; then touch busy; sleep 60; fi")
UNTIL = "for i in $(seq 300); do test -e busy && break; sleep 0.1; done; test -e busy"
STOPS = ("twice", f"{TWICE[1]} && if test ! -e stopped; then {UNTIL}; touch stopped; kill $PPID; sleep 60; fi")
ALONE = tuple((name, f"mkdir busy && {command} && sleep 0.5 && rmdir busy") for name, command in (WIDTH, TWICE))

Run = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture
def docs(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], ModuleType]:
    """Import of a script of docs/."""
    monkeypatch.syspath_prepend(str(DOCS))
    return import_module


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A small checkout with two tables."""
    texts = {
        "pyproject.toml": '[project]\nversion = "1.2.3"\n',
        "README.md": "# Read me\n",
        "docs/page.md": PAGE,
        "docs/benchmarks/reproducibility.md": TABLES,
        "fogsim/__init__.py": "",
        "fogsim/road.py": ROAD,
        "fogsim/idle.py": "A = 1\n",
        "benchmarks/roads.py": SCRIPT,
    }
    for name, text in texts.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    who = ("-c", "user.name=a", "-c", "user.email=a@example.com")
    for arguments in (("init", "-q"), ("add", "."), (*who, "commit", "-qm", "all")):
        subprocess.run(["git", *arguments], cwd=tmp_path, check=True)  # noqa: S607 - whichever git there is
    return tmp_path


@pytest.fixture
def rerun(
    root: Path, docs: Callable[[str], ModuleType], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Run:
    """docs/rerun_tables.py in that checkout, on two cores and with its own measurements."""
    monkeypatch.chdir(root)
    monkeypatch.setattr(docs("table_round"), "CORES", 2)

    def run(*arguments: str, measured: tuple[tuple[str, str], ...] = (WIDTH, TWICE), **fields: Any) -> Any:
        kind, code = docs("measured_tables").Measurement, None
        made = tuple(kind(name, (command,), 1.0, ("benchmarks/roads.py",), **fields) for name, command in measured)
        monkeypatch.setattr(sys, "argv", ["rerun_tables.py", *arguments])
        capsys.readouterr()
        try:
            code = docs("rerun_tables").main(root, made)
        except SystemExit as end:
            code = end.code
        told = capsys.readouterr()
        # What is no number is a program's last words.
        words = f"{code}\n" if isinstance(code, str) else ""
        return subprocess.CompletedProcess(arguments, 1 if words else code, told.out, told.err + words)

    return run


@pytest.fixture
def rerun_alone(root: Path) -> Run:
    """The same in a process of its own, which its commands may end."""

    def run(measured: tuple[tuple[str, str], ...]) -> Any:
        code = (
            f"import sys; sys.path.insert(0, {str(DOCS)!r}); from pathlib import Path\n"
            "from measured_tables import Measurement; import rerun_tables, table_round; table_round.CORES = 2\n"
            "made = tuple(Measurement(name, (command,), 1.0, ('benchmarks/roads.py',)) "
            f"for name, command in {measured!r})\n"
            f"sys.exit(rerun_tables.main(Path({str(root)!r}), made))"
        )
        command = [sys.executable, "-c", code]
        # The shell of a command ends its parent, which is not to be the shell of somebody else.
        return subprocess.run(command, cwd=root, capture_output=True, text=True, check=False, timeout=60)

    return run


def page(root: Path) -> str:
    return (root / "docs" / "page.md").read_text(encoding="utf-8")


def overview(root: Path) -> str:
    return (root / "docs" / "benchmarks" / "reproducibility.md").read_text(encoding="utf-8")


def change(file: Path, old: str, new: str) -> None:
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new), encoding="utf-8")


def test_tables_are_measured_and_say_so(root: Path, rerun: Run) -> None:
    assert rerun("--check").returncode == 1
    change(root / "fogsim" / "road.py", "3.5", "3.7")
    done = rerun()
    assert done.returncode == 0, done.stderr
    assert "| any | 3.7 |" in page(root)
    assert "| any | 7.4 |" in page(root)
    assert page(root).count("*Measured with FogSim 1.2.3 (") == 2
    assert "with changes" in page(root)
    assert page(root).endswith("<!-- measured: twice -->\n\nMore.\n")
    assert overview(root).count("| nothing |") == 2
    assert rerun("--check").returncode == 0
    cells = json.loads((root / "runs" / "tables" / "moved.json").read_text(encoding="utf-8"))
    assert sorted((cell["table"], cell["column"], cell["old"], cell["new"]) for cell in cells) == [
        ("twice", "twice [m]", "7.0", "7.4"),
        ("width", "width [m]", "3.5", "3.7"),
    ]
    assert "| width | any | width [m] | 3.5 | 3.7 |" in done.stdout
    assert "| any | 3.7 |" in (rerun("width"), page(root))[1], "the line below survives"
    assert page(root).count("*Measured with") == 2


def test_changed_code_is_listed_and_changed_prose_is_not(root: Path, rerun: Run) -> None:
    rerun()
    road = root / "fogsim" / "road.py"
    change(road, '"""The width."""', '"""How wide it is."""  # a comment')
    change(root / "fogsim" / "idle.py", "1", "2")
    assert rerun("--check").returncode == 0
    assert rerun("--current").returncode == 0
    change(road, "return WIDTH", "return WIDTH + 0.0")
    current = rerun("--current")
    assert current.returncode == 1
    assert "code has changed since these were measured: " in current.stdout
    done = rerun("--check")
    assert done.returncode == 1
    assert "on width: " in done.stdout
    assert "fogsim/road.py" in done.stdout
    assert "python docs/rerun_tables.py --page" in done.stdout
    assert "python benchmarks/roads.py twice 2" in rerun("--dry-run").stdout
    assert rerun("--page").returncode == 0
    assert overview(root).count("| fogsim: road.py |") == 2
    assert rerun("--check").returncode == 0
    assert "    fogsim/road.py" in rerun("--list", "width").stdout


def test_tables_that_a_commit_leaves_as_they_were_carry_it(root: Path, rerun: Run) -> None:
    rerun("width", "twice")
    stamps = [root / "docs" / "measured_at" / f"{name}.json" for name in ("width", "twice")]
    before = [json.loads(stamp.read_text()) for stamp in stamps]
    (root / "fogsim" / "idle.py").write_text("A = 2\n")
    who = ("-c", "user.name=a", "-c", "user.email=a@example.com")
    subprocess.run(["git", *who, "commit", "-qam", "idle"], cwd=root, check=True)  # noqa: S607 - whichever git there is
    rerun("twice")
    width, twice = (json.loads(stamp.read_text()) for stamp in stamps)
    assert width == {**before[0], "commit": twice["commit"]}
    assert twice["commit"] != before[0]["commit"]
    assert rerun("--check").returncode == 0


def test_tables_that_were_edited_are_found(root: Path, rerun: Run) -> None:
    rerun()
    change(root / "docs" / "page.md", "| any | 7.0 |", "| any | 7.2 |")
    done = rerun("--check")
    assert done.returncode == 1
    assert "page.md: the table twice is not what was measured" in done.stdout
    rerun("--stamp", "twice")
    assert rerun("--check").returncode == 0


def test_a_command_that_fails_changes_nothing_and_stops_no_other(root: Path, rerun: Run) -> None:
    change(root / "fogsim" / "road.py", "3.5", "3.7")
    done = rerun(measured=(FAILS, WIDTH))
    assert done.returncode == 1
    assert "failed: twice" in done.stdout
    assert "| any | 7.0 |" in page(root)
    assert "| any | 3.7 |" in page(root)
    assert "<!-- measured: width -->" in page(root)
    assert "<!-- measured: twice -->" not in page(root)


def test_tables_that_have_not_changed_are_not_measured(root: Path, rerun: Run) -> None:
    rerun("width")
    once = (root / "runs" / "tables" / "width.log").read_text(encoding="utf-8")
    assert rerun("--dry-run").stdout.splitlines()[-1].startswith("1 to measure")
    done = rerun()
    assert "moved in the tables of twice: 0" in done.stdout
    assert "no table's code has changed" in rerun().stdout
    assert rerun("--dry-run", "--all").stdout.splitlines()[-1].startswith("2 to measure")
    assert (root / "runs" / "tables" / "width.log").read_text(encoding="utf-8") == once


@pytest.mark.parametrize("field", [{"times": "all"}, {"cores": 2}], ids=str)
def test_times_and_two_cores_need_the_whole_machine(root: Path, rerun: Run, field: dict[str, object]) -> None:
    done = rerun(measured=ALONE, **field)
    assert done.returncode == 0, done.stderr
    assert rerun("--all", measured=ALONE, cores=1).returncode == 1, "together they are in each other's way"


def test_interrupted_commands_leave_their_tables_and_are_resumed(root: Path, rerun_alone: Run) -> None:
    change(root / "fogsim" / "road.py", "3.5", "3.7")
    done = rerun_alone((BUSY, STOPS))
    assert done.returncode == 130, done.stderr
    assert "| any | 3.5 |" in page(root)
    assert "| any | 7.0 |" in page(root)
    assert subprocess.run(["pgrep", "-f", str(root)], check=False, capture_output=True).stdout == b""  # noqa: S607
    kept = root / "runs" / "tables" / "width.kept"
    kept.touch()
    done = rerun_alone((BUSY, STOPS))
    assert done.returncode == 0, done.stderr
    assert kept.exists(), "what a command keeps is its own"
    assert "| any | 3.7 |" in page(root)
    assert "| any | 7.4 |" in page(root)


def test_what_another_command_measures_is_left_alone(root: Path, rerun: Run) -> None:
    (root / "runs" / "tables").mkdir(parents=True)
    with (root / "runs" / "tables" / "width.log").open("wb") as log:
        fcntl.flock(log, fcntl.LOCK_EX)
        done = rerun("width")
    assert done.returncode == 1
    assert "width is being measured by another command" in done.stderr
    assert rerun("width").returncode == 0


def test_last_digits_and_times_of_a_cell(docs: Callable[[str], ModuleType]) -> None:
    same, moved = docs("page_tables").same, docs("page_tables").moved
    for other in ("| 0.8 … 1.04 | 20 |", "| 0.82 … 1.04 | < 20 |", "| 0.82 … 1.04 | 20 | 1 |"):
        assert not same("| 0.82 … 1.04 | 20 |", other)
    table = "\n| a | b | x |\n|---|---|---|\n| one | two | 1.0 / 2.00 |\nIt takes 3 ms.\n"
    assert moved("t", table, table.replace("2.00", "2.01").replace("3 ms", "4 ms")) == []
    (cell,) = moved("t", table, table.replace("2.00", "2.02"))
    assert (cell.row, cell.column, cell.old, cell.new) == ("one | two", "x", "1.0 / 2.00", "1.0 / 2.02")
    more = table.replace("2.00", "2.02").replace("It", "| three | four | 5 |\nIt")
    assert [(cell.row, cell.old, cell.new) for cell in moved("t", table, more)] == [
        ("one | two", "1.0 / 2.00", "1.0 / 2.02"),
        ("three | four | 5", "–", "three | four | 5"),
    ]
    assert [(cell.old, cell.new) for cell in moved("t", more, table)][1] == ("three | four | 5", "–")


def test_digests_know_no_prose_and_no_version_of_python(docs: Callable[[str], ModuleType]) -> None:
    import ast

    flat = docs("code_digests").flat
    code = 'def f(x=None):\n    """Told."""\n    return [x, None, ""]\n'
    assert flat(ast.parse(code)) == flat(ast.parse(code.replace("Told", "Said") + "# end\n"))
    for old, new in (("x=None", "x=0"), ('""]', '"a"]'), ("None, ", ""), ("(x=None)", "(x)")):
        assert flat(ast.parse(code)) != flat(ast.parse(code.replace(old, new)))
    assert "type_params" not in flat(ast.parse(code)), "which Python 3.11 does not know"


def test_imports_are_followed_where_they_are_late_or_lazy(docs: Callable[[str], ModuleType]) -> None:
    checkout = docs("code_digests").Checkout(CHECKOUT)
    files = checkout.files(["benchmarks/belief.py"])
    for path in (
        "benchmarks/harness.py",
        "fogsim/simulation/loop.py",  # as fogsim.ClosedLoop or fogsim.run, of which nothing is imported
        "fogsim/vision/strips/joint_kernels.py",
        "fogsim/vision/data/airlight_slopes.npz",
        "scenarios/motorway_fog_bank/scenario.yaml",
    ):
        assert path in files
    assert "fogsim/study/plan.py" not in files
    assert not any("__pycache__" in path for path in files)
    counting = docs("table_stamps").Stamps(CHECKOUT).checkout()
    unread = {path for path in files if path.startswith("fogsim/openscenario/")}
    counted = set(counting.files(["benchmarks/belief.py"]))
    assert counted < set(files)
    assert counted.isdisjoint(unread)
    assert counting.changed(dict.fromkeys(unread, "another digest")) == []
    assert list(CHECKOUT.glob("scenarios/**/*.xosc")) == []


def test_every_table_of_the_pages_has_its_command(docs: Callable[[str], ModuleType]) -> None:
    found = set(docs("page_tables").places(CHECKOUT))
    registry, stamps = docs("measured_tables"), docs("table_stamps")
    measured = [name for one in registry.MEASUREMENTS for name in one.tables]
    from_code = {name for tables in docs("make_tables").TABLES.values() for name in tables}
    assert len(set(measured)) == len(measured)
    assert found == {*measured, *from_code, "gallery", stamps.MEASURED, stamps.BY_HAND}
    named = [path for one in registry.MEASUREMENTS for path in one.rests_on]
    named += [one.page for one in registry.UNWRITTEN]
    assert [path for path in named if not (CHECKOUT / path).exists()] == []


def test_the_page_says_what_has_changed_since_tables_were_measured(docs: Callable[[str], ModuleType]) -> None:
    complaints = docs("table_stamps").Stamps(CHECKOUT).complaints()
    assert complaints == [], "\n".join(complaints)
