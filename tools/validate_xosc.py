"""Say of each .xosc file whether it loads, runs or is refused, why, and whether it fits ASAM's schema of its version.

python tools/validate_xosc.py runs/demo/scenario.xosc    one file, or several
python tools/validate_xosc.py --run FOLDER               all files below a folder; each is run for 3 s without rendering

Catalogs are passed over. Schemas come with the package scenariogeneration (pip install lxml scenariogeneration). The
exit code is 1 if a file ends in anything but a run or a refusal, or does not fit its schema.
"""

import argparse
import importlib.util
import os
import re
import sys
import traceback
import warnings
from collections import Counter
from pathlib import Path

import fogsim
from fogsim.errors import InputError

PLAIN = ("renderer=none", "estimators=[]")
SECONDS = 3.0
REASONS_SHOWN = 3


def schemas() -> dict[str, Path]:
    """ASAM's schemas of OpenSCENARIO by version (``1.2``), none without the packages that have and read them."""
    found = importlib.util.find_spec("scenariogeneration")
    if found is None or found.origin is None or importlib.util.find_spec("lxml") is None:
        return {}
    files = (Path(found.origin).parent.parent / "schemas").glob("OpenSCENARIO_1_*.xsd")
    return {".".join(path.stem.split("_")[1:3]): path for path in files}


def fit(file: Path, known: dict[str, Path]) -> str:
    """How a file fits the schema of its version: `valid`, the first fault, or "" without a schema."""
    text = file.read_text(encoding="utf-8", errors="replace")
    version = ".".join(re.findall(r'rev(?:Major|Minor)="(\d+)"', text)[:2])
    if version not in known:
        return ""
    from lxml import etree  # noqa: PLC0415 - no dependency of FogSim

    schema = etree.XMLSchema(etree.parse(str(known[version])))
    if schema.validate(etree.parse(str(file))):
        return "valid"
    return f"line {schema.error_log[0].line}: {schema.error_log[0].message}"


def outcome(file: Path, is_run: bool) -> tuple[str, list[str]]:
    """What becomes of a file (`loads`, `runs`, `refused` or `fails`), and the reasons if it is refused or fails."""
    try:
        scenario = fogsim.load_scenario(file, [*PLAIN, f"duration_s={SECONDS}"] if is_run else PLAIN)
        if not is_run:
            return "loads", []
        for _ in fogsim.run(scenario):
            pass
    except InputError as error:
        return "refused", [line.removeprefix(f"{file}:") for line in str(error).splitlines()]
    except Exception:  # noqa: BLE001 - whatever else it ends in is what this tool is to find
        return "fails", traceback.format_exc().splitlines()[-1:]
    return "runs", []


def kind_of(reason: str) -> str:
    """A reason without lines, paths and names, so that reasons of the same kind count together."""
    _, _, told = reason.rpartition(": /")
    tag = re.match(r"\S*?([A-Za-z]+)(\[[^]]*\])?: (.*)", told)
    return re.sub(r"'[^']*'|\d+(\.\d+)?", "…", f"{tag[1]}: {tag[3]}" if tag else reason)[:110]


def main() -> int:
    """Judge the files that the command line names, and those in its folders."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("paths", nargs="+", type=Path)
    parser.add_argument("--run", action="store_true", help=f"run each file for {SECONDS:g} s")
    parser.add_argument("--maps", type=Path, help="folder with the maps that files name (Town01.xodr)")
    given = parser.parse_args()
    if given.maps:
        os.environ["FOGSIM_MAPS"] = str(given.maps)
    files = [f for path in given.paths for f in (sorted(path.rglob("*.xosc")) if path.is_dir() else [path])]
    warnings.simplefilter("ignore")
    known, counts, kinds, is_bad = schemas(), Counter[str](), Counter[str](), False
    for file in files:
        if "<Catalog " in file.read_text(encoding="utf-8", errors="replace"):
            counts["catalog"] += 1
            continue
        how, reasons = outcome(file, given.run)
        fits = fit(file, known)
        counts[how] += 1
        kinds.update({kind_of(reason) for reason in reasons if not reason.startswith("in the case ")})
        is_bad |= how == "fails" or fits not in ("", "valid")
        print(f"{file}: {how}" + (f"; its schema: {fits}" if fits else ""))  # noqa: T201 - a tool's answer
        for reason in reasons[:REASONS_SHOWN]:
            print(f"    {reason}")  # noqa: T201
        if len(reasons) > REASONS_SHOWN:
            print(f"    and {len(reasons) - REASONS_SHOWN} more")  # noqa: T201
    print("\n" + ", ".join(f"{count} {how}" for how, count in counts.most_common()))  # noqa: T201
    for kind, count in kinds.most_common():
        print(f"{count:5d}  {kind}")  # noqa: T201
    return int(is_bad)


if __name__ == "__main__":
    sys.exit(main())
