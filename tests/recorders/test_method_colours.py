"""Methods are told apart by their colours, on dark and on light ground and by every kind of colour vision."""

import dataclasses

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from fogsim.estimators import ESTIMATORS
from fogsim.metrics import step_metrics
from fogsim.recorders import FramePanel, report_figures
from fogsim.recorders.style import BELIEF, GROUND, MUTED, ON_DARK, ON_LIGHT, TEXT, TRUTH, method_colours
from tests.recorders.synthetic import estimate, make_step

# Machado, Oliveira & Fernandes 2009, table 1, severity 1: linear RGB as protanopes, deuteranopes and tritanopes see it.
SIGHTS = {
    "normal": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.3039]],
}
REPORT = [tuple(round(255 * part) for part in to_rgb(name)) for name in (report_figures.BELIEF, report_figures.TRUTH)]
GROUNDS = {"dark": (ON_DARK, GROUND, (BELIEF, TRUTH)), "light": (ON_LIGHT, (255, 255, 255), REPORT)}


def lab(colours, sight) -> np.ndarray:
    """L*a*b* of sRGB colours as an eye sees them (D65)."""
    share = np.array(colours) / 255.0
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4) @ np.array(sight).T
    to_xyz = np.array(
        [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
    )
    xyz = np.clip(light, 0.0, 1.0) @ to_xyz.T / to_xyz.sum(axis=1)
    root = np.where(xyz > 216 / 24389, np.cbrt(xyz), (24389 / 27 * xyz + 16) / 116)
    x, y, z = root.T
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=1)


def test_colours_are_told_apart_by_every_eye() -> None:
    """2.3 is just noticeable side by side; thin lines apart from one another need several times that."""
    for sight in SIGHTS.values():
        for table, behind, beside in GROUNDS.values():
            seen = lab(table, sight)
            apart = np.linalg.norm(seen[:, None] - seen, axis=2) + 1e9 * np.eye(len(seen))
            first = [*range(14), 18, 19]
            assert apart[np.ix_(first, first)].min() > 18.0
            assert apart.min() > 13.0
            assert np.linalg.norm(seen - lab([behind], sight), axis=1).min() > 30.0
            others = np.linalg.norm(seen[: len(ESTIMATORS), None] - lab(beside, sight), axis=2)
            assert others.min() > 16.0


@pytest.mark.parametrize("table", [ON_DARK, ON_LIGHT])
def test_each_registered_method_has_a_colour_of_its_own_whatever_stands_beside_it(table) -> None:
    everyone = method_colours(list(ESTIMATORS), table)
    assert len(set(everyone.values())) == len(ESTIMATORS)
    for name, colour in everyone.items():
        assert method_colours(["mine", name], table)[name] == colour
    own = method_colours([*ESTIMATORS, "mine", "yours"], table)
    assert len(set(own.values())) == len(ESTIMATORS) + 2
    assert not {MUTED, TEXT} & set(own.values())


def test_more_methods_than_colours_take_colours_of_no_named_one() -> None:
    many = method_colours([*ESTIMATORS, *(f"mine {i}" for i in range(20))])
    assert len(many) == len(ESTIMATORS) + 20
    assert set(many.values()) == set(ON_DARK)
    assert not {many[name] for name in ESTIMATORS} & {many[f"mine {i}"] for i in range(20)}


def test_the_panel_writes_a_method_in_its_colour_wherever_it_stands() -> None:
    for method in ("joint_road", "negru2013"):
        told = (estimate(method, 100.0), estimate("mine", 90.0))
        for estimates in (told, told[::-1]):
            step = dataclasses.replace(make_step(), estimates=estimates)
            lines = FramePanel().draw(step, step_metrics(step))[156:200, 656:]
            assert (lines == method_colours([method])[method]).all(axis=-1).sum() > 20
