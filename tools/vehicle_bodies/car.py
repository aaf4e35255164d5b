"""Cars: hatchback, saloon, estate and sport utility vehicle, all bent out of one body."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.solids import GLASS, Material, box, grid, merge, quad
from fogsim.values.scene import Mesh
from vehicle_bodies.parts import (
    BACK,
    FOG_LAMP,
    HEAD_LAMP,
    LEFT_INDICATOR,
    LENS,
    PLATE,
    POSITION_LAMP,
    STOP_LAMP,
    UP,
    corner_panel,
    finished,
    hull,
    pair,
    panel_back,
    panel_front,
    side_panel,
    wheels,
)
from vehicle_bodies.solids import BLACK_PLASTIC, CHROME, PAINT, both_sides

# x, half width, lower edge, belt, half width at the belt, crown [m]
_BODY = np.array(
    [
        [0.00, 0.58, 0.30, 0.56, 0.52, 0.02],
        [0.05, 0.74, 0.22, 0.63, 0.66, 0.03],
        [0.22, 0.84, 0.18, 0.70, 0.74, 0.05],
        [0.65, 0.885, 0.17, 0.79, 0.79, 0.06],
        [1.20, 0.895, 0.17, 0.88, 0.83, 0.05],
        [3.20, 0.895, 0.17, 0.95, 0.84, 0.01],
        [3.95, 0.885, 0.19, 0.965, 0.82, 0.01],
        [4.27, 0.855, 0.24, 0.96, 0.78, 0.01],
        [4.43, 0.78, 0.28, 0.90, 0.70, 0.01],
        [4.49, 0.66, 0.33, 0.80, 0.60, 0.01],
    ]
)
_BASE = (0.0, 1.2, 3.95, 4.5)  # places along that body, and heights of it, that a form moves elsewhere
_HEIGHTS = (0.0, 0.17, 0.56, 0.72, 0.95)
_SKY = (0.095, 0.105, 0.115)
_SEAM = Material((0.02, 0.02, 0.02))

Profile = tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class CarForm:
    """What makes one kind of car out of the common body [m]."""

    # Where the common body's nose, foot of the windscreen, rear window and tail come to lie
    along: tuple[float, float, float, float]
    # Where its road, sill, bumper, lower edge of the rear lamps and belt come to lie
    heights: tuple[float, float, float, float, float]
    # Side view of the cabin: foot and top of the windscreen, middle of the roof, top and foot of the rear window
    roof: Profile
    # x of the ends of the side windows: front, pillar, rear, and end of a third window (0 without one)
    panes: tuple[float, float, float, float]
    axles: tuple[float, float]  # x of the axles
    radius: float  # of the wheels
    lean: float  # how much narrower the cabin becomes per metre of height
    lamps: tuple[float, float]  # height of the rear lamps' upper edge above the lower, and y of their inner edge

    @property
    def length(self) -> float:
        """Length [m]."""
        return self.along[-1]

    def side(self, z: float) -> float:
        """Half the width of the cabin at a height [m]: its sides lean inwards."""
        return 0.80 - self.lean * (z - self.heights[-1] + 0.03)

    def bent(self, part: Mesh) -> Mesh:
        """A part of the common body where this form has it; what is before or behind it stays as far from it."""
        x, y, z = part.positions.T.astype(np.float64)
        moved = np.interp(x, _BASE, self.along) + np.minimum(x, 0.0) + np.maximum(x - _BASE[-1], 0.0)
        lifted = np.interp(z, _HEIGHTS, self.heights) + np.maximum(z - _HEIGHTS[-1], 0.0)
        return replace(part, positions=np.stack((moved, y, lifted), axis=1).astype(np.float32))


HATCHBACK = CarForm(
    along=(0.0, 1.02, 3.62, 4.05),
    heights=(0.0, 0.17, 0.57, 0.76, 0.95),
    roof=((1.04, 0.88), (1.80, 1.41), (2.30, 1.47), (3.20, 1.45), (3.66, 1.38), (3.96, 0.95)),
    panes=(1.55, 2.42, 3.30, 0.0),
    axles=(0.80, 3.34),
    radius=0.31,
    lean=0.36,
    lamps=(0.24, 0.60),
)
SALOON = CarForm(
    along=(0.0, 1.32, 4.10, 4.75),
    heights=(0.0, 0.16, 0.56, 0.74, 0.96),
    roof=((1.34, 0.88), (2.16, 1.36), (2.65, 1.42), (3.20, 1.42), (3.55, 1.36), (4.18, 0.97)),
    panes=(1.86, 2.74, 3.52, 0.0),
    axles=(0.90, 3.72),
    radius=0.325,
    lean=0.46,
    lamps=(0.15, 0.42),
)
ESTATE = CarForm(
    along=(0.0, 1.30, 4.30, 4.70),
    heights=(0.0, 0.17, 0.56, 0.74, 0.96),
    roof=((1.32, 0.88), (2.12, 1.37), (2.70, 1.45), (3.70, 1.46), (4.26, 1.39), (4.58, 0.95)),
    panes=(1.83, 2.70, 3.46, 4.16),
    axles=(0.90, 3.68),
    radius=0.325,
    lean=0.38,
    lamps=(0.20, 0.52),
)
SUV = CarForm(
    along=(0.0, 1.22, 4.18, 4.55),
    heights=(0.0, 0.25, 0.68, 0.88, 1.12),
    roof=((1.24, 1.05), (1.90, 1.55), (2.45, 1.65), (3.55, 1.65), (4.08, 1.57), (4.42, 1.12)),
    panes=(1.66, 2.58, 3.36, 3.96),
    axles=(0.88, 3.58),
    radius=0.365,
    lean=0.30,
    lamps=(0.20, 0.50),
)


def car(form: CarForm) -> Mesh:
    """Shape of a car in a unit box."""
    half, mirror = 0.90, form.panes[0]
    belt = form.heights[-1]
    parts = [
        form.bent(merge((hull(_BODY), _front(), _sills()))),
        _cabin(form),
        _rear(form),
        wheels(form.axles, half, form.radius, 0.21),
        both_sides(box((mirror - 0.16, 0.72, belt + 0.0), (mirror - 0.02, 0.895, belt + 0.13), PAINT)),
    ]
    return finished(parts, form.length, half)


def car_size(form: CarForm) -> tuple[float, float, float]:
    """Length, width and height of a car [m]."""
    return form.length, 1.8, max(z for _, z in form.roof) + 0.035


def _cabin(form: CarForm) -> Mesh:
    base, *top, foot = form.roof
    roof = [[(x, s * form.side(z), z + 0.035 * (1 - s * s)) for s in (1.0, 0.4, -0.4, -1.0)] for x, z in top]
    outline = side_panel([(x, form.side(z), z) for x, z in form.roof], PAINT)
    screens = (_screen(form, base, top[0], -BACK), _screen(form, foot, top[-1], BACK))
    return merge((grid(roof, PAINT, UP), outline, *screens, *_windows(form)))


def _windows(form: CarForm) -> list[Mesh]:
    low, high = form.heights[-1] + 0.025, form.roof[2][1] - 0.065
    front, pillar, rear, third = form.panes
    slope = (form.roof[1][0] - form.roof[0][0]) / (form.roof[1][1] - form.roof[0][1])
    # The front edge runs along the windscreen's pillar, the last one along the rear window's.
    lean = slope * (high - low)
    end = max(rear, third)
    outlines = [[(front, low), (front + lean, high), (pillar - 0.04, high), (pillar - 0.04, low)]]
    outlines.append([(pillar + 0.04, low), (pillar + 0.04, high), (rear - (0.0 if third else 0.16), high), (rear, low)])
    if third:
        outlines.append([(rear + 0.07, low), (rear + 0.07, high), (end - 0.16, high), (end, low)])
    band = [(front + 0.5 * lean, low), (front + lean, high), (end - 0.2, high), (end - 0.02, low)]
    panes = [_window(form, outline, GLASS, 0.009) for outline in outlines]
    return [_window(form, band, _SEAM, 0.004), *panes]


def _window(form: CarForm, outline: list[tuple[float, float]], material: Material, outward: float) -> Mesh:
    return side_panel([(x, form.side(z) + outward, z) for x, z in outline], material)


def _screen(form: CarForm, base: tuple[float, float], top: tuple[float, float], toward: NDArray[np.float64]) -> Mesh:
    """Windscreen or rear window between two heights, in its painted frame; its upper part mirrors the sky."""

    def row(share: float, inset: float, out: float) -> list[tuple[float, float, float]]:
        x, z = base[0] + share * (top[0] - base[0]), base[1] + share * (top[1] - base[1])
        half = form.side(z) - inset
        return [(x + out * toward[0], half, z + 0.5 * out), (x + out * toward[0], -half, z + 0.5 * out)]

    frame = np.array([row(0.0, 0.0, 0.0), row(1.0, 0.0, 0.0)])
    pane = np.array([row(0.10, 0.055, 0.012), row(0.55, 0.055, 0.012), row(0.93, 0.055, 0.012)])
    shade = np.repeat([GLASS.reflectance, (0.05, 0.058, 0.066), _SKY], 2, axis=0)
    return merge((grid(frame, PAINT, toward + UP), grid(pane, GLASS, toward + UP, reflectance=shade)))


def _sills() -> Mesh:
    low = [(0.9, 0.897, 0.2), (3.5, 0.897, 0.2), (3.5, 0.899, 0.29), (0.9, 0.899, 0.29)]
    seams = [[(x, 0.899, 0.32), (x + 0.02, 0.899, 0.32), (x + 0.02, 0.87, 0.86), (x, 0.87, 0.86)] for x in (1.45, 2.42)]
    return merge([side_panel(low, BLACK_PLASTIC), *(side_panel(seam, _SEAM) for seam in seams)])


def _front() -> Mesh:
    lamp = corner_panel((0.015, 0.46), (0.13, 0.745), (0.57, 0.685), HEAD_LAMP)
    indicator = corner_panel((0.13, 0.745), (0.25, 0.862), (0.575, 0.68), LEFT_INDICATOR)
    fog = panel_front(0.015, (0.50, 0.62), (0.31, 0.38), LENS)
    grille = panel_front(-0.015, (-0.42, 0.42), (0.50, 0.62), BLACK_PLASTIC)
    intake = panel_front(-0.015, (-0.48, 0.48), (0.28, 0.37), BLACK_PLASTIC)
    plate = panel_front(-0.03, (-0.26, 0.26), (0.39, 0.50), PLATE)
    badge = panel_front(-0.03, (-0.05, 0.05), (0.55, 0.60), CHROME)
    return merge((pair(merge((lamp, indicator, fog))), grille, intake, plate, badge))


def _rear(form: CarForm) -> Mesh:
    """Lamps of the form's own between its tail and its flanks, and what every tail has."""
    length, low = form.length, form.heights[3]
    tall, within = form.lamps
    high, middle = low + tall, low + 0.45 * tall
    inner, outer, edge = (length + 0.005, within), (length - 0.05, 0.765), (length - 0.20, 0.865)
    split = (length - 0.012, 0.5 * (within + 0.765))
    lamps = (
        corner_panel(split, outer, (middle, high), STOP_LAMP),
        corner_panel(split, outer, (low, middle), POSITION_LAMP),
        corner_panel(outer, edge, (low, high), POSITION_LAMP),
        corner_panel(inner, split, (low, middle), LEFT_INDICATOR),
        corner_panel(inner, split, (middle, high), Material((0.5, 0.5, 0.5))),
    )
    common = (
        panel_back(4.505, (-0.64, 0.64), (0.33, 0.39), BLACK_PLASTIC),
        panel_back(4.505, (-0.60, 0.60), (0.515, 0.53), BLACK_PLASTIC),
        panel_back(4.525, (-0.26, 0.26), (0.60, 0.71), PLATE),
        pair(panel_back(4.52, (0.50, 0.64), (0.40, 0.47), FOG_LAMP)),
    )
    return merge((pair(merge(lamps)), form.bent(merge(common)), _high_stop(form)))


def _high_stop(form: CarForm) -> Mesh:
    """Third stop lamp at the top of the rear window, turned to those behind."""
    (top_x, top_z), (foot_x, foot_z) = form.roof[-2:]
    slope = (foot_x - top_x) / (top_z - foot_z)
    rows = [(top_x + slope * d + 0.03, top_z - d + 0.02) for d in (0.015, 0.05)]
    (x0, z0), (x1, z1) = rows
    return quad([(x0, 0.17, z0), (x0, -0.17, z0), (x1, -0.17, z1), (x1, 0.17, z1)], STOP_LAMP, BACK)
