"""Figures of benchmarks/driver_warnings.py from drives by hand, which it goes on from and does not drive again."""

import json
from pathlib import Path

import pytest

from tests.helpers.command import run_script

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"
FOGS = (20_000, 5000, 3000, 1500, 400, 300, 200, 150, 100, 60)


def drive(about: str, visibility: int, seed: int, lead: float | None = None, false: int = 0) -> dict[str, object]:
    return {
        "about": about,
        "visibility_m": visibility,
        "seed": seed,
        "duration_s": 900.0,
        "distance_m": 20_000.0,
        "fog_warning_lead_m": lead,
        "false_fog_warnings": false,
        "fog_ahead_time_share": 0.1,
        "cannot_see_time_share": 0.2 if seed == 2 else 0.0,
        "camera_degraded_time_share": 0.0,
    }


def test_leads_and_false_warnings_an_hour(tmp_path: Path) -> None:
    drives = [drive("bank", 20_000, seed, lead) for seed, lead in ((1, 250.0), (2, 0.0), (3, 300.0))]
    drives += [drive("even", fog, seed, false=fog == 400) for seed in (1, 2) for fog in FOGS]
    kept = tmp_path / "kept.jsonl"
    units = ([[one["about"], one["visibility_m"], one["seed"]], one] for one in drives)
    kept.write_text("\n".join(map(json.dumps, ["driver_warnings", *units])) + "\n", encoding="utf-8")
    done = run_script(FOLDER / "driver_warnings.py", "--json", "--seeds", "3", "--drives", "2", "--keep", kept)
    bank, *fogs = json.loads(done.stdout)
    assert bank == {
        "about": "bank", "drives": 3, "median_m": 250.0, "least_m": 0.0, "most_m": 300.0, "missed": 1, "false": 0,
    }  # fmt: skip
    assert [one["about"] for one in fogs] == [*(f"{fog} m" for fog in FOGS), "all"]
    assert {one["about"]: one["false_per_h"] for one in fogs if one["false"]} == {"400 m": 4.0, "all": 0.4}
    assert fogs[-1]["hours"] == pytest.approx(5.0)
    assert fogs[-1]["km"] == pytest.approx(400.0)
    assert fogs[-1]["cannot_see_share"] == pytest.approx(0.1)
