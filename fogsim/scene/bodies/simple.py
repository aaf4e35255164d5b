"""Bodies of few triangles for vehicles that are small in the picture."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.bodies.lamp_patches import lamp_quads
from fogsim.scene.bodies.parts import BACK, LEFT, PLATE, UP, finished, panel_back, panel_front
from fogsim.scene.solids import BLACK_PLASTIC, GLASS, PAINT, TYRE, UNDERBODY, Material, both_sides, merge, quad
from fogsim.values.scene import Mesh

Section = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Block:
    """Part of a body: a tube of four sides through sections.

    Attributes
    ----------
    sections : tuple of (x, half width, lower edge, upper edge)
        Sections from front to rear [m].
    material : Material
        Skin of its sides and top.
    front, rear : Material
        Of its ends.
    slopes : Material, optional
        Of the screens in the first and the last piece of its top; it has no ends then.
    panes : tuple of float, optional
        x at which glass in its sides begins and ends, and its lower and upper edge [m].
    """

    sections: tuple[Section, ...]
    material: Material = PAINT
    front: Material = PAINT
    rear: Material = PAINT
    slopes: Material | None = None
    panes: tuple[float, float, float, float] | None = None


@dataclass(frozen=True, slots=True)
class Simple:
    """What is left of a body's shape at a distance.

    Attributes
    ----------
    size : tuple of float
        Length, width and height [m].
    blocks : tuple of Block
        Its parts.
    axles : tuple of float
        x of the axles [m].
    radius : float
        Of the wheels [m].
    plate : float
        Height of the rear plate's middle [m].
    """

    size: tuple[float, float, float]
    blocks: tuple[Block, ...]
    axles: tuple[float, ...]
    radius: float
    plate: float


def far(form: Simple, near: Mesh) -> Mesh:
    """Stand-in of about eighty triangles, with the lamps of the shape in full."""
    length, width, _ = form.size
    parts = [_block(block) for block in form.blocks]
    parts += [_panes(block) for block in form.blocks if block.panes]
    parts += [_wheel(x, 0.5 * width, form.radius) for x in form.axles]
    parts.append(panel_back(length, (-0.26, 0.26), (form.plate - 0.06, form.plate + 0.06), PLATE))
    if form.axles:
        grille = (0.72 * form.plate, 0.92 * form.plate)
        parts.append(panel_front(0.01, (-0.24 * width, 0.24 * width), grille, BLACK_PLASTIC))
    return _with_lamps(form, [*parts, _under(form)], near)


def tiny(form: Simple, near: Mesh) -> Mesh:
    """Speck of a few dozen triangles, with the lamps of the shape in full."""
    return _with_lamps(form, [*(_block(_outermost(block)) for block in form.blocks), _under(form)], near)


def _under(form: Simple) -> Mesh:
    """Darkness between the wheels, seen from behind and from the front; none under a motorcycle."""
    length, width, _ = form.size
    if not form.axles:
        return merge(())
    y, high = 0.42 * width, 0.8 * form.radius
    parts = []
    for x, toward in ((0.04, -BACK), (length - 0.04, BACK)):
        parts.append(quad([(x, -y, 0.02), (x, y, 0.02), (x, y, high), (x, -y, high)], UNDERBODY, toward))
    return merge(parts)


def _outermost(block: Block) -> Block:
    """The block without the sections between its ends; a cabin keeps its screens."""
    sections = block.sections
    if len(sections) == 2 or block.slopes:
        return block
    _, half, low, _ = sections[len(sections) // 2]
    (front, *_, top_front), (rear, *_, top_rear) = sections[1], sections[-2]
    ends = ((min(front, sections[0][0] + 0.2), half, low, top_front), (max(rear, sections[-1][0]), half, low, top_rear))
    return replace(block, sections=ends)


def _with_lamps(form: Simple, parts: Sequence[Mesh], near: Mesh) -> Mesh:
    """Body in its unit box, with lamps just outside it."""
    length, width, _ = form.size
    return merge((finished(parts, length, 0.5 * width, fine=False), lamp_quads(near)))


def _block(block: Block) -> Mesh:
    x, half, low, top = np.array(block.sections).T
    corners = np.stack(
        [np.stack((x, side * half, z), axis=1) for side, z in ((1, low), (1, top), (-1, top), (-1, low))], axis=1
    )
    parts = []
    for first, toward in ((0, LEFT), (1, UP), (2, -LEFT)):
        for a, b in zip(corners[:-1, first : first + 2], corners[1:, first : first + 2], strict=True):
            parts.append(quad([a[0], a[1], b[1], b[0]], block.material, toward))
    if block.slopes:
        tops = corners[:, 1:3]
        screens = [_inset(tops[0], tops[1], -BACK), _inset(tops[-1], tops[-2], BACK)]
        return merge((*parts, *(quad(screen, block.slopes, toward) for screen, toward in screens)))
    ends = (quad(corners[0], block.front, -BACK + 0.5 * UP), quad(corners[-1], block.rear, BACK + 0.1 * UP))
    return merge((*parts, *ends))


def _inset(
    foot: NDArray[np.float64], top: NDArray[np.float64], outward: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Screen in the frame between two edges (2, 3), a little before it, and the direction that it faces."""
    low, high = foot + 0.08 * (top - foot), foot + 0.86 * (top - foot)
    screen = np.array([low[0], low[1], high[1], high[0]]) * (1.0, 0.88, 1.0) + 0.015 * outward + 0.01 * UP
    return screen, outward + 0.6 * UP


def _panes(block: Block) -> Mesh:
    if block.panes is None:
        return merge(())
    start, end, low, high = block.panes
    y = max(half for _, half, _, _ in block.sections) + 0.01
    corners = [(start, y, low), (end, y, low), (end, y, high), (start, y, high)]
    return both_sides(quad(corners, GLASS, LEFT))


def _wheel(x: float, outside: float, radius: float) -> Mesh:
    """Side and rear of a pair of wheels."""
    a, b = x - 0.8 * radius, x + 0.8 * radius
    high, inside = 1.75 * radius, outside - 0.22
    wall = quad([(a, outside, 0), (b, outside, 0), (b, outside, high), (a, outside, high)], TYRE, LEFT)
    rear = quad([(b, inside, 0), (b, outside, 0), (b, outside, high), (b, inside, high)], TYRE, BACK)
    return both_sides(merge((wall, rear)))
