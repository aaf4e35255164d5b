"""Human figures of 1 m height: legs, trunks with arms, and heads, in the poses of a stride.

Proportions are those of an adult (hip at 0.53, shoulder at 0.82, chin at 0.87 of the height; Drillis and Contini 1966).
"""

import math
from collections.abc import Mapping
from functools import cache

from fogsim.scene.solids import Material, Vector, merge
from fogsim.scene.town.rods import rod
from fogsim.values.scene import FAR, MIDDLE, TINY, Mesh, Surface

HEAD, TRUNK, LEGS = "person_head", "person_trunk", "person_legs"
"""Names of the shapes; those of trunks and legs are followed by ``_`` and the number of their pose."""

POSES = 8
"""Poses of a stride."""

STANDING = POSES
"""Number of the pose of who stands."""

STRIDE = 0.82
"""Length of a stride of two steps over the height [-]."""

_HIP, _SHOULDER, _LEG, _ARM = 0.525, 0.81, 0.245, 0.165  # heights; lengths of half a leg and half an arm
_CLOTH, _SKIN = (Material((0.5, 0.5, 0.5), Surface.PAINT) for _ in range(2))
_HAIR, _SHOE = Material((0.035, 0.025, 0.018)), Material((0.025, 0.023, 0.022))
_HAND = Material((0.34, 0.21, 0.15))
_LEVELS = (("", 10), (MIDDLE, 6), (FAR, 4), (TINY, 3))


@cache
def figure_shapes() -> Mapping[str, Mesh]:
    """All shapes with their levels of detail; PAINT is trousers, jacket or skin."""
    shapes = {HEAD + ending: _head(sides) for ending, sides in _LEVELS}
    for pose in range(POSES + 1):
        swing = 0.0 if pose == STANDING else math.sin(2.0 * math.pi * pose / POSES)
        lift = 0.0 if pose == STANDING else math.cos(2.0 * math.pi * pose / POSES)
        for ending, sides in _LEVELS:
            shapes[f"{LEGS}_{pose}{ending}"] = _legs(swing, lift, sides)
            shapes[f"{TRUNK}_{pose}{ending}"] = _trunk(swing, sides)
    return shapes


def _head(sides: int) -> Mesh:
    face = rod(
        ((0.004, 0.0, 0.82), (0.004, 0.0, 0.868), (0.012, 0.0, 0.885), (0.008, 0.0, 0.93), (0.0, 0.0, 0.975)),
        ((0.030, 0.030), (0.030, 0.030), (0.046, 0.038), (0.054, 0.044), (0.036, 0.032)),
        sides,
        _SKIN,
    )
    hair = rod(
        ((-0.022, 0.0, 0.90), (-0.012, 0.0, 0.945), (-0.006, 0.0, 0.98), (-0.004, 0.0, 1.0)),
        ((0.040, 0.043), (0.052, 0.049), (0.046, 0.042), (0.016, 0.014)),
        sides,
        _HAIR,
    )
    return merge((face, hair))


def _trunk(swing: float, sides: int) -> Mesh:
    """Jacket and both arms; each arm swings with the opposite leg."""
    parts = [
        rod(
            (
                (0.0, 0.0, 0.47),
                (0.0, 0.0, 0.53),
                (0.0, 0.0, 0.63),
                (0.0, 0.0, 0.75),
                (-0.004, 0.0, 0.815),
                (0.0, 0.0, 0.845),
            ),
            ((0.066, 0.098), (0.068, 0.100), (0.062, 0.090), (0.070, 0.112), (0.055, 0.108), (0.030, 0.040)),
            sides,
            _CLOTH,
        )
    ]
    for side in (1.0, -1.0):
        turn = -0.42 * side * swing
        shoulder = (0.0, side * 0.118, _SHOULDER - 0.012)
        elbow = _below(shoulder, _ARM, turn - 0.06, side * 0.012)
        wrist = _below(elbow, _ARM * 0.9, turn + 0.22 + 0.25 * abs(swing), 0.0)
        hand = _below(wrist, 0.055, turn + 0.30, 0.0)
        sleeve = (shoulder, elbow, wrist), ((0.036, 0.034), (0.031, 0.029), (0.024, 0.022))
        parts += [rod(*sleeve, sides, _CLOTH), rod((wrist, hand), ((0.021, 0.014), (0.016, 0.011)), sides, _HAND)]
    return merge(parts)


def _legs(swing: float, lift: float, sides: int) -> Mesh:
    """Both legs: one strides ahead while the other stays behind; the knee bends as the foot comes forward."""
    parts = []
    for side in (1.0, -1.0):
        turn = 0.44 * side * swing
        bend = 0.10 + 0.75 * max(side * lift, 0.0) if lift or swing else 0.02
        hip = (0.0, side * 0.052, _HIP - 0.012 * abs(swing))
        knee = _below(hip, _LEG, turn + 0.3 * (bend - 0.1), 0.0)
        ankle = _below(knee, _LEG * 0.97, turn + 0.3 * (bend - 0.1) - bend, 0.0)
        leg = (hip, knee, ankle), ((0.060, 0.052), (0.043, 0.040), (0.031, 0.029))
        heel, toe = (ankle[0] - 0.03, ankle[1], ankle[2] - 0.012), (ankle[0] + 0.105, ankle[1], ankle[2] - 0.022)
        parts += [rod(*leg, sides, _CLOTH), rod((heel, toe), ((0.026, 0.026), (0.014, 0.024)), sides, _SHOE)]
    return merge(parts)


def _below(point: Vector, length: float, turn: float, aside: float) -> Vector:
    """The lower end of a limb that is turned forwards [rad]."""
    x, y, z = point
    return x + length * math.sin(turn), y + aside, z - length * math.cos(turn)
