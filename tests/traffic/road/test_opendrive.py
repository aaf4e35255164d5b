import math
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.traffic.road.opendrive import PlanView, opendrive_signs, plan_view

CURVE = (
    '<geometry s="0" x="10" y="20" hdg="0" length="100"><line/></geometry>'
    '<geometry s="100" x="110" y="20" hdg="0" length="50"><spiral curvStart="0" curvEnd="0.005"/></geometry>'
    '<geometry s="150" x="159.922" y="22.078" hdg="0.125" length="80"><arc curvature="0.005"/></geometry>'
)


def line(geometries: str) -> PlanView:
    return plan_view(ET.fromstring(f"<planView>{geometries}</planView>"))  # noqa: S314 - text of this test


def file(folder: Path, signals: str, geometries: str = CURVE, more: str = "") -> Path:
    path = folder / "roads.xodr"
    path.write_text(
        f'<OpenDRIVE><header revMajor="1"/><road id="7" length="230"><planView>{geometries}</planView>{more}'
        f"<signals>{signals}</signals></road></OpenDRIVE>",
        encoding="utf-8",
    )
    return path


def test_a_quarter_circle() -> None:
    arc = f'<geometry s="0" x="1" y="2" hdg="0" length="{50 * math.pi}"><arc curvature="0.01"/></geometry>'
    assert line(arc).at(50 * math.pi) == pytest.approx((101.0, 102.0, math.pi / 2))
    right = arc.replace('"0.01"', '"-0.01"')
    assert line(right).at(50 * math.pi) == pytest.approx((101.0, -98.0, -math.pi / 2))


def test_a_spiral_is_the_clothoid() -> None:
    """Fresnel integrals at 1: C = 0.7798934004, S = 0.4382591474 (Abramowitz & Stegun, table 7.7)."""
    scale = 80.0  # x = scale C(s / scale) where the curvature grows by π / scale² each metre
    end = math.pi / scale
    spiral = f'<geometry s="0" x="0" y="0" hdg="0" length="80"><spiral curvStart="0" curvEnd="{end}"/></geometry>'
    x, y, heading = line(spiral).at(80.0)
    assert (x / scale, y / scale) == pytest.approx((0.7798934004, 0.4382591474), abs=1e-10)
    assert heading == pytest.approx(math.pi / 2)


def test_a_spiral_without_change_of_curvature_is_an_arc() -> None:
    arc = '<geometry s="0" x="3" y="4" hdg="1" length="90"><arc curvature="0.02"/></geometry>'
    almost = arc.replace('<arc curvature="0.02"/>', '<spiral curvStart="0.02" curvEnd="0.0200000001"/>')
    assert line(almost).at(77.0) == pytest.approx(line(arc).at(77.0), abs=1e-5)


def test_the_nearest_place_is_where_a_point_lies_beside_the_line() -> None:
    unknown = '<geometry s="230" x="229" y="43" hdg="0.5" length="9"><poly3 a="0" b="0" c="0" d="0"/></geometry>'
    whole = line(CURVE + unknown)
    for s in (0.0, 37.0, 99.0, 131.0, 170.0, 229.0):
        x, y, heading = whole.at(s)
        for aside in (-9.0, 6.0):
            found = whole.nearest(x - aside * math.sin(heading), y + aside * math.cos(heading))
            assert found == pytest.approx(s, abs=0.02)


def test_the_line_has_no_jumps_between_its_pieces() -> None:
    whole = line(CURVE)
    places = np.array([whole.at(s) for s in np.arange(0.0, 230.1, 0.5)])
    steps = np.hypot(*np.diff(places[:, :2], axis=0).T)
    assert steps == pytest.approx(0.5, abs=1e-2)
    assert np.diff(places[:, 2]).max() == pytest.approx(0.0025, rel=0.01)


