"""A step from above."""

import dataclasses

import numpy as np

from fogsim.recorders import PICTURE_SIZE, draw_view_from_above
from fogsim.recorders.panel.view_from_above import SCALE, Extinctions
from fogsim.recorders.style import ADVICE, TEXT, TRUTH
from fogsim.units import extinction_from_visibility
from fogsim.values import Step
from tests.recorders.synthetic import make_step

EGO = 128, 240
"""Column and row of the ego's front bumper."""


def clear(places: np.ndarray) -> np.ndarray:
    return np.zeros(places.shape[:2])


def pixels(step: Step, fog: Extinctions = clear) -> np.ndarray:
    picture = draw_view_from_above(step, fog)
    assert picture.size == PICTURE_SIZE
    return np.asarray(picture)


def has(picture: np.ndarray, colour: tuple[int, int, int], columns: slice, rows: slice) -> bool:
    return bool((picture[rows, columns] == colour).all(axis=-1).any())


def test_vehicles_are_where_they_are_whatever_the_heading() -> None:
    ahead = slice(EGO[0] + round(60 * SCALE) - 12, EGO[0] + round(60 * SCALE))
    for turned in (0.0, 2.0):
        step = make_step()
        rotation = np.array([[np.cos(turned), np.sin(turned), 0.0], [-np.sin(turned), np.cos(turned), 0.0], [0, 0, 1]])
        place = (step.traffic.position[:, :, None] * rotation).sum(axis=1) + np.array([300.0, -100.0, 4.0])
        turned_traffic = dataclasses.replace(step.traffic, position=place, heading=step.traffic.heading + turned)
        picture = pixels(dataclasses.replace(step, traffic=turned_traffic))
        assert has(picture, ADVICE, slice(EGO[0] - 12, EGO[0]), slice(EGO[1] - 4, EGO[1] + 4))
        assert has(picture, TEXT, ahead, slice(EGO[1] - 4, EGO[1] + 4))
        assert not has(picture, TEXT, ahead, slice(60, EGO[1] - 20))


def test_denser_fog_is_brighter_and_an_arc_ends_the_sight() -> None:
    step = make_step()
    truth = dataclasses.replace(step.truth, extinction_ahead=extinction_from_visibility(100.0))
    picture = pixels(dataclasses.replace(step, truth=truth), lambda places: 0.05 * (places[..., 0] > 100.0) + 0.003)
    before, within = picture[100, EGO[0] + 30, 0], picture[100, EGO[0] + round(200 * SCALE), 0]
    assert within > 1.5 * before
    edge = EGO[0] + round(100 * SCALE)
    assert has(picture, TRUTH, slice(edge - 3, edge + 3), slice(EGO[1] - 30, EGO[1] + 30))
    endless = dataclasses.replace(step, truth=dataclasses.replace(step.truth, extinction_ahead=0.0))
    assert not has(pixels(endless), TRUTH, slice(0, 640), slice(0, 480))
