"""Actions are members of their space, in whatever type of numbers they come, or are refused by name."""

import math

import numpy as np
import pytest
from gymnasium import spaces

from fogsim.errors import InputError
from fogsim_envs.actions import checked_action

LEVELS = spaces.MultiDiscrete([13, 3])
SHARES = spaces.Box(-1.0, 1.0, (2,), np.float32)
CHOICE = spaces.Discrete(5, start=-1)


def test_members_are_taken_as_they_come() -> None:
    for space, action, expected in [
        (LEVELS, [12, 2], [12, 2]),
        (LEVELS, (0, 0), [0, 0]),
        (LEVELS, np.array([3.0, 1.0], dtype=np.float32), [3, 1]),
        (LEVELS, np.array([200, 1], dtype=np.uint8) - np.array([190, 0], dtype=np.uint8), [10, 1]),
        (SHARES, [-1, 1], [-1.0, 1.0]),
        (SHARES, np.array([0.5, -0.25]), [0.5, -0.25]),
        # The last bit of a float64 is no reason to refuse.
        (SHARES, [1.0 + 1e-12, 0.0], [1.0, 0.0]),
        (CHOICE, np.int64(3), 3),
        (CHOICE, -1, -1),
        (CHOICE, np.array(2.0), 2),
    ]:
        taken = checked_action(action, space, "x")
        assert taken.tolist() == expected
        assert (taken.dtype, taken.shape) == (space.dtype, space.shape)


def test_what_is_no_member_is_refused_by_name() -> None:
    for space, action, why in [
        (LEVELS, [-1, 0], r"expected \[0, 0\] to \[12, 2\]; got \[-1, 0\]"),
        (LEVELS, [13, 0], r"\[0, 0\] to \[12, 2\]"),
        (LEVELS, np.array([13, 0]), r"got array\(\[13,  0\]\)"),
        (LEVELS, np.array([256, 0], dtype=np.int16), r"\[0, 0\] to \[12, 2\]"),
        (LEVELS, [2.5, 0], "whole numbers"),
        (LEVELS, [math.nan, 0], "finite numbers"),
        (LEVELS, 3, r"the shape \(2,\), got \(\)"),
        (LEVELS, [1, 1, 1], r"the shape \(2,\), got \(3,\)"),
        (LEVELS, [[1, 1]], r"the shape \(2,\), got \(1, 2\)"),
        (LEVELS, "fast", "expected numbers; got 'fast'"),
        (LEVELS, None, "expected numbers; got None"),
        (LEVELS, [True, False], "expected numbers"),
        (LEVELS, [[1], [1, 2]], "expected numbers"),
        (SHARES, [1.001, 0.0], r"\[-1.0, -1.0\] to \[1.0, 1.0\]"),
        (SHARES, [math.inf, 0.0], "finite numbers"),
        (SHARES, [0.0, math.nan], "finite numbers"),
        (SHARES, 0.0, "the shape"),
        (CHOICE, 4, "expected -1 to 3; got 4"),
        (CHOICE, [3], r"the shape \(\), got \(1,\)"),
        (spaces.Text(3), "a", "has no check"),
    ]:
        with pytest.raises(InputError, match=rf"^action of x: .*{why}"):
            checked_action(action, space, "x")