def test_a_signal_stands_to_the_right_and_speaks_to_those_who_drive_along(tmp_path: Path) -> None:
    signal = (
        '<signal id="s" s="40" t="-6" zOffset="2" orientation="+" type="274" value="80" unit="km/h" '
        'width="0.6" height="0.6"/>'
    )
    elevation = '<elevationProfile><elevation s="0" a="5" b="0.01" c="0" d="0"/></elevationProfile>'
    (sign,) = opendrive_signs(file(tmp_path, signal, more=elevation), net_offset=(1000.0, -10.0))
    assert (sign.sign_id, sign.kind, sign.diameter) == ("xodr.s", "speed_limit", 0.6)
    assert sign.value == pytest.approx(80 / 3.6)
    assert sign.position == pytest.approx((10 + 40 + 1000, 20 - 6 - 10, 5 + 0.4 + 2 + 0.3))
    for t, orientation, heading in [
        (-6, "+", 0.0),
        (-6, "none", 0.0),
        (6, "none", math.pi),
        (-6, "-", math.pi),
        (6, "+", 0),
    ]:
        text = f'<signal id="s" s="40" t="{t}" orientation="{orientation}" type="274" value="80"/>'
        (sign,) = opendrive_signs(file(tmp_path, text))
        assert sign.heading == pytest.approx(heading)


def test_what_a_signal_says(tmp_path: Path) -> None:
    for attributes, kind, value in [
        ('type="274" value="-1" subtype="60"', "speed_limit", 60 / 3.6),
        ('type="R2-1" name="SpeedLimit" value="65" unit="mph"', "speed_limit", 65 * 0.44704),
        ('type="274" value="30" unit="m/s"', "speed_limit", 30.0),
        ('type="276"', "xodr.276", 0.0),
        ('type="274" value="-1" subtype="-1"', "xodr.274", 0.0),
        ('type="262" value="7.5" unit="t"', "xodr.262", 7.5),
    ]:
        (sign,) = opendrive_signs(file(tmp_path, f'<signal id="s" s="40" t="-6" {attributes}/>'))
        assert sign.kind == kind
        assert sign.value == pytest.approx(value)
    # Lights that change are no signs.
    assert opendrive_signs(file(tmp_path, '<signal id="s" s="4" t="-6" dynamic="yes" type="1000001"/>')) == []


POLYNOMIAL = '<geometry s="0" x="0" y="0" hdg="0" length="230"><poly3 a="0"/></geometry>'


def test_signals_that_cannot_be_placed(tmp_path: Path) -> None:
    for signals, geometries, message in [
        ('<signal id="a" s="400" t="1"/>', CURVE, r"road '7': signal 'a': expected s on the road, 0 … 230 m, got 400"),
        ('<signal id="a" s="40"/>', CURVE, "t must be a number within .*, got ''"),
        (
            '<signal id="a" s="40" t="1"/>',
            POLYNOMIAL,
            "on a poly3; places on line, arc, spiral and paramPoly3 are known",
        ),
        ('<signal id="a" s="40" t="1"/>', "", "the road has no geometry"),
        ('<signal id="a" s="40" t="1" value="fast"/>', CURVE, "value must be a number within .*, got 'fast'"),
        ('<signal id="a" s="4" t="1" type="274" value="9" unit="kn"/>', CURVE, "expected the speed's unit to be one"),
        ('<signal id="a" s="4" t="1"/>', CURVE.replace('hdg="0"', ""), "<geometry> needs the attribute 'hdg'"),
    ]:
        with pytest.raises(InputError, match=message):
            opendrive_signs(file(tmp_path, signals, geometries))
    path = tmp_path / "a.xodr"
    for text, message in [("<net/>", "expected <OpenDRIVE> at its top, got <net>"), ("<OpenDRIVE", "not XML")]:
        path.write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=message):
            opendrive_signs(path)


@pytest.mark.parametrize(("p_range", "scale"), [("arcLength", 1.0), ("normalized", 200.0)])
def test_a_parametric_cubic(p_range: str, scale: float) -> None:
    # u = p, v = 1e-3 p² - 2e-6 p³ of a parameter in metres, 30° off east.
    b, c, d = scale, 1e-3 * scale**2, -2e-6 * scale**3
    at = line(
        f'<geometry s="0" x="5" y="7" hdg="{math.pi / 6}" length="200">'
        f'<paramPoly3 pRange="{p_range}" aU="0" bU="{b}" cU="0" dU="0" aV="0" bV="0" cV="{c}" dV="{d}"/></geometry>'
    ).at(100.0)
    u, v = 100.0, 10.0 - 2.0
    assert at[0] == pytest.approx(5 + u * math.cos(math.pi / 6) - v * math.sin(math.pi / 6))
    assert at[1] == pytest.approx(7 + u * math.sin(math.pi / 6) + v * math.cos(math.pi / 6))
    assert at[2] == pytest.approx(math.pi / 6 + math.atan(0.2 - 0.06))
