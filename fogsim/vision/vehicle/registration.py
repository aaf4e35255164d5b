"""Registration of a picture of a vehicle in a farther one."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.core.linear_algebra import inverse_of, matrix_product
from fogsim.vision.light.medians import median, median_among
from fogsim.vision.vehicle.contrast_ratio import RearPicture, cell_centres, common_cell, resample
from fogsim.vision.vehicle.patch import (
    INDEPENDENT,
    Patch,
    PixelGrid,
    Placement,
    column_weights,
    downsample_to,
    match_cost,
    pixel_grid,
    shrunk_rows,
    vertex,
)

Floats = NDArray[np.float64]

_STEPS = 5
"""Gauss–Newton steps of a registration."""

_NUDGE, _RESIZE = 0.05, 0.01
"""Steps of the numerical derivatives by the position [px] and by the logarithm of the scale [-]."""

_OUTLIER = 4.0
"""Residual beyond which a pixel shows something that has changed (a lit lamp), in robust standard deviations [-]."""

_OWN_SHARE, _EDGE_SHARE = 0.25, 0.5
"""What a pixel's residual may be next to that: shares of its own contrast and of the change to its neighbours (half a
pixel of misplacement), so that small bright things that carry the contrast are not taken for changes [-]."""

_SATURATED = 250.0
"""Luminance that is clipped, or so near that noise is [linear grey levels]."""

_SURE = 7.0
"""Slope in its standard deviations from which a placement is believed [-]."""

OTHER = 0.2
"""Share of a far picture's variance that the near one does not explain beyond which its detail is another's [-]."""

_NOISE_SHARE = 0.3
"""Relative standard deviation of the assumed noise's power, which is taken out of slopes [-]."""

_LEAST_PIXELS = 24
"""Fewest pixels that a regression is made of."""

_ASIDE, _ABOVE, _BELOW = 0.25, 0.15, 0.4
"""Margin of the placed region beyond that part, or beyond the vehicle's sides [m]: its outline fixes the place."""


@dataclass(frozen=True, slots=True)
class PlacementPrior:
    """What is known of a placement before looking."""

    placement: Placement  # The expected one
    # column_deviation, row_deviation: standard deviations of column and row [px]
    column_deviation: float
    row_deviation: float
    scale_deviation: float  # Standard deviation of the scale, relative [-]


@dataclass(frozen=True, slots=True)
class Regression:
    """Far luminance as a line in near luminance, far = mean + slope · (near − near_mean)."""

    placement: Placement  # Where the near patch fits
    # slope, slope_deviation: ratio of the contrasts and its standard deviation by noise and by detail that only one of
    # them shows [-]; ``inf`` where the near pixels show no detail
    slope: float
    slope_deviation: float
    noise_deviation: float  # Its standard deviation by noise alone [-]
    # mean, near_mean: means of the far and of the near pixels [linear grey levels]
    mean: float
    near_mean: float
    residual: float  # Robust standard deviation of what is left [linear grey levels]
    variance: float  # Variance of the far pixels [linear grey levels²]
    pixels: int  # How many took part


def coarse_placement(near: Patch, far: Patch, prior: PlacementPrior) -> Placement | None:
    """Whole-pixel placement of greatest posterior: normalised correlation under the prior.

    Returns None if the far patch is too small.
    """
    grid = pixel_grid(near, far, prior.placement)
    if grid is None:
        return None
    template = downsample_to(near, grid, prior.placement)
    if far.luminance.shape[0] < template.shape[0] or far.luminance.shape[1] < template.shape[1]:
        return None
    if float(template.std()) < 1e-3:
        return None
    down = np.arange(far.luminance.shape[0] - template.shape[0] + 1) - grid.rows[0]
    across = np.arange(far.luminance.shape[1] - template.shape[1] + 1) - grid.cols[0]
    expected = 0.5 * (down[:, None] / prior.row_deviation) ** 2 + 0.5 * (across / prior.column_deviation) ** 2
    found = match_cost(far.luminance, template, expected)
    at = prior.placement
    return replace(at, column=at.column + float(across[found.col]), row=at.row + float(down[found.row]))


