"""Files of a vehicle's lamps."""

from pathlib import Path

import pytest
import yaml

from fogsim.errors import InputError
from fogsim.estimators.night.night_road import NightRoad
from fogsim.scenario.loading import load_scenario
from fogsim.scenario.parts.lamp_file import load_lamps
from fogsim.simulation import chosen_methods
from fogsim.values import Camera

SCENARIOS = Path(__file__).parents[2] / "scenarios"
CAMERA = Camera(320, 160, 300.0, (159.5, 79.5), 1.4, pitch=0.01)


def test_mistakes_are_told(tmp_path: Path) -> None:
    file = tmp_path / "lamps.yaml"
    for text, why in (
        ("heigth_m: 0.8\n", r"lamps.yaml:1: heigth_m: unknown key; did you mean 'height_m'"),
        ("low_beam: none.csv\n", r"none.csv: cannot be read: No such file"),
    ):
        file.write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=why):
            load_lamps(file)


def test_lamps_lie_next_to_the_scenario(tmp_path: Path) -> None:
    named = "estimators=[{method: night_road, parameters: {head_lamps: lamps.yaml}}]"
    file = tmp_path / "mine.yaml"
    copied = yaml.safe_load((SCENARIOS / "rural_night_alone" / "scenario.yaml").read_text(encoding="utf-8"))
    file.write_text(yaml.safe_dump({**copied, "expect": {}}), encoding="utf-8")
    with pytest.raises(InputError, match=f"estimators.0.parameters.head_lamps: there is no file {tmp_path}/lamps.yaml"):
        load_scenario(file, [named])
    (tmp_path / "lamps.yaml").write_text("height_m: 0.8\n", encoding="utf-8")
    for lamps in ("lamps.yaml", "unknown"):
        scenario = load_scenario(file, [named.replace("lamps.yaml", lamps)])
        assert [type(one) for one in chosen_methods.estimators(scenario.run_config().estimators, CAMERA)] == [NightRoad]
