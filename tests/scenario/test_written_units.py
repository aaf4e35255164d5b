import pytest

from fogsim import InputError, load_scenario

BASE = "name: u\nduration: 2 min\ntraffic: {net: a.net.xml, routes: [a.rou.xml], ego: ego}\n"


@pytest.fixture
def written(tmp_path):
    def load(text, overrides=()):
        source = load_scenario("motorway_fog_bank")
        net, routes = source.directory / source.traffic.net, source.directory / source.traffic.routes[0]
        named = BASE.replace("a.net.xml", str(net)).replace("a.rou.xml", str(routes))
        file = tmp_path / "u.yaml"
        file.write_text(named + text)
        return load_scenario(file, overrides)

    return load


def test_values_may_bring_their_units(written):
    scenario = written(
        "fog: {outside_visibility: 1.5 km, banks: [{start: 800 m, end: 1 mile, visibility: 50 m}],"
        " wind: {speed: 10 m/s, from: 90 deg}}\n"
        "drivers: {compliance: {rate: 60 %, delay: 0.1 min}, advised: signs, signs: {spacing: 700 m}}\n"
    )
    assert scenario.duration_s == 120
    assert scenario.fog.outside_visibility_m == 1500
    assert scenario.fog.banks[0].end_m == pytest.approx(1609.344)
    assert scenario.fog.wind.speed_kmh == 36
    assert scenario.drivers.compliance.rate == 0.6
    assert scenario.drivers.compliance.delay_s == pytest.approx(6)
    assert scenario.drivers.signs.spacing_m == 700


def test_an_override_takes_the_place_of_the_same_quantity_however_it_is_written(written):
    assert written("fog: {visibility: 150 m}\n", ["fog.visibility_m=80"]).fog.visibility_m == 80
    assert written("fog: {visibility_m: 150}\n", ["fog.visibility=0.2 km"]).fog.visibility_m == 200


def test_what_is_refused(written):
    for fog, told in [
        ("{visibility: 150 s}", r"u\.yaml:4: fog\.visibility: the unit 's' does not fit"),
        ("\n  visibility: 10 cm", r"u\.yaml:5: fog\.visibility_m: .*; got 0\.1"),
        (
            "{visibility: 150}",
            r"fog\.visibility: expected a value with its unit such as '10 m', or visibility_m; got 150",
        ),
        ("{visibility: 150 m, visibility_m: 150}", r"fog\.visibility: the key visibility_m is given too"),
    ]:
        with pytest.raises(InputError, match=told):
            written(f"fog: {fog}\n")