def register(
    near: Patch, far: Patch, prior: PlacementPrior, noise: float, most: float = math.inf, outline: float = 1.0
) -> Regression | None:
    """Place a near patch in a far one and regress the far pixels on it.

    Gauss–Newton on column, row and scale with slope and mean projected out; pixels that have changed (lit lamps) and
    saturated ones are left out. The noise of the near pixels is taken out of the slope. Where the detail does not stand
    out of the noise, the best of many placements would be that of the noise: then the expected one is taken.

    Returns None if too few pixels can be compared. Takes `noise` [linear grey levels].
    """
    whole = replace(near, half_width=outline * near.half_width, half_height=outline * near.half_height)
    at = coarse_placement(whole, far, prior)
    placed = None if at is None else _placed(whole, far, at, prior, noise)
    seen = None if placed is None else _regressed(whole, far, placed, noise)
    sure = seen is not None and _SURE * seen.noise_deviation < seen.slope <= most
    found = _regressed(near, far, seen.placement, noise) if seen is not None and sure else None
    return _regressed(near, far, prior.placement, noise) if found is None else found


def _placed(near: Patch, far: Patch, at: Placement, prior: PlacementPrior, noise: float) -> Placement | None:
    for _ in range(_STEPS):
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
    used = (far < _SATURATED) & (shown < _SATURATED)
    valid = used.copy()
    down, across = np.gradient(shown)
    change = np.abs(down) + np.abs(across)
    for _ in range(4):
        if int(used.sum()) < max(_LEAST_PIXELS, 0.4 * used.size):
            return None
        shown_used, far_used = shown[used], far[used]
        near_mean, mean = float(shown_used.mean()), float(far_used.mean())
        apart = shown_used - near_mean
        spread = float((apart**2).sum())
        if spread <= 1e-9:
            return None
        slope = float((apart * far_used).sum()) / spread
        residual = far - mean - slope * (shown - near_mean)
        scale = max(1.4826 * median(np.abs(residual[valid])), 0.2)
        own = abs(slope) * (_OWN_SHARE * np.abs(shown - near_mean) + _EDGE_SHARE * change)
        kept = valid & (np.abs(residual) <= _OUTLIER * scale + own)
        if bool((kept == used).all()):
            break
        used = kept
    return used, slope, near_mean, mean, scale


def _step(near: Patch, grid: PixelGrid, at: Placement, prior: PlacementPrior, noise: float) -> Floats | None:
    rows, cols = shrunk_rows(near, grid, at), column_weights(near, grid, at)
    shown = matrix_product(rows, cols.T)
    line = _line(shown, grid.far)
    if line is None:
        return None
    used, slope, near_mean, mean, scale = line
    residual = (grid.far - mean - slope * (shown - near_mean))[used]
    # From either side, so that a mirrored picture is placed alike; only what is moved is computed again.
    sides = (1.0, -1.0)
    right, left = (matrix_product(rows, column_weights(near, grid, _moved(at, s * _NUDGE, 0.0, 0.0)).T) for s in sides)
    below, above = (matrix_product(shrunk_rows(near, grid, _moved(at, 0.0, s * _NUDGE, 0.0)), cols.T) for s in sides)
    larger, smaller = (downsample_to(near, grid, _moved(at, 0.0, 0.0, s * _RESIZE)) for s in sides)
    change = (right - left, below - above, larger - smaller)
    jacobian = np.stack([slope * one[used] for one in change], axis=1) / (2.0 * np.array([_NUDGE, _NUDGE, _RESIZE]))
    # What slope and mean can take up is no displacement.
    jacobian -= jacobian.mean(axis=0)
    apart = shown[used] - shown[used].mean()
    jacobian -= apart[:, None] * matrix_product(apart, jacobian) / max(float(matrix_product(apart, apart)), 1e-12)
    expected = prior.placement
    deviation = np.array([prior.column_deviation, prior.row_deviation, prior.scale_deviation])
    offset = np.array([at.column - expected.column, at.row - expected.row, math.log(at.scale / expected.scale)])
    variance = noise**2 + INDEPENDENT * max(scale**2 - noise**2, 0.0)
    information = matrix_product(jacobian.T, jacobian) / variance + np.diag(deviation**-2)
    return np.asarray(
        matrix_product(inverse_of(information), matrix_product(jacobian.T, residual) / variance - offset / deviation**2)
    )


