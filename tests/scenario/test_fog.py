"""Keys of the fog: what they become, and how mistakes in them are told."""

import math

import numpy as np
import pytest

from fogsim.atmosphere import extinction
from fogsim.errors import InputError
from fogsim.scenario import build, load_scenario, resolved
from fogsim.scenario.parts.methods import driver_sight
from fogsim.simulation.ego.daylight import in_daylight
from fogsim.units import extinction_from_visibility
from fogsim.values import FogChange, FogField, FogPatches

ROUTE = np.array([[0.0, 0.0, 412.0], [3000.0, 0.0, 430.0]])
"""A road 412 m above the zero of its net and higher."""


def fog(*settings: str) -> FogField:
    return build.world_config(load_scenario("motorway_fog_bank", [f"fog.{s}" for s in settings])).fog.along(ROUTE)


def test_heights_count_from_the_lowest_point_of_the_route() -> None:
    field = fog("visibility_m=100", "top_m=30", "top_edge_m=10", "base_m=2", "scale_height_m=15")
    assert (field.ground, field.base, field.top, field.top_edge) == (412.0, 414.0, 442.0, 10.0)
    assert field.scale_height == 15.0
    k = extinction_from_visibility(100.0)
    assert extinction(field, (0.0, 0.0, 412.0 + 15.0)) == pytest.approx(k / math.e)
    # Fog without a layer is on a high road, too.
    assert extinction(fog("visibility_m=100"), (100.0, 0.0, 414.0)) == pytest.approx(k)


def test_wind_is_named_by_where_it_comes_from() -> None:
    assert fog("visibility_m=100", "wind={speed_kmh: 36, from_deg: 270}").wind == pytest.approx((10.0, 0.0))
    assert fog("visibility_m=100", "wind={speed_kmh: 36, from_deg: 0}").wind == pytest.approx((0.0, -10.0))


def test_patches_and_changes() -> None:
    field = fog(
        "visibility_m=100",
        "patches={correlation_length_m: 60, correlation_height_m: 8, strength: 0.7, seed: 5}",
        "changes=[{at_s: 0}, {at_s: 60, density: 2}]",
    )
    assert field.patches == FogPatches(60.0, 8.0, 0.7, 5)
    reach = (-math.inf, 412.0 + 250.0)
    assert field.changes == (FogChange(0.0, 1.0, *reach), FogChange(60.0, 2.0, *reach))


def test_lifting_fog() -> None:
    field = fog("visibility_m=100", "changes=[{at_s: 0, base_m: -5, top_m: 50}, {at_s: 100, base_m: 15, top_m: 90}]")
    eye = (0.0, 0.0, 413.5)
    assert extinction(field, eye, time=0.0) > 0
    assert extinction(field, eye, time=100.0) == 0.0


def test_the_resolved_scenario_says_it_all_again() -> None:
    settings = ["fog.visibility_m=100", "fog.patches={correlation_length_m: 60}", "fog.base_m=3", "fog.top_m=.inf"]
    scenario = load_scenario("motorway_fog_bank", settings)
    assert resolved(scenario)["fog"]["patches"]["strength"] == 0.6
    assert resolved(scenario)["fog"]["top_m"] == "inf"


def test_mistakes_are_told() -> None:
    for setting, told in [
        ("visibility_m=.nan", "fog.visibility_m: input should be greater than or equal to 1; got nan"),
        ("patches={correlation_lenght_m: 50}", "did you mean 'correlation_length_m'"),
        ("changes=[{at_s: 5}, {at_s: 5}]", "fog: at_s of changes must increase, got 5 and then 5"),
        ("changes=[{at_s: 5, top_m: 9}, {at_s: 6}]", "top_m must be given in all changes or in none, got it in 1 of 2"),
        ("changes=[{at_s: 5, top_m: .nan}]", "fog.changes.0.top_m"),
        ("base_m=300", "top_m must lie above base_m, soft edges included, got 250 and 300"),
        ("wind={speed_kmh: 5}", "fog.wind.from_deg: this key is missing"),
        ("banks=[{start_m: 500, end_m: 300, visibility_m: 40}]", "start_m must be less than end_m, got 500 and 300"),
        ("airlight=photons", "even fog in a layer on the ground (visibility_m, top_m), not with outside_visibility_m"),
    ]:
        with pytest.raises(InputError) as error:
            fog(setting)
        assert told in str(error.value)


def photons(*settings: str) -> FogField:
    return fog("visibility_m=100", "airlight=photons", *settings)


def test_airlight_of_photons() -> None:
    assert photons().ground_albedo == 0.1
    field = photons("ground_albedo=0.2", "changes=[{at_s: 0}, {at_s: 60, density: 2}]")
    assert field.ground_albedo == 0.2
    assert field.airlight[1] == pytest.approx((0.34 + 0.66 * 0.2) * 10_000.0 / math.pi)
    assert fog("visibility_m=100").ground_albedo is None


def test_the_land_sets_the_level_of_either_airlight() -> None:
    even, photons_field = fog("visibility_m=100", "ground_albedo=0.8"), photons("ground_albedo=0.8")
    assert even.ground_albedo is None
    assert even.airlight == photons_field.airlight
    assert even.airlight_share == photons_field.airlight_share == pytest.approx(0.868)
    assert in_daylight(even, 500.0).airlight[1] == pytest.approx(0.868 * 500.0 / math.pi)
    assert fog("visibility_m=100").airlight_share == photons().airlight_share == pytest.approx(0.406)
    # Drivers see vehicles before that level.
    for setting, share in (("ground_albedo: 0.8", 0.868), ("top_m: 200", 0.406)):
        sight = driver_sight(load_scenario("motorway_fog_bank", [f"fog={{visibility_m: 100, {setting}}}"]))
        assert sight.airlight_share == pytest.approx(share)


def test_layers_that_photons_do_not_know_are_told() -> None:
    for settings, told in [
        (("top_m=17.5",), "fog.top_m must be above the highest point of the road and the camera"),
        (("top_m=1000", "visibility_m=20"), "optical thickness up to 100, got 149.8"),
        (("changes=[{at_s: 0}, {at_s: 60, density: 40}]",), "optical thickness up to 100, got 299.6"),
        (("top_m=.inf",), "not with top_m: inf"),
        (("base_m=0",), "not with base_m"),
        (("patches={correlation_length_m: 60}",), "not with patches"),
        (("changes=[{at_s: 0, base_m: 5, top_m: 90}]",), "not with base_m in changes"),
    ]:
        with pytest.raises(InputError) as error:
            photons(*settings)
        assert told in str(error.value)


def test_photons_are_of_daylight() -> None:
    settings = ["fog={visibility_m: 100, airlight: photons}"]
    dusk = "timeline=[{when: time >= 1 s, do: {light: {illuminance_lx: 100}}}]"
    for light, value in (("light.illuminance_lx=50", "light.illuminance_lx is 50"), (dusk, "illuminance_lx is 100")):
        with pytest.raises(InputError, match=f"{value}, and fog.airlight: photons is of the sky's light"):
            load_scenario("motorway_fog_bank", [*settings, light])
