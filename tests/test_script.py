from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml

from fogsim import InputError, catalogue, load_scenario
from fogsim import script as fs
from fogsim.scenario import resolved


@pytest.fixture
def patchy():
    """The issue of a test engineer: late advice in patchy fog while the radar is dead."""
    return fs.Scenario(
        name="patchy_fog",
        duration_s=20,
        road=fs.Road(template="motorway", length_m=3000, lanes=2, limit_kmh=130),
        demand=fs.Demand(same_way_vph=540, oncoming_vph=540),
        actors={
            "ego": fs.Actor(lane="right", speed_kmh=90),
            "slow": fs.Actor(type="truck", ahead_of="ego", gap_m=400, speed_kmh=80),
        },
        fog=fs.Fog(visibility_m=150, patches=fs.Patches(correlation_length_m=150, strength=0.7)),
        timeline=(
            fs.TimelineEntry(
                name="near",
                when=fs.signal("gap(ego, slow)") < "80 m",
                do={"sensors.lead": fs.LeadDropout(sensor="lead", fault="dropout", for_s=3)},
            ),
        ),
        estimators=(fs.Method(method="joint_road"),),
        expect={
            "safe": fs.Expectation(
                never=fs.condition("ego.collision"),
                always=fs.signal("ego.ttc") >= "1.5 s",
                during=fs.negated(fs.signal("ego.speed") < "5 km/h"),
            )
        },
    )


def test_what_python_says_comes_out_as_the_file_that_says_it(tmp_path, patchy):
    file = fs.write(
        patchy,
        tmp_path / "patchy.fog.yaml",
        vary={
            "strength": fs.varied([0.4, 0.7], "fog.patches.strength"),
            "run": fs.varied("45 seeds", "fog.patches.seed"),
            "gap": fs.varied({"from": "350 m", "to": "400 m", "step": "50 m"}, "actors.slow.gap_m"),
        },
        verdict=fs.Verdict(pass_rate=0.95, confidence=0.9),
    )
    data = yaml.safe_load(file.read_text())
    assert data["timeline"] == [
        {
            "name": "near",
            "when": "gap(ego, slow) < 80 m",
            "do": {"sensors.lead": [{"sensor": "lead", "fault": "dropout", "for_s": 3}]},
        }
    ]
    assert data["expect"]["safe"]["while"] == "not ego.speed < 5 km/h"
    assert data["fog"]["patches"]["strength"] == "$strength"
    assert data["vary"]["strength"] == [0.4, 0.7]
    first = load_scenario(file)
    assert first.actors["slow"].gap_m == 350
    assert first.fog.patches.strength == 0.4
    assert resolved(load_scenario(fs.write(patchy, str(tmp_path / "plain.yaml")))) == resolved(patchy)


def test_shipped_scenarios_come_out_as_they_went_in(tmp_path):
    for name in catalogue():
        scenario = load_scenario(name)
        file = fs.write(scenario, tmp_path / f"{name}.yaml")
        again = load_scenario(file)
        there, here = resolved(again), resolved(scenario)
        for data, folder in ((there, tmp_path), (here, scenario.directory)):
            for key in ("config", "net", "routes", "additional"):
                named = data["traffic"].pop(key, [])
                data[key] = [(folder / one).resolve() for one in ([named] if isinstance(named, str) else named)]
        assert there == here


def test_names_that_look_like_numbers_stay_names(tmp_path: Path) -> None:
    actors = {
        "ego": fs.Actor(lane="right", speed_kmh=90),
        "08": fs.Actor(type="truck", ahead_of="ego", gap_m=400, speed_kmh=80),
        "1e3": fs.Actor(ahead_of="08", gap_m=60, speed_kmh=80),
    }
    road = fs.Road(template="motorway", length_m=3000, lanes=2)
    scenario = fs.Scenario(name="numbers", road=road, actors=actors, fog=fs.Fog(visibility_m=150))
    assert load_scenario(fs.write(scenario, tmp_path / "numbers.yaml")).actors["1e3"].ahead_of == "08"