def _moved(at: Placement, right: float, down: float, larger: float) -> Placement:
    """A placement moved [px] and resized by a change of the scale's logarithm."""
    return Placement(at.column + right, at.row + down, at.scale * math.exp(larger))


def _regression(near: Patch, grid: PixelGrid, at: Placement, noise: float) -> Regression | None:
    shown = downsample_to(near, grid, at)
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
        changed += _NOISE_SHARE * own / (spread - own)
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


@dataclass(frozen=True, slots=True)
class RoadBehind:
    """What is known of the road behind a vehicle: the higher it is seen, the farther it is, and the faster it fades."""

    mount_height: float  # Height of the camera above the road [m]
    ratio: float  # Contrast of the vehicle that is expected, over that of the reference [-]

    def contrast_ratio(self, height: Floats) -> Floats:
        """Ratio of a level road's contrasts over that of the vehicle's: t^(h / (H − h)).

        A line of sight at height h over a vehicle's foot at range d ends on the road at d H / (H − h).

        Takes `height` (n,) [m].
        """
        eye = self.mount_height
        farther = np.where(height < 0.9 * eye, height / np.maximum(eye - height, 0.1 * eye), 9.0)
        return np.asarray(min(max(self.ratio, 1e-3), 1.0) ** farther)


def register_rear(
    reference: RearPicture, picture: RearPicture, aside: float, pitch: float, behind: RoadBehind
) -> tuple[RearPicture, float] | None:
    """Find the vehicle of a reference in a picture.

    Returns the picture with the place of greatest posterior, and the correlation there [-]; None if it is too small.
    Takes `aside`, `pitch` [m].
    """
    cell = common_cell(reference, picture)
    side = 0.5 * reference.width + _ASIDE
    low, high = reference.heights
    lateral, height = cell_centres(-side, side, cell, 5), cell_centres(low - _BELOW, high + _ABOVE, cell, 4)
    across, up = (max(math.ceil(2.5 * deviation / cell), 1) for deviation in (aside, pitch))
    template, _ = resample(reference, lateral, height, cell)
    beside = (np.abs(lateral) > 0.5 * reference.width) | (height[:, None] < 0.0)
    template = np.where(beside, template * behind.contrast_ratio(height)[:, None], template)
    template = _less_road_beside(template, lateral, 0.5 * reference.width)
    wide = cell * np.arange(-across, across + 1), cell * np.arange(-up, up + 1)
    lateral = np.concatenate([lateral[0] + wide[0][:across], lateral, lateral[-1] + wide[0][across + 1 :]])
    height = np.concatenate([height[0] + wide[1][:up], height, height[-1] + wide[1][up + 1 :]])
    seen, _ = resample(picture, lateral, height, cell)
    seen = _less_road_beside(seen, lateral, 0.5 * reference.width)
    if float(template.std()) < 1e-4:
        return None
    known = 0.5 * (wide[1][:, None] / pitch) ** 2 + 0.5 * (wide[0] / aside) ** 2
    found = match_cost(seen, template, known)
    right = (float(found.col) - across + vertex(found.cost[found.row], found.col)) * cell
    high = (float(found.row) - up + vertex(found.cost[:, found.col], found.row)) * cell
    return picture.displaced(right, high), float(found.correlation[found.row, found.col])


@kernel
def _less_road_beside(contrast: Floats, lateral: Floats, half: float) -> Floats:
    """Contrast less that of the road beyond half a width at the same height: near road fades into far road upwards."""
    outer, out = np.flatnonzero(np.abs(lateral) > half + 0.3 * _ASIDE), np.empty(contrast.shape)
    if outer.size == 0:
        outer = np.array([0, lateral.size - 1])
    for row in range(len(contrast)):
        out[row] = contrast[row] - median_among(contrast[row][outer])
    return out
