"""Faults of the ego's sensors in whole runs: what comes out of the sensors, and what is made of it."""

import numpy as np
import pytest
from early_motorway import EARLY

import fogsim
from fogsim.values import Frame, Step
from fogsim.values.fault import Blackout, Fault

SMALL = (
    EARLY,
    "camera.width=160",
    "camera.height=120",
    "duration_s=1",
    "fog.visibility_m=100",
    "estimators=[zhu2015]",
    "advice=none",
)


def steps(*faults: str, settings: tuple[str, ...] = ()) -> list[Step]:
    written = [*SMALL, "fusion=grid_filter", *settings, f"sensors.faults=[{', '.join(faults)}]"]
    return list(fogsim.run(fogsim.load_scenario("motorway_fog_bank", written), seed=2))


def frame(step: Step) -> Frame:
    return step.observation.frame


@pytest.fixture(scope="module")
def plain() -> list[Step]:
    return steps()


def test_a_camera_that_goes_black_leaves_all_else_as_it_was_and_no_estimate(plain: list[Step]) -> None:
    black = steps("{sensor: camera, fault: blackout, at: 0.3 s, for: 0.4 s}")
    for index, (one, other) in enumerate(zip(black, plain, strict=True)):
        assert one.observation.lead == other.observation.lead
        assert frame(one).time == one.time
        if 3 <= index < 7:
            assert not frame(one).image.any()
            assert not any(estimate.valid for estimate in one.estimates)
            assert [fault.name for fault in one.truth.faults] == ["camera blackout"]
        else:
            np.testing.assert_array_equal(frame(one).image, frame(other).image)
            assert one.truth.faults == ()
    widths = [step.belief.log_standard_deviation for step in black[2:7]]
    assert widths == sorted(widths)
    assert widths[-1] > widths[0]


def test_a_fault_that_never_comes_changes_no_byte(plain: list[Step]) -> None:
    for one, other in zip(steps("{fault: blackout, at: 50 s}"), plain, strict=True):
        np.testing.assert_array_equal(frame(one).image, frame(other).image)
        np.testing.assert_array_equal(one.belief.probability, other.belief.probability)


@pytest.mark.parametrize("time_stamp", ["exposure", "delivery"])
def test_a_frozen_frame_is_no_news_whatever_time_it_bears(plain: list[Step], time_stamp: str) -> None:
    frozen = steps(f"{{fault: frozen, at: 0.5 s, for: 0.3 s, time_stamp: {time_stamp}}}")
    for step in frozen[5:8]:
        np.testing.assert_array_equal(frame(step).image, frame(plain[4]).image)
        assert frame(step).time == (plain[4].time if time_stamp == "exposure" else step.time)
        assert not any(estimate.valid for estimate in step.estimates)
    assert [estimate.valid for estimate in frozen[8].estimates] == [estimate.valid for estimate in plain[8].estimates]


def test_faults_begin_in_the_run_too_and_each_has_its_own_chance() -> None:
    with fogsim.ClosedLoop(fogsim.load_scenario("motorway_fog_bank", [*SMALL])) as loop:
        first = loop.start(2)
        loop._equipment.begin_faults([Fault(Blackout(), duration=0.1)], 0.1)
        seen = [frame(loop.advance(first.command)).image.any() for _ in range(2)]
    assert seen == [False, True]


def test_a_run_without_frames_takes_no_fault_of_the_camera() -> None:
    with pytest.raises(fogsim.InputError, match=r"faults\.0 is of the camera, and renderer: none"):
        fogsim.load_scenario(
            "motorway_fog_bank", ["renderer=none", "estimators=[]", "sensors.faults=[{fault: blackout}]"]
        )


def test_a_knocked_camera_sees_what_one_sees_that_was_mounted_so(plain: list[Step]) -> None:
    knocked = steps("{fault: calibration, pitch: 0.5 deg, roll: 1 deg, focal_length: 2 %}")
    view = np.degrees(2.0 * np.arctan(np.tan(np.radians(29.0)) / 1.02))
    mounted = ["camera.pitch_deg=2.5", "camera.roll_deg=1", f"camera.field_of_view_deg={view}"]
    other = next(fogsim.run(fogsim.load_scenario("motorway_fog_bank", [*SMALL, *mounted]), seed=2))
    difference = frame(knocked[0]).image.astype(int) - frame(other).image
    assert (difference != 0).mean() < 0.01
    assert frame(knocked[0]).camera == frame(plain[0]).camera
    camera = knocked[0].truth.camera
    assert camera.pitch == pytest.approx(np.radians(2.5))


def test_signs_that_have_gone_are_not_drawn_but_stay_on_the_map(plain: list[Step]) -> None:
    blind = "renderer=none", "estimators=[]"
    gone = steps("{sensor: signs, fault: missing, at: 0.5 s, for: 0.2 s}", settings=blind)
    assert [len(step.truth.signs.signs) > 0 for step in gone] == [True] * 5 + [False] * 2 + [True] * 4
    assert [step.observation.signs for step in gone] == [step.observation.signs for step in plain]
    forgotten = steps(
        "{sensor: signs, fault: missing, where: map}", "{sensor: gps, fault: outage, at: 5 s}", settings=blind
    )
    assert all(step.observation.signs == () and step.truth.signs.signs for step in forgotten)


def test_the_picture_of_the_sign_map_knows_nothing_of_the_truth() -> None:
    truths = [
        ("fog.visibility_m=400", "sensors.faults=[]"),
        (
            "fog.visibility_m=40",
            "sensors.faults=[{sensor: signs, fault: moved, along: 9 m, left: 3 m},"
            " {fault: calibration, pitch: 2 deg, focal_length: 5 %}]",
        ),
    ]
    settings = ["camera.width=160", "camera.height=120", "duration_s=0.4", "expect={}"]
    runs = [
        list(fogsim.run(fogsim.load_scenario("sign_missing_and_moved", [*settings, *truth]), seed=2))
        for truth in truths
    ]
    for one, other in zip(*runs, strict=True):
        assert other.truth.signs != one.truth.signs
        assert one.observation.sign_map.any()
        np.testing.assert_array_equal(other.observation.sign_map, one.observation.sign_map)
        np.testing.assert_array_equal(other.observation.sign_map_from_above, one.observation.sign_map_from_above)


def test_mistakes_in_faults_are_told_by_key_and_value() -> None:
    for fault, told in [
        ("{fault: wetlens}", r"sensors\.faults\.0\.fault: unknown fault 'wetlens'; did you mean 'wet_lens'\?"),
        ("{sensor: lead}", r"sensors\.faults\.0\.fault: this key is missing"),
        ("{sensor: lead, fault: wet_lens}", r"sensors\.faults\.0\.sensor: input should be 'camera'; got 'lead'"),
        ("{fault: wet_lens, covrage: 0.1}", r"sensors\.faults\.0\.covrage: unknown key; did you mean 'coverage'\?"),
        ("{fault: wet_lens, at: 3 km}", r"sensors\.faults\.0\.at: the unit 'km' does not fit"),
    ]:
        with pytest.raises(fogsim.InputError, match=told):
            fogsim.load_scenario("motorway_fog_bank", [f"sensors.faults=[{fault}]"])


def test_a_sign_that_is_not_there_stops_the_run_at_its_beginning() -> None:
    with pytest.raises(fogsim.InputError, match=r"there is no sign 'limit'; did you mean 'limit\.exit'"):
        steps("{fault: moved, ids: [limit], left: 3 m}")
