"""Fitted drivers: the constants of simulated drivers come back, within intervals that hold."""

import math
import os
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

from fogsim.calibration.driver_calibration import Passages, fit_drivers, read_passages
from fogsim.errors import InputError
from fogsim.scenario import load_scenario
from fogsim.scenario.parts.methods import driver_setup
from fogsim.traffic.drivers.following import FOLLOWING_MODELS, Surroundings
from fogsim.traffic.drivers.sight import DriverSight, leader_reach
from fogsim.traffic.drivers.speed_choice import SPEED_CHOICES, ObservedSpeed, chosen_speed, speed_share

TRUE = {"slowest_share": 0.75, "overdriving": 1.7, "speed_spread": 0.15}
KINDS = {"in_sight": 0.3, "unaffected": 0.4, "careful": 0.15, "out_of_sight": 0.15}


def passages(
    count: int, seed: int, kinds: Mapping[str, float] | None = None, reach: tuple[float, float] = (25.0, 200.0)
) -> Passages:
    """Vehicles whose drivers are as `TRUE` says; with kinds of drivers, half of them follow another."""
    rng, choice = np.random.default_rng(seed), ObservedSpeed(slowest_share=0.75, overdriving=1.7)
    in_fog = np.exp(rng.uniform(math.log(reach[0]), math.log(reach[1]), count))
    visibility = np.where(rng.random(count) < 0.4, 2000.0, in_fog)
    own, factor = np.exp(rng.normal(math.log(31.0), 0.1, count)), np.exp(rng.normal(0.0, 0.15, count))
    rows = zip(factor, own, visibility, strict=True)
    speed = np.array([chosen_speed(choice, f, v, where) for f, v, where in rows])
    headway = np.full(count, np.nan)
    if kinds:
        headway = np.where(rng.random(count) < 0.5, 6.0, np.exp(rng.normal(math.log(1.4), 0.35, count)))
        sight, drawn = DriverSight(10_000.0), rng.choice(list(kinds), count, p=list(kinds.values()))
        for i in np.flatnonzero((headway < 4.0) & (visibility < 200.0)):
            around = Surroundings(visibility[i], leader_reach(sight, visibility[i]), speed[i], 2.5)
            headway[i] = FOLLOWING_MODELS[drawn[i]].headway(headway[i], around)
    return Passages(visibility, speed, headway, np.full(count, -1))


def test_speeds_come_back() -> None:
    ratio = fit_drivers(passages(5000, 99)).constants["overdriving"]
    assert ratio.high - ratio.low < 0.1
    assert ratio.value == pytest.approx(1.7, rel=0.03)


@pytest.mark.nightly
@pytest.mark.parametrize(
    # In light fog, few vehicles show whether sight or the driver's own wish limits their speed.
    ("reach", "most_missed"),
    [((25.0, 200.0), 14), ((90.0, 200.0), 7)],
)
def test_intervals_of_constants_hold(reach: tuple[float, float], most_missed: int) -> None:
    held = []
    for seed in range(24):
        found = fit_drivers(passages(500, seed, reach=reach)).constants
        held += [one.low <= TRUE[name] <= one.high for name, one in found.items()]
    # Of 72 intervals of 90 %, 7.2 exclude the truth on average, with a standard deviation of 2.5; of 27, 2.7 and 1.6.
    assert sum(not one for one in held) <= most_missed


def test_shares_of_kinds_come_back() -> None:
    found = fit_drivers(passages(1000, 1, KINDS)).following
    assert sum(one.value for one in found.values()) == pytest.approx(1.0)
    for kind in ("in_sight", "unaffected"):
        assert found[kind].low <= KINDS[kind] <= found[kind].high
    assert found["careful"].value == pytest.approx(KINDS["careful"], abs=0.05)


@pytest.mark.parametrize(
    ("reach", "fitted"), [((25.0, 45.0), ["overdriving", "speed_spread"]), ((150.0, 200.0), ["slowest_share"])]
)
def test_constants_that_no_vehicle_shows_are_left_out(reach: tuple[float, float], fitted: list[str]) -> None:
    found = fit_drivers(passages(500, 1, reach=reach))
    assert list(found.constants) == fitted
    drivers = found.as_yaml("data.csv").partition("drivers:\n")[2]
    assert [name for name in TRUE if name in drivers] == fitted


def test_equal_speeds_in_clear_air_are_refused() -> None:
    made = passages(400, 1)
    limited = np.where(made.visibility > 1000.0, 20.0, made.speed)
    with pytest.raises(InputError, match="different speeds in clear air"):
        fit_drivers(Passages(made.visibility, limited, made.headway, made.session))


def test_fits_stay_within_what_a_scenario_accepts() -> None:
    made = passages(400, 1)
    slow = np.where(made.visibility < 1000.0, 0.2 * made.speed, made.speed)
    text = fit_drivers(Passages(made.visibility, slow, made.headway, made.session)).as_yaml("data.csv")
    load_scenario("motorway_fog_bank", [f"drivers={{{_flow(text.partition('drivers:')[2][1:])}}}"])


