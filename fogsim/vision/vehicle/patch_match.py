"""Registration of a near, sharp picture of a thing to a farther one, to a fraction of a pixel, and their regression."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.linear_algebra import inverse_of, matrix_product
from fogsim.vision.vehicle.match_kernels import correlations
from fogsim.vision.vehicle.patch import Patch, PixelGrid, Placement, pixel_grid, seen_as

Floats = NDArray[np.float64]

STEPS = 5
"""Gauss–Newton steps of a registration."""

NUDGE, RESIZE = 0.05, 0.01
"""Steps of the numerical derivatives by the position [px] and by the logarithm of the scale [-]."""

OUTLIER = 4.0
"""Residual beyond which a pixel shows something that has changed (a lit lamp), in robust standard deviations [-]."""

OWN_SHARE, EDGE_SHARE = 0.25, 0.5
"""What a pixel's residual may be beside that: shares of its own contrast and of the change to its neighbours (half a
pixel of misplacement), so that small bright things that carry the contrast are not taken for changes [-]."""

SATURATED = 250.0
"""Luminance that is clipped, or so near that noise is [linear grey levels]."""

SURE = 7.0
"""Slope in its standard deviations from which a placement is believed [-]."""

OTHER = 0.2
"""Share of a far picture's variance that the near one does not explain beyond which its detail is another's [-]."""

NOISE_SHARE = 0.3
"""Relative standard deviation of the told noise's power, which is taken out of slopes [-]."""

ALIKE = 8.0
"""Neighbouring pixels that differ alike where a thing has changed: so many count as one [-]."""

LEAST_PIXELS = 24
"""Fewest pixels that a regression is made of."""


@dataclass(frozen=True, slots=True)
class PlacementPrior:
    """What is known of a placement before looking.

    Attributes
    ----------
    placement : Placement
        The expected one.
    column_deviation, row_deviation : float
        Standard deviations of column and row [px].
    scale_deviation : float
        Standard deviation of the scale, relative [-].
    """

    placement: Placement
    column_deviation: float
    row_deviation: float
    scale_deviation: float


@dataclass(frozen=True, slots=True)
class Regression:
    """Far luminance as a line in near luminance, far = mean + slope · (near − near_mean).

    Attributes
    ----------
    placement : Placement
        Where the near patch fits.
    slope, slope_deviation : float
        Ratio of the contrasts and its standard deviation by noise and by detail that only one of them shows [-];
        ``inf`` where the near pixels show no detail.
    noise_deviation : float
        Its standard deviation by noise alone [-].
    mean, near_mean : float
        Means of the far and of the near pixels [linear grey levels].
    residual : float
        Robust standard deviation of what is left [linear grey levels].
    variance : float
        Variance of the far pixels [linear grey levels²].
    pixels : int
        How many took part.
    """

    placement: Placement
    slope: float
    slope_deviation: float
    noise_deviation: float
    mean: float
    near_mean: float
    residual: float
    variance: float
    pixels: int


def coarse_placement(near: Patch, far: Patch, prior: PlacementPrior) -> Placement | None:
    """Whole-pixel placement of greatest posterior: normalised correlation under the prior.

    Parameters
    ----------
    near, far : Patch
        The two pictures.
    prior : PlacementPrior
        Where the near patch is expected in the far one.

    Returns
    -------
    Placement or None
        None if the far patch is too small.
    """
    grid = pixel_grid(near, far, prior.placement)
    if grid is None:
        return None
    template = seen_as(near, grid, prior.placement)
    if far.luminance.shape[0] < template.shape[0] or far.luminance.shape[1] < template.shape[1]:
        return None
    if float(template.std()) < 1e-3:
        return None
    correlation = np.clip(correlations(np.ascontiguousarray(far.luminance), template), 0.0, 0.9999)
    down = np.arange(correlation.shape[0]) - grid.rows[0]
    across = np.arange(correlation.shape[1]) - grid.cols[0]
    expected = 0.5 * (down[:, None] / prior.row_deviation) ** 2 + 0.5 * (across / prior.column_deviation) ** 2
    cost = 0.5 * template.size / ALIKE * np.log1p(-(correlation**2)) + expected
    row, col = np.unravel_index(int(np.argmin(cost)), cost.shape)
    at = prior.placement
    return replace(at, column=at.column + float(across[col]), row=at.row + float(down[row]))


def register(
    near: Patch, far: Patch, prior: PlacementPrior, noise: float, most: float = math.inf, outline: float = 1.0
) -> Regression | None:
    """Place a near patch in a far one and regress the far pixels on it.

    Gauss–Newton on column, row and scale with slope and mean projected out; pixels that have changed (lit lamps) and
    saturated ones are left out. The noise of the near pixels is taken out of the slope. Where the detail does not
    stand out of the noise, the best of many placements would be that of the noise: then the expected one is taken.

    Parameters
    ----------
    near, far : Patch
        The two pictures; the near one is at least as large.
    prior : PlacementPrior
        Where the near one is expected in the far one.
    noise : float
        Standard deviation of single pixels [linear grey levels].
    most : float
        Largest slope that can be true [-]; a placement that gives more is one on something else.
    outline : float
        Size of what is placed over that of what is regressed [-]: the outline of a thing places it where its own
        detail is faint.

    Returns
    -------
    Regression or None
        None if too few pixels can be compared.
    """
    whole = replace(near, half_width=outline * near.half_width, half_height=outline * near.half_height)
    at = coarse_placement(whole, far, prior)
    placed = None if at is None else _placed(whole, far, at, prior, noise)
    seen = None if placed is None else _regressed(whole, far, placed, noise)
    sure = seen is not None and SURE * seen.noise_deviation < seen.slope <= most
    found = _regressed(near, far, seen.placement, noise) if seen is not None and sure else None
    return _regressed(near, far, prior.placement, noise) if found is None else found


