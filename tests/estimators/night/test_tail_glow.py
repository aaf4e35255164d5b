"""The table of glow about tail lamps."""

from importlib.resources import files

import numpy as np

from fogsim.calibration.tail_glows import tail_glow_table
from fogsim.estimators.night.tail_glow import ANGLES, DEPTHS, tail_glows


def test_the_shipped_table_is_what_the_formula_gives() -> None:
    made = tail_glow_table()
    with (files("fogsim.estimators.night") / "data" / "tail_glows.npz").open("rb") as file, np.load(file) as shipped:
        assert set(shipped.files) == set(made)
        for name, values in made.items():
            np.testing.assert_allclose(shipped[name], values, rtol=1e-5)


def test_glow_falls_off_with_the_angle_in_thin_fog() -> None:
    about = tail_glows().about(ANGLES, np.full(len(ANGLES), 1.0))
    assert about.shape[1:] == (len(DEPTHS), len(ANGLES))
    assert (np.diff(np.log(about[:, 0]), axis=-1) < 0.0).all()
