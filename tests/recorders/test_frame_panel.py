import dataclasses
import itertools
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from fogsim.metrics import step_metrics
from fogsim.recorders import FramePanel
from fogsim.recorders.panel.camera_picture import draw_camera_picture, scale_image
from fogsim.recorders.panel.strip_chart import TITLE, Axis, Curve, StripChart
from fogsim.recorders.style import ALARM, AMBER, BELIEF, GROUND, TRUTH
from fogsim.values import Collision, Command, DenserFog, DriverWarning, Ending, FogProfile, Lamp, Leader, Step
from tests.recorders.synthetic import estimate, make_step


def draw(*steps: Step) -> NDArray[np.uint8]:
    panel = FramePanel()
    for step in steps:
        frame = panel.draw(step, step_metrics(step))
    return frame


def differs(one: NDArray[np.uint8], other: NDArray[np.uint8], rows: slice, columns: slice) -> bool:
    return bool((one[rows, columns] != other[rows, columns]).any())


def test_a_frame_has_its_size_and_the_camera_image_on_the_left() -> None:
    image = np.arange(120 * 160 * 3, dtype=np.uint8).reshape(120, 160, 3)
    frame = draw(make_step(image=image))
    assert frame.shape == (480, 1024, 3)
    assert frame.dtype == np.uint8
    np.testing.assert_array_equal(frame[2:480:4, 2:640:4], image)


def test_images_of_more_bits_are_shown_in_eight() -> None:
    image = np.arange(120 * 160 * 3, dtype=np.uint8).reshape(120, 160, 3)
    step = make_step(image=image.astype(np.uint16) * 16 + 7)
    frame = step.observation.frame
    deep = dataclasses.replace(frame, camera=dataclasses.replace(frame.camera, bits=12))
    shown = draw(dataclasses.replace(step, observation=dataclasses.replace(step.observation, frame=deep)))
    np.testing.assert_array_equal(shown[2:480:4, 2:640:4], image)


def test_grey_images_and_odd_shapes_keep_their_aspect() -> None:
    wide = scale_image(np.full((100, 400), 90, np.uint8), 640, 480)
    assert wide.size == (640, 160)
    frame = draw(make_step(image=np.full((100, 400), 90, np.uint8)))
    assert tuple(frame[240, 320]) == (90, 90, 90)
    assert tuple(frame[100, 320]) != (90, 90, 90)


def test_speed_lead_and_lamps_each_change_their_own_part() -> None:
    plain = draw(make_step())
    faster = draw(make_step(speed=31.0))
    assert differs(plain, faster, slice(50, 100), slice(656, 780))
    assert not differs(plain, faster, slice(0, 480), slice(0, 640))
    lead = draw(make_step(leader=Leader("other", 30.0, 20.0)))
    assert differs(plain, lead, slice(240, 262), slice(656, 1008))
    assert not differs(plain, lead, slice(266, 480), slice(656, 1008))
    lit = draw(make_step(lamps=Lamp.REAR_FOG))
    assert (lit[268:287, 640:] == AMBER).all(axis=-1).sum() > 200
    assert not (plain[268:287, 640:] == AMBER).all(axis=-1).any()


def test_a_collision_of_the_ego_stays_in_red_for_three_seconds() -> None:
    hit = make_step(0, time=1.0, collisions=(Collision(1.0, "ego", "other", 9.0),))
    soon, late = make_step(1, time=3.9), make_step(2, time=4.1)
    assert tuple(draw(hit)[4, 10]) == ALARM
    assert tuple(draw(hit, soon)[4, 10]) == ALARM
    assert tuple(draw(hit, soon, late)[4, 10]) != ALARM
    others = dataclasses.replace(hit, collisions=(Collision(1.0, "a", "b", 9.0),))
    assert tuple(draw(others)[4, 10]) == AMBER


def test_a_warning_has_a_banner_which_a_collision_covers() -> None:
    warned = dataclasses.replace(make_step(), command=Command(warning=DriverWarning.CANNOT_SEE))
    frame = draw(warned)
    assert tuple(frame[4, 10]) == AMBER
    hit = dataclasses.replace(warned, collisions=(Collision(0.0, "ego", "other", 9.0),))
    assert tuple(draw(hit)[4, 10]) == ALARM
    fog = dataclasses.replace(warned, command=Command(warning=DriverWarning.FOG_AHEAD))
    bank = dataclasses.replace(fog, belief=dataclasses.replace(fog.belief, denser=DenserFog(200.0, 10.0, 0.03)))
    frames = [draw(one) for one in (warned, fog, bank)]
    assert all(differs(one, other, slice(0, 34), slice(0, 640)) for one, other in itertools.pairwise(frames))