def test_vehicles_of_a_session_count_together() -> None:
    """Vehicles measured twice say no more than once, where the session says so."""
    once = passages(400, 5)
    double = [np.repeat(values, 2) for values in (once.visibility, once.speed, once.headway)]
    alone = fit_drivers(once).constants["overdriving"]
    together = fit_drivers(Passages(*double, np.repeat(np.arange(400), 2))).constants["overdriving"]
    assert together == pytest.approx(alone, rel=1e-3)


def test_few_sessions_in_fog_are_refused() -> None:
    made = passages(400, 5)
    foggy = made.visibility < 1000.0
    alone = np.where(foggy, 0, np.arange(400))
    with pytest.raises(InputError, match=r"at least 10 sessions, got 1: .* leave out the column session"):
        fit_drivers(Passages(made.visibility, made.speed, made.headway, alone))


def test_what_is_written_is_a_scenarios(tmp_path: Path, command: Callable[..., tuple[int, str, str]]) -> None:
    made = passages(400, 3)
    rows = zip(made.visibility, 3.6 * made.speed, strict=True)
    data = tmp_path / os.fsdecode(b"m\xfcnchen.csv")
    data.write_text("visibility_m,speed_kmh\n" + "".join(f"{v},{s}\n" for v, s in rows))
    fitted = fit_drivers(read_passages(data))
    out = tmp_path / "drivers.yaml"
    code, printed, _ = command("calibrate", "drivers", str(data), "--out", str(out))
    assert code == 0
    assert "too few headways" in printed
    text = out.read_text(encoding="utf-8")
    assert text == fitted.as_yaml(r"m\udcfcnchen.csv")
    block = text.partition("drivers:\n")[2]
    scenario = load_scenario("motorway_fog_bank", [f"drivers={{{_flow(block)}}}"])
    choice = driver_setup(scenario).speed_choice
    assert choice.overdriving == pytest.approx(fitted.constants["overdriving"].value, abs=1e-3)


def _flow(block: str) -> str:
    """A block of YAML in one line."""
    method, parameters, *spread = (line.strip() for line in block.splitlines()[1:4])
    return ", ".join([f"speed_choice: {{{method}, {parameters}}}", *spread])


def test_what_cannot_be_fitted_is_refused(tmp_path: Path) -> None:
    for text, message in [
        ("visibility,speed\n", "expected columns visibility_m and either speed_kmh or speed_mps"),
        ("visibility_m,speed_kmh\n60,fast\n", "data.csv:2.*speed_kmh"),
        ("visibility_m,speed_kmh,session\n60,80,a\n60,80,\n", "data.csv:3: session is empty"),
        ("visibility_m,speed_kmh,headway\n60,80,2\n", "data.csv:1: column 'headway': did you mean 'headway_s'"),
        ("visibility_m,speed_kmh,session\n120,5,63,2,a\n", "data.csv:2: more cells than columns.* commas"),
        ("visibility_m,speed_kmh,headway_s\n120,63\n", "data.csv:2: fewer cells than columns"),
        ("visibility_m,speed_kmh,visibility_m\n60,80,2000\n", "data.csv:1: two columns are named 'visibility_m'"),
        ("visibility_m,speed_kmh\n60,80\n", "at least 30 vehicles in fog .* got 1"),
    ]:
        (tmp_path / "data.csv").write_text(text)
        with pytest.raises(InputError, match=message):
            fit_drivers(read_passages(tmp_path / "data.csv"))


def test_a_users_own_choice(tmp_path: Path, command: Callable[..., tuple[int, str, str]]) -> None:
    folder = tmp_path / "mine"
    assert command("new", "mine", "--from", "motorway_fog_bank", cwd=tmp_path)[0] == 0
    (folder / "commuters.py").write_text(
        "class Bold:\n"
        "    def __init__(self, seconds: float = 1.5) -> None:\n        self.seconds = seconds\n\n"
        "    def __call__(self, visibility: float) -> float:\n"
        "        return visibility / self.seconds if visibility > 20.0 else 'slowly'\n"
    )
    scenario = load_scenario(folder, ["drivers.speed_choice={method: commuters:Bold, parameters: {seconds: 2.0}}"])
    setup = driver_setup(scenario)
    assert setup.speed_choice(60.0) == pytest.approx(30.0)
    assert setup.following_shares == {"unaffected": 1.0}
    with pytest.raises(InputError, match="speed choice 'commuters:Bold' must return at least 0"):
        setup.speed_choice(10.0)


def test_a_choice_that_is_registered_is_checked_and_keeps_its_share(monkeypatch: pytest.MonkeyPatch) -> None:
    class Halved:
        def __call__(self, _: float) -> float:
            return math.nan

        def share(self, visibility: float) -> float:
            return 0.5 if visibility > 50.0 else -0.5

    monkeypatch.setitem(SPEED_CHOICES._entries, "halved", Halved)
    choice = driver_setup(load_scenario("motorway_fog_bank", ["drivers.speed_choice=halved"])).speed_choice
    assert speed_share(choice, 60.0) == 0.5
    with pytest.raises(InputError, match=r"speed choice 'halved' must return at least 0 .* got nan"):
        choice(60.0)
    with pytest.raises(InputError, match=r"speed choice 'halved': share\(\) must return at least 0 .* got -0.5"):
        speed_share(choice, 20.0)
