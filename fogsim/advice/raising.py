"""Advice falls at once and rises only after it has been justified for a while, so that it does not flicker."""

from fogsim.values import SpeedAdvice


def hold_rises(target: float, time: float, previous: SpeedAdvice, hold: float) -> SpeedAdvice:
    """Advice that goes to a target speed, upwards only after a hold time.

    Parameters
    ----------
    target : float
        Speed that is justified now [m/s]; ``inf`` for no advice.
    time : float
        Instant [s].
    previous : SpeedAdvice
        The advice in force.
    hold : float
        Time for which a higher speed must have been justified without a break [s].
    """
    if target <= previous.speed:
        return SpeedAdvice(target)
    since = time if previous.raise_since is None else previous.raise_since
    return SpeedAdvice(target) if time - since >= hold else SpeedAdvice(previous.speed, raise_since=since)