def test_conditions_by_operators():
    speed = fs.signal("ego.speed")
    assert str(speed > "50 km/h") == "ego.speed > 50 km/h"
    assert str(speed <= fs.signal("advice")) == "ego.speed <= advice"
    assert str(fs.signal("ego.lane").becomes("left")) == "ego.lane becomes left"
    assert str(fs.signal("lamps").includes("rear_fog")) == "lamps include rear_fog"
    both = fs.all_of(speed.falls_below("20 km/h"), fs.any_of(fs.condition("ego.collision"), fs.signal("time") > "9 s"))
    assert fs.condition(str(both)) == both
    assert "for 3 s" in str(fs.held(speed < "5 km/h", "3 s"))


def test_mistakes_of_conditions_are_told():
    with pytest.raises(InputError, match="sped"):
        fs.condition("ego.sped > 3 m/s")
    with pytest.raises(InputError, match="the unit 's' does not fit"):
        assert fs.signal("ego.speed") > "3 s"


def test_a_file_with_a_mistake_is_not_written(tmp_path, patchy):
    wrong = patchy.model_copy(update={"expect": {"safe": fs.Expectation(always=fs.signal("slw.speed") > "3 m/s")}})
    with pytest.raises(InputError, match="slw"):
        fs.write(wrong, tmp_path / "wrong.fog.yaml")
    with pytest.raises(InputError, match=r"vary: there is no fog\.paches\.strength; did you mean 'patches'"):
        fs.write(patchy, tmp_path / "wrong.fog.yaml", vary={"s": fs.varied([0.4], "fog.paches.strength")})
    assert not list(tmp_path.iterdir())
    (tmp_path / "there.yaml").write_text("")
    with pytest.raises(InputError, match="already exists"):
        fs.write(patchy, tmp_path / "there.yaml")


def test_checking_a_file_touches_no_other(tmp_path, patchy):
    (tmp_path / ".mine.fog.yaml").write_text("the user's own")
    fs.write(patchy, tmp_path / "mine.fog.yaml")
    assert (tmp_path / ".mine.fog.yaml").read_text() == "the user's own"
    assert len(list(tmp_path.iterdir())) == 2
    wrong = fs.varied(["60 m", "-3 m"], "fog.visibility_m")
    with pytest.raises(InputError, match=r"wrong.fog.yaml:[0-9]+: fog.visibility.*\nin the case visibility=-3 m"):
        fs.write(patchy, tmp_path / "wrong.fog.yaml", vary={"visibility": wrong})
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize("values", [np.linspace(60.0, 80.0, 3), [np.float64(60.0)], range(60, 80)])
def test_values_that_a_file_cannot_hold(patchy, values):
    with pytest.raises(InputError, match=r"vary: expected numbers, text, .* as \.tolist"):
        fs.to_yaml(patchy, vary={"visibility": fs.varied(values, "fog.visibility_m")})


def test_a_signal_is_no_truth_value():
    with pytest.raises(InputError, match=r"'ego\.collision' is true or false only in a run; use all_of"):
        _ = fs.signal("ego.collision") and fs.signal("time") > "3 s"


def test_a_condition_has_no_truth_so_that_none_is_lost() -> None:
    slow, fast = fs.signal("ego.speed") < "5 km/h", fs.signal("ego.speed") > "90 km/h"
    lossy: list[Callable[[], object]] = [
        lambda: slow and fast,
        lambda: slow or fast,
        lambda: not slow,
        lambda: "1 km/h" < fs.signal("ego.speed") < "3 km/h",
        *(lambda one=one: not one for one in (fs.negated(slow), fs.held(slow, "1 s"), fs.any_of(slow, fast))),
    ]
    for mistake in lossy:
        with pytest.raises(InputError, match="only in a run; use all_of, any_of and negated"):
            mistake()


@pytest.mark.parametrize(
    ("block", "message"),
    [
        (lambda: fs.Fog(visibilty_m=80), "^Fog: visibilty_m: unknown key; did you mean 'visibility_m'"),
        (lambda: fs.Expectation(always=False), "^Expectation: always: expected a condition .*, got False$"),
        (lambda: fs.Fog(banks=[{"start_m": 0, "end_m": 9}]), r"^Fog: banks\.0\.visibility_m: this key is missing"),
    ],
)
def test_a_mistake_in_a_block_is_reported_as_in_a_file(block: Callable[[], object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        block()
