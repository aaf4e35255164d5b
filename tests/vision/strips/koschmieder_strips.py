"""Curves of strips of road in fog, drawn by Koschmieder's law itself: no pixels, no rounding."""

import numpy as np

from fogsim.values import Camera
from fogsim.vision.strips.joint_fit import JointFit, Priors, fit_own, with_neighbours
from fogsim.vision.strips.joint_kernels import JointPrior
from fogsim.vision.strips.strip_curves import StripCurves
from fogsim.vision.strips.strip_geometry import StripGeometry, strip_geometry

CAMERA = Camera(640, 480, 577.0, (319.5, 239.5), 1.38, np.radians(2.0))
GEOMETRY = strip_geometry(CAMERA, 1.0)
AIRLIGHT = 200.0
PRIOR = JointPrior(AIRLIGHT, 1.0, 1.0, 0.0, 1.0, 0.0, 0.02)
NOISE = 0.2


def transmittance(extinction: float, geometry: StripGeometry = GEOMETRY, shift: float = 0.0) -> np.ndarray:
    """(strips, n): mean over the rows of each bin, by many steps."""
    steps = (np.arange(400) + 0.5) / 200.0 - 1.0
    rows = (geometry.below - shift + geometry.half * steps[:, None])[:, None, :]
    return np.where(rows > 0, np.exp(-extinction * geometry.path / np.maximum(rows, 1e-9)), 0.0).mean(axis=0)


def curves(
    extinction: float, seed: int = 0, road: float = 60.0, patches: float = 0.015, shift: float = 0.0
) -> StripCurves:
    """Strips whose patches are the process that the fit believes in, of 3 m."""
    rng = np.random.default_rng(seed)
    steps = np.diff(GEOMETRY.distance, prepend=GEOMETRY.distance[0])
    keep = np.exp(-np.abs(steps) / 3.0)
    albedo = np.empty(GEOMETRY.path.shape)
    value = rng.normal(0.0, patches, len(albedo))
    for i in range(keep.size):
        value = keep[i] * value + np.sqrt(1.0 - keep[i] ** 2) * rng.normal(0.0, patches, len(albedo))
        albedo[:, i] = 1.0 + value
    seen = AIRLIGHT + (road * albedo - AIRLIGHT) * transmittance(extinction, shift=shift)
    variance = np.full(seen.shape, NOISE**2)
    return StripCurves(seen + rng.normal(0.0, NOISE, seen.shape), variance, np.full(seen.shape, 2.0))


def fit_lanes(seen: StripCurves, geometry: StripGeometry, priors: Priors) -> JointFit:
    """Fit of the own lane, with the neighbours that agree with it."""
    own = fit_own(seen, geometry, priors)
    assert own is not None
    return with_neighbours(own, seen, geometry, priors)