def _placed(near: Patch, far: Patch, at: Placement, prior: PlacementPrior, noise: float) -> Placement | None:
    for _ in range(STEPS):
        grid = pixel_grid(near, far, at)
        step = None if grid is None else _step(near, grid, at, prior, noise)
        if step is None:
            return None
        shift = np.clip(step[:2], -1.0, 1.0)
        at = Placement(at.column + float(shift[0]), at.row + float(shift[1]), at.scale * math.exp(float(step[2])))
        if float(np.abs(step[:2]).max()) < 0.01:
            break
    return at


def _regressed(near: Patch, far: Patch, at: Placement, noise: float) -> Regression | None:
    grid = pixel_grid(near, far, at)
    return None if grid is None else _regression(near, grid, at, noise)


def _line(shown: Floats, far: Floats) -> tuple[NDArray[np.bool_], float, float, float, float] | None:
    """Pixels used, slope, means of near and far, and robust deviation of the residuals."""
    used = (far < SATURATED) & (shown < SATURATED)
    valid = used.copy()
    down, across = np.gradient(shown)
    change = np.abs(down) + np.abs(across)
    for _ in range(4):
        if int(used.sum()) < max(LEAST_PIXELS, 0.4 * used.size):
            return None
        near_mean, mean = float(shown[used].mean()), float(far[used].mean())
        spread = float(((shown[used] - near_mean) ** 2).sum())
        if spread <= 1e-9:
            return None
        slope = float(((shown[used] - near_mean) * far[used]).sum()) / spread
        residual = far - mean - slope * (shown - near_mean)
        scale = max(1.4826 * float(np.median(np.abs(residual[valid]))), 0.2)
        own = abs(slope) * (OWN_SHARE * np.abs(shown - near_mean) + EDGE_SHARE * change)
        kept = valid & (np.abs(residual) <= OUTLIER * scale + own)
        if bool((kept == used).all()):
            break
        used = kept
    return used, slope, near_mean, mean, scale


def _step(near: Patch, grid: PixelGrid, at: Placement, prior: PlacementPrior, noise: float) -> Floats | None:
    shown = seen_as(near, grid, at)
    line = _line(shown, grid.far)
    if line is None:
        return None
    used, slope, near_mean, mean, scale = line
    residual = (grid.far - mean - slope * (shown - near_mean))[used]
    # From either side, so that a mirrored picture is placed alike.
    moved = [
        (
            replace(at, column=at.column + sign * NUDGE),
            replace(at, row=at.row + sign * NUDGE),
            replace(at, scale=at.scale * math.exp(sign * RESIZE)),
        )
        for sign in (1.0, -1.0)
    ]
    change = [seen_as(near, grid, more) - seen_as(near, grid, less) for more, less in zip(*moved, strict=True)]
    jacobian = np.stack([slope * one[used] for one in change], axis=1) / (2.0 * np.array([NUDGE, NUDGE, RESIZE]))
    # What slope and mean can take up is no displacement.
    jacobian -= jacobian.mean(axis=0)
    apart = shown[used] - shown[used].mean()
    jacobian -= apart[:, None] * matrix_product(apart, jacobian) / max(float(matrix_product(apart, apart)), 1e-12)
    expected = prior.placement
    deviation = np.array([prior.column_deviation, prior.row_deviation, prior.scale_deviation])
    offset = np.array([at.column - expected.column, at.row - expected.row, math.log(at.scale / expected.scale)])
    variance = noise**2 + ALIKE * max(scale**2 - noise**2, 0.0)
    information = matrix_product(jacobian.T, jacobian) / variance + np.diag(deviation**-2)
    return np.asarray(
        matrix_product(inverse_of(information), matrix_product(jacobian.T, residual) / variance - offset / deviation**2)
    )


def _regression(near: Patch, grid: PixelGrid, at: Placement, noise: float) -> Regression | None:
    shown = seen_as(near, grid, at)
    line = _line(shown, grid.far)
    if line is None:
        return None
    used, slope, near_mean, mean, scale = line
    count = int(used.sum())
    spread = float(((shown[used] - near_mean) ** 2).sum())
    # Each shown pixel is the mean of 1/scale² near ones, and so is its noise, which flattens the line.
    own = count * noise**2 * min(at.scale, 1.0) ** 2
    variance = float(grid.far[used].var())
    by_noise, changed = math.inf, 1.0
    if spread > 2.0 * own:
        slope *= spread / (spread - own)
        by_noise = max(scale, noise) / math.sqrt(spread - own)
        power = slope**2 * (spread - own) / count
        changed = max(variance - power - noise**2, 0.0) / max(power, 1e-9) + 1.0 - count / used.size
        changed += NOISE_SHARE * own / (spread - own)
    return Regression(
        placement=at,
        slope=slope,
        slope_deviation=math.hypot(by_noise, changed * abs(slope)) if changed < OTHER else math.inf,
        noise_deviation=by_noise,
        mean=mean,
        near_mean=near_mean,
        residual=scale,
        variance=variance,
        pixels=count,
    )
