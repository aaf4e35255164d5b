"""Every benchmark runs and prints the records that it promises; what it times is not judged here."""

import json
from pathlib import Path
from typing import Any

import pytest

from tests.helpers.command import run_script

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"


def records(name: str, *arguments: str) -> list[dict[str, Any]]:
    """What a benchmark prints."""
    done = run_script(FOLDER / name, "--json", *arguments)
    assert done.returncode == 0, done.stderr
    result: list[dict[str, Any]] = json.loads(done.stdout)
    return result


QUICK = {
    "junctions.py --seeds 1 --minutes 2 --visibility 20": (
        "visibility_m crossings accepted_least_s refused_most_s collisions_per_1000 impact_mps"
    ),
    "traffic.py --vehicles 20 --seconds 1": "vehicles ms_sumo ms_total ratio",
}
"""Keys of the records of benchmarks by command."""

SLOW = {
    "loop.py --size 64x48 --steps 3 --repeat 1": "env camera vehicles steps_per_s",
    "photograph_roads.py --images 1": "pool method visibility_m pictures valid_share",
    "environments.py --env fogsim/FogAdvisory-v1 --steps 2 --repeat 1 --resets 1": (
        "env camera vehicles steps_per_s peer_steps_per_s reset_ms"
    ),
    "sign_detector.py --pictures painted --kinds stop --visibilities 100 --distances 20 40 --draws 1 --frames 0": (
        "pictures kind operating_range_m recall_half_pct false_alarms_with false_alarms_without"
    ),
    "resets.py --resets 2 --part environment": "ms_median growth_kib_per_reset",
    "estimator_accuracy.py --cameras 1 --scenes 1 --draws 1": "method visibility median_pct p95_pct valid_share ms",
    "told_calibration.py --cameras 1 --scenes 1 --visibilities 100 --methods negru2013": (
        "error method visibility marks valid_share median_pct median_size_pct p95_size_pct"
    ),
    "lead_accuracy.py --cameras 1 --vehicles 1 --step 10 --methods huang2015_lead": (
        "method visibility airlight camera vehicle median_pct p95_pct coverage ms"
    ),
    "restoration.py --vehicles 1 --step 1 --visibilities 100": (
        "pool visibility_m method psnr_db ssim e r s_pct sift_range_m range_ratio ms"
    ),
    "frames.py --size 64x48 --frames 2 --repeat 1": "renderer light width height samples ms_median ms_min ms_render",
    "grades.py --visibility 100 --duration 1 --drawings 1": "V_met road method frames valid bias median p95 held",
}


@pytest.mark.parametrize(
    ("command", "keys"), [*QUICK.items(), *(pytest.param(*one, marks=pytest.mark.nightly) for one in SLOW.items())]
)
def test_records(command: str, keys: str) -> None:
    for record in records(*command.split()):
        assert set(keys.split()) <= set(record)


@pytest.mark.nightly
def test_fog_costs_lives_and_an_oracle_saves_some() -> None:
    """The scenario that the closing figures come from, with few seeds; the full study is the benchmark itself."""
    dense = records("collisions.py", "--seeds", "1", "--visibility", "40", "--protocol", "from_the_beginning")
    none, oracle = (next(r for r in dense if r["policy"] == p) for p in ("none", "oracle"))
    assert none["collisions_mean"] > 0
    assert oracle["collisions_mean"] < none["collisions_mean"]
    thin = records("collisions.py", "--seeds", "1", "--visibility", "1000", "--protocol", "full_road")
    assert all(r["collisions_mean"] == 0 for r in thin)


EXPECTING = """
name: even_fog
duration: 1.6 s
clocks: {camera_period: 0.2 s, decision_period: 0.4 s}
road: {template: motorway, length: 1 km}
actors:
  ego: {position: 200 m, speed: 90 km/h}
fog: {visibility: 100 m}
camera: {width: 160, height: 120}
estimators: [joint_road]
expect:
  advised: {while: time > 1 s, always: advice <= 80 km/h}
"""


def test_a_broken_device_is_caught(tmp_path: Path) -> None:
    (tmp_path / "scenario.yaml").write_text(EXPECTING, encoding="utf-8")
    sound, blind = "none: the sound device", "adviser ignores the belief"
    for devices, code in (((sound, blind), 0), (("no fog lamps",), 1)):
        done = run_script(FOLDER / "broken_devices.py", "--json", "--devices", *devices, "--scenarios", tmp_path)
        assert done.returncode == code, done.stderr
