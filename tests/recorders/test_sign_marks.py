"""Signs of the map in the video's picture and in the report."""

import dataclasses
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fogsim.recorders.panel.camera_picture import draw_camera_picture
from fogsim.recorders.report_figures import SignBook
from fogsim.recorders.sign_marks import looks_of, sign_looks, sign_text
from fogsim.recorders.style import ADVICE, MUTED, Colour
from fogsim.values import SignLook, SignSighting, Step
from tests.recorders.synthetic import camera, estimate, make_step
from tests.recorders.test_report import Page, report

SIGN = SignSighting("s<1>", "stop", 0.0, 30.0, -4.0, 0.9)


def seen(*signs: SignSighting, looks: object = ()) -> Step:
    step = make_step(estimates=(estimate("m", 100.0), estimate("by_signs", 100.0, sign_looks=looks)))
    return dataclasses.replace(step, observation=dataclasses.replace(step.observation, signs=signs))


def places(step: Step, colour: Colour) -> NDArray[np.intp]:
    return np.argwhere((np.asarray(draw_camera_picture(step)) == colour).all(axis=-1))


def test_a_sign_of_the_map_is_marked_where_the_told_camera_has_it() -> None:
    assert not len(places(seen(), MUTED))
    marked, one = places(seen(SIGN), MUTED), sign_looks(seen(SIGN))[0]
    assert abs(marked[:, 1].mean() - 4 * (one.u + 0.5)) < 3.0
    assert abs(marked[:, 0].max() - 4 * (one.v + one.radius + 0.5)) < 5.0
    assert abs(one.u - (camera().principal_point[0] + 4.0 * camera().focal_length / 30.0)) < 0.2
    assert not len(places(seen(SIGN), ADVICE))
    assert not len(places(seen(dataclasses.replace(SIGN, distance=-9.0)), MUTED))


def test_what_a_method_found_is_bright_and_says_from_how_far() -> None:
    look = SignLook("s<1>", 40.0, 50.0, 3.0, 30.0, detected=True, first_seen=44.0)
    step = seen(SIGN, looks=(look,))
    assert sign_looks(step) == (look,)
    marked = places(step, ADVICE)
    assert abs(np.median(marked[:, 1]) - 4 * 40.5) < 30
    assert sign_text(look) == "30 m, seen from 44 m"
    assert sign_text(sign_looks(seen(SIGN))[0]) == "30 m"
    bare = dataclasses.replace(step.observation, frame=step.observation.image)
    assert sign_looks(dataclasses.replace(step, observation=bare)) == (look,)


def test_other_diagnostics_of_that_name_are_no_looks() -> None:
    assert looks_of(None) == looks_of("signs") == looks_of([1]) == looks_of((1, "a")) == ()


def test_the_report_tells_from_where_each_sign_was_seen(tmp_path: Path) -> None:
    far, near = (dataclasses.replace(SIGN, distance=distance) for distance in (90.0, 20.0))
    look = SignLook("s<1>", 40.0, 50.0, 3.0, 30.0, detected=True, first_seen=44.0)
    other = dataclasses.replace(SIGN, sign_id="b")
    steps = [
        dataclasses.replace(step, index=index, time=0.2 * index)
        for index, step in enumerate([seen(far), seen(SIGN, other, looks=(look,)), seen(near)])
    ]
    book = SignBook()
    for step in steps:
        book.add(step)
    assert [(row.sign_id, row.mapped_at, row.first_seen, row.nearest) for row in book.rows] == [
        ("s<1>", 90.0, 44.0, 20.0),
        ("b", 30.0, None, 30.0),
    ]
    text = Page(report(tmp_path, steps, complete=False)).text
    assert "Signs of the map" in text
    assert "s<1>stop90 m44 m20 m" in text
    assert "1 of 2 were found" in text
    assert "Signs of the map" not in Page(report(tmp_path / "none", [make_step()], complete=False)).text
