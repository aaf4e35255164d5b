"""Joint fit of the own lane and of those neighbouring strips of road that agree with it."""

import math

from fogsim.vision.strips.joint_fit import JointFit, JointPrior, fit_jointly
from fogsim.vision.strips.strip_curves import StripCurves
from fogsim.vision.strips.strip_geometry import StripGeometry

DISAGREEMENT = 2.0
"""Standard deviations by which a neighbouring strip may change the extinction [-]."""

MODEL_DEVIATION = 0.01
"""Relative deviation of k by what the model leaves out: marks, rounding, a road that is not quite flat [-]."""

SURE = 0.03
"""Relative deviation of k up to which the own lane's answer judges its neighbours [-]: one that is less sure, as where
something stands in that lane, is itself more easily wrong than they."""

UNSURE = 1.0
"""How much farther than its deviation says such an answer may be off [-]."""


def fit_agreeing(curves: StripCurves, geometry: StripGeometry, prior: JointPrior) -> JointFit | None:
    """Fit the own lane, which is the first strip, with the neighbours that agree with it.

    A strip that holds a lane at one distance and a verge at another looks like fog of another density. Where the own
    lane alone says little, all strips count.

    Parameters
    ----------
    curves : StripCurves
        Luminance by bin.
    geometry : StripGeometry
        Where the bins are.
    prior : JointPrior
        Sky and horizon.

    Returns
    -------
    JointFit or None
        None if the own lane has too few bins.
    """
    own = fit_own(curves, geometry, prior)
    return None if own is None else with_neighbours(own, curves, geometry, prior)


def fit_own(curves: StripCurves, geometry: StripGeometry, prior: JointPrior) -> JointFit | None:
    """Fit the own lane alone.

    Parameters
    ----------
    curves, geometry, prior
        See `fit_agreeing`.

    Returns
    -------
    JointFit or None
        None if it has too few bins.
    """
    return _fitted(curves, geometry, prior, [0])


def with_neighbours(own: JointFit, curves: StripCurves, geometry: StripGeometry, prior: JointPrior) -> JointFit:
    """Fit the own lane again, with the neighbours that agree with it.

    Parameters
    ----------
    own : JointFit
        Fit of the own lane alone.
    curves, geometry, prior
        See `fit_agreeing`.
    """
    seen = [strip for strip in range(1, len(curves.variance)) if (curves.variance[strip] > 0).any()]
    best = _fitted(curves, geometry, prior, [0, *seen], own) if seen else None
    if best is None:
        return own
    if agree(own, best):
        return best
    if len(seen) == 1:
        return own
    found = [_fitted(curves, geometry, prior, [0, strip], own) for strip in seen]
    pairs = [pair for pair in found if pair is not None]
    # With an obstacle where there is none, or without the one that there is, a lane alone fits well and is far off.
    if own.hidden.any() and len(pairs) == len(seen) and all(_alike(pair, best) for pair in pairs):
        return best
    kept = [pair for pair in pairs if agree(own, pair)]
    return kept[0] if len(kept) == 1 else own


def agree(own: JointFit, more: JointFit) -> bool:
    """Whether more strips change the extinction by no more than they sharpen it (Hausman 1978, eq. 2.2).

    Parameters
    ----------
    own, more : JointFit
        Fit of the own lane, and of it with others.
    """
    sharpened = max(own.extinction_deviation**2 - more.extinction_deviation**2, 0.0)
    if own.extinction_deviation > SURE * own.extinction:
        sharpened = (UNSURE * own.extinction_deviation) ** 2
    return abs(more.extinction - own.extinction) <= DISAGREEMENT * math.hypot(
        math.sqrt(sharpened), MODEL_DEVIATION * own.extinction
    )


def _alike(first: JointFit, second: JointFit) -> bool:
    """Whether two answers differ by no more than their deviations."""
    apart = math.hypot(first.extinction_deviation, second.extinction_deviation)
    return abs(first.extinction - second.extinction) <= DISAGREEMENT * apart


def _fitted(
    curves: StripCurves, geometry: StripGeometry, prior: JointPrior, strips: list[int], near: JointFit | None = None
) -> JointFit | None:
    lanes = geometry.only(strips)
    read = StripCurves(curves.luminance[strips], curves.variance[strips], curves.scatter[strips])
    return fit_jointly(read, lanes, prior, near)
