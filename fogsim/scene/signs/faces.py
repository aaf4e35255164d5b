"""Faces of signs in the plane z = 0, in units of a sign's diameter, x to the reader's right, y up, z towards them."""

import math
from dataclasses import dataclass, replace

import numpy as np

from fogsim.core.linear_algebra import matrix_product
from fogsim.scene.signs.symbols import BLACK, FIELD, RED, Corners, flat
from fogsim.scene.solids import Material, merge
from fogsim.values.scene import Instance, Mesh, Surface

_ROUND = 36  # corners of what is round
_CORE = 0.66  # size of the inner of two areas of a face that is very small in the picture
_LAYER = 0.013  # what is printed lies this far before what it is printed on, so that neither shows through


@dataclass(frozen=True, slots=True)
class Face:
    """A plate and what is printed on it."""

    outline: tuple[tuple[float, float], ...]  # (x, y): Convex outline of the plate, counterclockwise
    border: Material  # Its rim
    frame: Material  # What lies inside the rim
    field: Material  # What lies inside the frame, and what symbols are printed on
    widths: tuple[float, float]  # Sizes of frame and field in units of the outline's
    symbol: Mesh  # What is printed on the field

    @property
    def coarse(self) -> tuple[tuple[float, float], ...]:
        """Outline with a third of its corners, if it is round."""
        return self.outline[:: 3 if len(self.outline) == _ROUND else 1]

    def near(self) -> Mesh:
        """Triangles of the whole face."""
        frame, field = self.widths
        return _stacked(
            flat(self.outline, self.border),
            flat(_scaled(self.outline, frame), self.frame),
            flat(_scaled(self.outline, field), self.field),
            self.symbol,
        )

    def far(self) -> Mesh:
        """The face without its rim, which is too narrow to see."""
        field = flat(_scaled(self.coarse, self.widths[1]), self.field)
        return _stacked(flat(self.coarse, self.frame), field, self.symbol)

    def tiny(self) -> Mesh:
        """Two areas that have the mean colours of what is too small to see on them; diodes shine however small."""
        if np.any(self.symbol.surface >= int(Surface.DIODES_WHITE)):
            return self.far()
        field = _blended(flat(_scaled(self.coarse, self.widths[1]), self.field), self.symbol)
        core = flat(_scaled(self.coarse, _CORE), self.field)
        core = replace(core, reflectance=np.broadcast_to(field.reflectance[0], core.reflectance.shape).copy())
        frame = flat(self.coarse, self.frame)
        share = max(self.widths[1] ** 2 - _CORE**2, 0.0) / (1.0 - _CORE**2)
        mean = share * field.reflectance + (1.0 - share) * frame.reflectance[: len(field.reflectance)]
        return _stacked(replace(frame, reflectance=mean.astype(np.float32)), core)


def _scaled(corners: Corners, size: float) -> list[tuple[float, float]]:
    middle = np.mean(corners, axis=0)
    return [(float(x), float(y)) for x, y in middle + size * (np.asarray(corners) - middle)]


def _stacked(*layers: Mesh) -> Mesh:
    """Layers, each a little before the one that it is printed on."""
    lift = np.array([0.0, 0.0, _LAYER], np.float32)
    return merge([replace(layer, positions=layer.positions + n * lift) for n, layer in enumerate(layers)])


def _areas(part: Mesh) -> np.ndarray:
    a, b, c = (part.positions[part.faces[:, i], :2].astype(float) for i in range(3))
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    return np.asarray(0.5 * np.abs(ux * vy - uy * vx))


def _blended(field: Mesh, symbol: Mesh) -> Mesh:
    """Field with the mean reflectance of itself and of what is printed on it."""
    printed, whole = _areas(symbol), float(_areas(field).sum())
    ink = symbol.reflectance[symbol.faces[:, 0]]
    bare = max(whole - float(printed.sum()), 0.0)
    mean = (bare * field.reflectance[0] + matrix_product(printed, ink)) / (bare + float(printed.sum()))
    return replace(field, reflectance=np.broadcast_to(mean.astype(np.float32), field.reflectance.shape).copy())


def regular(sides: int, turn: float, radius: float = 0.5) -> tuple[tuple[float, float], ...]:
    """Corners of a regular polygon (`turn` [rad])."""
    angle = turn + 2 * math.pi * np.arange(sides) / sides
    return tuple(zip((radius * np.cos(angle)).tolist(), (radius * np.sin(angle)).tolist(), strict=True))


def triangle(direction: float) -> tuple[tuple[float, float], ...]:
    """Triangle with cut corners, 1 wide, its middle between tip and base."""
    height, cut = 0.5 * math.sqrt(3), 0.045
    tip, left, right = np.array([0.0, height / 2]), np.array([-0.5, -height / 2]), np.array([0.5, -height / 2])
    corners = []
    for corner, before, after in ((tip, right, left), (left, tip, right), (right, left, tip)):
        corners += [corner + cut * (before - corner), corner + cut * (after - corner)]
    points = [(float(x), float(y) * direction) for x, y in corners]
    return tuple(points if direction > 0 else points[::-1])


def disc_face(symbol: Mesh, *, frame: Material = RED, field: Material = FIELD, ring: float = 0.78) -> Face:
    """Round sign: white rim, coloured ring, field."""
    return Face(regular(_ROUND, 0.0), FIELD, frame, field, (0.965, ring), symbol)


def warning_face(symbol: Mesh) -> Face:
    """Triangle that warns, with its symbol a little below the middle of its height."""
    low = replace(symbol, positions=symbol.positions + np.array([0.0, -0.13, 0.0], np.float32))
    return Face(triangle(1.0), FIELD, RED, FIELD, (0.965, 0.72), low)


def plate_face(symbol: Mesh, *, field: Material = FIELD, border: Material = BLACK) -> Face:
    """Square plate with a thin border."""
    corners = ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))
    return Face(corners, border, border, field, (0.99, 0.92), symbol)


def back(outline: Corners, material: Material) -> Mesh:
    """The plate seen from behind (`outline` (x, y))."""
    mirror = flat(outline, material)
    return replace(
        mirror,
        positions=mirror.positions + np.array([0, 0, -0.05], np.float32),
        normals=-mirror.normals,
        faces=mirror.faces[:, ::-1].copy(),
        instance=np.full(len(mirror.positions), Instance.SIGN, np.int32),
    )
