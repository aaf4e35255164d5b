import math

import pytest

from fogsim.camera import BodyPitch, Suspension

SUSPENSION = Suspension(pitch_per_deceleration=0.01, time_constant=0.2)


def test_braking_dips_the_nose_and_the_body_lags() -> None:
    """After a step of −5 m/s² the grade is −0.05 rad times 1 − e^(−t/τ)."""
    body = BodyPitch(SUSPENSION, period=0.1)
    assert body.update(0.0) == 0.0
    found = [body.update(-5.0) for _ in range(10)]
    assert found == pytest.approx([-0.05 * (1 - math.exp(-0.1 * n / 0.2)) for n in range(1, 11)])


def test_a_run_begins_settled_no_lag_follows_at_once_and_no_suspension_stays_level() -> None:
    body = BodyPitch(SUSPENSION, period=0.1)
    body.update(3.0)
    body.reset()
    assert body.update(-5.0) == pytest.approx(-0.05)
    stiff = BodyPitch(Suspension(0.01, 0.0), period=0.1)
    assert [stiff.update(a) for a in (0.0, -4.0, 2.0)] == pytest.approx([0.0, -0.04, 0.02])
    rigid = BodyPitch(Suspension(0.0, 0.2), period=0.1)
    assert [rigid.update(a) for a in (-8.0, 4.0)] == [0.0, 0.0]
