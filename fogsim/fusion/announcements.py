"""Denser fog ahead: seen in one image, believed after several."""

from collections import deque
from collections.abc import Sequence

from fogsim.values.estimate import DenserFog, Estimate

FEWEST = 2
"""Fewest images that must report denser fog."""

MOST, LEAST = 0.7, 0.3
"""Shares of the last images that must report denser fog for it to be announced, and to stay so [-]."""

FASTEST = 70.0
"""Speed beyond which nothing ahead comes nearer [m/s]."""

NEARER, FARTHER = 0.35, 0.2
"""How much nearer than expected, and how much farther than before, a later image may report the same fog, in shares
of its distance [-]. What seems to be fog beyond a crest recedes."""


class Announcements:
    """Follows what estimates say of denser fog ahead.

    A bank stands, or comes nearer as one drives; what one picture takes for fog and the next does not, or elsewhere, is
    none: a vehicle, a crest, the shade of a wood.

    Parameters
    ----------
    time : float
        Window in which estimates must report it [s].

    Attributes
    ----------
    announced : bool
        Whether denser fog is announced.
    """

    def __init__(self, time: float) -> None:
        self._window = time
        self._reports: deque[tuple[float, DenserFog | None]] = deque()
        self.announced = False

    def reset(self) -> None:
        """Forget all reports."""
        self._reports.clear()
        self.announced = False

    def update(self, estimates: Sequence[Estimate], time: float) -> DenserFog | None:
        """Take in the estimates of one instant.

        Returns what most images, including most of the last ones, report, if it is to be announced. Takes `time` [s].
        """
        telling = [one for one in estimates if one.valid and one.optical_depths is not None]
        if telling:
            self._reports.append((time, next((one.denser for one in telling if one.denser is not None), None)))
        while self._reports and self._reports[0][0] < time - self._window - 1e-9:
            self._reports.popleft()
        denser_fogs = [(when, denser) for when, denser in self._reports if denser is not None]
        if not denser_fogs:
            self.announced = False
            return None
        likely = [
            (sum(_is_same(one, other) or _is_same(other, one) for one in denser_fogs), other) for other in denser_fogs
        ]
        agreeing, last = max(likely, key=lambda pair: (pair[0], pair[1][0]))
        share = agreeing / len(self._reports)
        enough = agreeing >= FEWEST and share >= (LEAST if self.announced else MOST)
        spans = self.announced or time - denser_fogs[0][0] >= 0.5 * self._window
        self.announced = bool(enough and spans)
        return last[1] if self.announced else None


def _is_same(earlier: tuple[float, DenserFog], later: tuple[float, DenserFog]) -> bool:
    """Whether the later one reports the same fog; the vehicle may have come nearer meanwhile."""
    way = later[0] - earlier[0]
    nearest = earlier[1].distance - FASTEST * way
    return way >= 0.0 and (1.0 - NEARER) * nearest <= later[1].distance <= (1.0 + FARTHER) * earlier[1].distance