def test_the_ending_is_named() -> None:
    assert differs(draw(make_step()), draw(make_step(ending=Ending.ARRIVED)), slice(446, 480), slice(0, 640))


@pytest.mark.parametrize("row", [0.0, 40.0, 119.0])
def test_marks_stand_at_the_rows_that_were_found(row: float) -> None:
    step = make_step(estimates=(estimate("m", 100.0, horizon_row=row),))
    pixels = np.asarray(draw_camera_picture(step))
    marked = np.flatnonzero((pixels[:, 3] == BELIEF).all(axis=-1))
    assert abs(marked.mean() - 4 * (row + 0.5)) <= 1.0


def test_rows_outside_the_image_or_unknown_are_not_marked() -> None:
    for row in [-5.0, 130.0, math.nan, None, "top"]:
        step = make_step(estimates=(estimate("m", 100.0, horizon_row=row),))
        assert not (np.asarray(draw_camera_picture(step)) == BELIEF).all(axis=-1).any()


def test_many_methods_clear_air_and_no_advice_can_be_drawn() -> None:
    many = tuple(estimate(f"method_{i}", 100.0) for i in range(6))
    few = make_step(estimates=many[:4])
    assert differs(draw(few), draw(make_step(estimates=many)), slice(156, 215), slice(656, 1008))
    assert draw(make_step(visibility=math.inf, estimates=many)).shape == (480, 1024, 3)


def test_a_curve_stands_at_its_value_and_parts_where_it_is_missing() -> None:
    chart = StripChart((130, 119), Axis(0.0, 100.0, ()), (Curve((255, 0, 0), (0,)),), "")
    # What is older than a minute has scrolled out.
    for second in range(-70, 61):
        chart.add(float(second), (25.0 if second < -5 else 75.0 if second < 20 or second > 40 else None,))
    pixels = np.asarray(chart.draw())
    red = (pixels == (255, 0, 0)).all(axis=-1)
    rows, columns = np.nonzero(red)
    assert abs(rows.mean() - (119 - 3 - 75)) < 1.5
    assert not red[:, 40:60].any()
    assert red[:, 10].any()
    assert red[:, 95].any()
    assert columns.max() < 100


def test_no_curve_crosses_the_title() -> None:
    chart = StripChart((130, 119), Axis(0.0, 100.0, ()), (Curve((255, 0, 0), (0,)),), "title")
    for second in range(61):
        chart.add(float(second), (1e6,))
    rows, _ = np.nonzero((np.asarray(chart.draw()) == (255, 0, 0)).all(axis=-1))
    assert TITLE - 2 <= rows.min() <= TITLE


def test_a_logarithmic_axis_has_equal_ratios_at_equal_distances_and_ends() -> None:
    axis = Axis(20.0, 2000.0, (), logarithmic=True)
    assert axis.height(200.0) == pytest.approx(0.5)
    assert axis.height(1.0) == 0.0
    assert axis.height(math.inf) == 1.0


def test_the_fog_along_the_road_is_drawn_where_it_is_believed() -> None:
    step = make_step()
    places = np.arange(-200.0, 801.0, 25.0)
    believed = FogProfile(places, np.linspace(-6.0, -3.0, places.size), np.full(places.size, 0.3))
    told = dataclasses.replace(step, belief=dataclasses.replace(step.belief, profile=believed))
    true = dataclasses.replace(told.truth, profile=dataclasses.replace(believed, log_extinction=np.full(41, -5.0)))
    without, with_belief, with_both = draw(step), draw(told), draw(dataclasses.replace(told, truth=true))
    left = slice(656, 824)
    assert differs(without, with_belief, slice(300, 392), left)
    # The chart of the last minute has a box of its own, next to it.
    assert (with_belief[300:392, 825:831] == GROUND).all()
    assert (with_belief[300:392, left] == BELIEF).all(axis=-1).any()
    assert (with_both[300:392, left] == TRUTH).all(axis=-1).any()
    assert not (with_belief[300:392, left] == TRUTH).all(axis=-1).any()
