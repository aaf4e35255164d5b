"""A scene that is built as far as the camera sees, and goes on being built as it drives on."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.render import FARTHEST
from fogsim.scene import ScenePlan, Squares, merge
from fogsim.values import Camera, CameraPose, Scene
from fogsim.values.pinhole import ray_from_pixel
from fogsim.values.scene import GROUND_SQUARE

FEW_LANES = 2000
"""Lanes up to which a scene is built whole: that takes less than a second."""

_AHEAD = 100.0  # how much farther than seen the ground is built [m], that it need not be built in each frame
_ASIDE = math.radians(6.0)  # and how much wider
_AROUND = 200.0  # all ground nearer than this is built [m]
_LEFT_BEHIND = 800.0  # ground so much farther off than what can be seen is forgotten [m]
_STEEPEST = math.radians(
    75.0
)  # a picture whose corners look more steeply, or as far aside, may show what is all around


class NearScene:
    """The part of a scene that a camera sees, or may soon see.

    Images equal those of the whole scene: built ground is always complete, and all other things are included at once.

    Parameters
    ----------
    plan : ScenePlan
        The scene.
    few_lanes : int
        Lanes up to which it is built whole.

    Attributes
    ----------
    scene : Scene
        What has been built.
    is_whole : bool
        Whether that is all.
    """

    def __init__(self, plan: ScenePlan, few_lanes: int = FEW_LANES) -> None:
        self._plan = plan
        self.is_whole = plan.lanes <= few_lanes
        self._squares = np.zeros((0, 2), np.int64)
        plain = plan.ground.mesh() if self.is_whole else plan.ground.plain
        self.scene = Scene(plain, plan.shapes, plan.scenery, plan.pavement)

    def whole(self) -> Scene:
        """Build all of the scene; pictures go on being drawn of the part."""
        return self.scene if self.is_whole else self._plan.scene()

    def reach(self, camera: Camera, pose: CameraPose) -> bool:
        """Build what a picture may show and is not there yet.

        Returns whether the scene has changed.
        """
        if self.is_whole:
            return False
        sector = _Sector(camera, pose)
        squares, away = self._around(sector)
        seen = squares[sector.touches(away, self._plan.ground.overhang)]
        if not len(_without(seen, self._squares)):
            return False
        wanted = squares[sector.touches(away, self._plan.ground.overhang, _AHEAD, _ASIDE) | (_length(away) < _AROUND)]
        off = (self._squares + 0.5) * GROUND_SQUARE - sector.eye
        kept = self._squares[_length(off) < sector.reach + _LEFT_BEHIND]
        missing = _without(wanted, kept)
        parts = [self._plan.ground.plain, self._plan.ground.mesh(Squares(missing))]
        if len(kept):
            parts.insert(1, Squares(kept).part_of(self.scene.ground))
        self._squares = np.concatenate((kept, missing))
        self.scene = Scene(merge(parts), self._plan.shapes, self._plan.scenery, self._plan.pavement)
        return True

    def _around(self, sector: "_Sector") -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Squares with ground about a camera, and their middles as seen from there [m]."""
        reach = sector.reach + self._plan.ground.overhang + _AHEAD
        bounds, beside = self._plan.ground.bounds, self._plan.ground.beside
        low = np.floor(np.maximum(sector.eye - reach, bounds[:2] - beside) / GROUND_SQUARE).astype(np.int64)
        high = np.floor(np.minimum(sector.eye + reach, bounds[2:] + beside) / GROUND_SQUARE).astype(np.int64)
        columns, rows = (np.arange(first, last + 1) for first, last in zip(low, high, strict=True))
        squares = np.stack(np.meshgrid(columns, rows, indexing="ij"), axis=-1).reshape(-1, 2)
        return squares, (squares + 0.5) * GROUND_SQUARE - sector.eye


class _Sector:
    """Part of the ground that a picture may show."""

    def __init__(self, camera: Camera, pose: CameraPose) -> None:
        ends = ((-0.5, camera.width - 0.5), (-0.5, camera.height - 0.5))
        corners = np.array([(u, v, 1.0) for u in ends[0] for v in ends[1]])
        rays = (corners[:, None, :] * ray_from_pixel(camera, pose)).sum(axis=2)
        self.eye = np.array(pose.position[:2])
        self.heading = pose.heading
        # Nothing is drawn beyond a depth, of which rays to the corners are the longest.
        self.reach = FARTHEST * float(np.sqrt((rays**2).sum(axis=1)).max())
        aside = np.abs(_turned(np.arctan2(rays[:, 1], rays[:, 0]) - self.heading)).max()
        steep = np.arctan2(np.abs(rays[:, 2]), np.hypot(rays[:, 0], rays[:, 1])).max()
        self._half = float(aside) if max(aside, steep) < _STEEPEST else math.pi

    def touches(
        self, away: NDArray[np.float64], overhang: float, ahead: float = 0.0, aside: float = 0.0
    ) -> NDArray[np.bool_]:
        """Which squares may show (`away` (n, 2) [m], `overhang` [m], `ahead`, `aside` [m], [rad])."""
        radius, distance = GROUND_SQUARE * math.sqrt(0.5) + overhang, _length(away)
        turned = np.abs(_turned(np.arctan2(away[:, 1], away[:, 0]) - self.heading))
        breadth = np.arcsin(np.minimum(radius / np.maximum(distance, radius), 1.0))
        beside = turned <= self._half + aside + breadth
        return np.asarray((distance <= radius) | (beside & (distance - radius <= self.reach + ahead)))


def _turned(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles between −π and π [rad]."""
    return np.asarray(np.remainder(angle + np.pi, 2.0 * np.pi) - np.pi)


def _length(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.hypot(vectors[:, 0], vectors[:, 1]))


def _without(squares: NDArray[np.int64], known: NDArray[np.int64]) -> NDArray[np.int64]:
    """Those squares that are not known."""
    base = np.int64(1) << 32
    return squares[~np.isin(squares[:, 0] * base + squares[:, 1], known[:, 0] * base + known[:, 1])]
