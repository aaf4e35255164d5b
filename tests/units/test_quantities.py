import math

import pytest

from fogsim.units.quantities import UNIT_OF_SUFFIX, is_quantity, parse_quantity


def test_quantities_are_read_in_the_unit_that_is_asked_for():
    for text, unit, number in [
        ("90 km/h", "m/s", 25.0),
        ("65 mph", "km/h", 104.60736),  # international mile, 1609.344 m
        ("0.15 veh/s", "veh/h", 540.0),
        ("95 %", "", 0.95),
        ("95 %", "%", 95.0),
        ("7km", "m", 7000.0),
        ("180 °", "deg", 180.0),
        ("3 m/s²", "m/s^2", 3.0),
        ("2 min", "s", 120.0),
        ("-1e2 ft", "m", -30.48),
        ("0", "m", 0.0),
    ]:
        assert parse_quantity(text, unit) == pytest.approx(number, rel=1e-12)


def test_shares_and_speeds_are_exact():
    assert parse_quantity("95 %", "") == 0.95
    assert parse_quantity("100 km/h", "m/s") == 100 / 3.6


def test_what_is_endless_needs_no_unit():
    assert parse_quantity("inf", "m") == math.inf
    assert parse_quantity("inf m", "m") == math.inf


def test_only_inf_is_endless():
    for text in ("1e400 m", "1e308 km", "-1e400 km", "1e400"):
        with pytest.raises(ValueError, match=r"expected a number of at most 1\.8e\+308, or inf|has no unit"):
            parse_quantity(text, "m")
    with pytest.raises(ValueError, match="or inf, got '1e400'"):
        parse_quantity("1e400", "")


def test_what_does_not_fit_is_refused_with_an_example():
    for text, told in [
        ("5", "has no unit"),
        ("3 s", "does not fit"),
        ("3 kmm", "unknown unit"),
        ("3 m*", "unknown unit"),
        ("3 __import__('os')", "unknown unit"),
        ("3 m^99999999", "does not fit"),
        ("fast", "expected a number and a unit"),
    ]:
        with pytest.raises(ValueError, match=told) as error:
            parse_quantity(text, "m")
        assert "10 m" in str(error.value)


def test_angles_vehicles_and_persons_are_no_plain_numbers():
    for text, unit in [("5 deg", "%"), ("10 %", "deg"), ("5 cd/m^2", "lx"), ("5 lm", "cd"), ("9 veh/h", "persons/h")]:
        with pytest.raises(ValueError, match="does not fit"):
            parse_quantity(text, unit)
    assert parse_quantity("5 lm/m^2", "lx") == 5.0


def test_every_suffix_has_a_unit_that_can_be_read():
    for unit in UNIT_OF_SUFFIX.values():
        assert parse_quantity(f"2 {unit}", unit) == 2.0


def test_text_that_is_no_quantity():
    assert not is_quantity("motorway")
    assert not is_quantity(5.0)
