"""A colour for each method, told apart by eyes with and without colour blindness."""

from collections.abc import Sequence

from fogsim.estimators import ESTIMATORS
from fogsim.recorders.style import Colour

COLOURS: tuple[Colour, ...] = (
    (75, 150, 255),
    (240, 45, 0),
    (255, 225, 180),
    (150, 135, 180),
    (165, 240, 240),
    (150, 105, 75),
    (210, 255, 15),
    (195, 165, 105),
    (180, 195, 255),
    (90, 255, 120),
    (225, 0, 210),
    (165, 45, 255),
    (225, 0, 135),
    (255, 150, 180),
    (180, 195, 0),
    (0, 150, 30),
)
"""Colours as far apart as sixteen can be on a dark ground, the first ones farthest.

The least colour difference of any two (CIE 1976, ΔE of L*a*b*) is 19 for normal sight and for any of the three
dichromacies as Machado et al. 2009 simulate them; found by search over a grid of all colours of L* 48 … 94.
"""


def method_colours(methods: Sequence[str]) -> dict[str, Colour]:
    """Colour of each method: of a registered one always the same, whichever others stand beside it.

    Parameters
    ----------
    methods : sequence of str
        Names; those that no registry knows get the colours that are left.
    """
    registered = {name: COLOURS[i % len(COLOURS)] for i, name in enumerate(ESTIMATORS)}
    others = [name for name in methods if name not in registered]
    left = {name: COLOURS[-1 - i % len(COLOURS)] for i, name in enumerate(others)}
    return {name: registered.get(name) or left[name] for name in methods}
