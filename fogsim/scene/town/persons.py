"""Persons on foot as batches of legs, trunks and heads, clothed by their ids."""

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.road import KERB
from fogsim.scene.roadside import placed
from fogsim.scene.solids import Material, Vector, grid_faces, merge, mesh
from fogsim.values.scene import FAR, MIDDLE, TINY, Batch, Instance, Mesh, Surface
from fogsim.values.traffic import PersonState


def rod(points: Sequence[Vector], radii: Sequence[tuple[float, float]], sides: int, material: Material) -> Mesh:
    """Closed tube of oval rings about some points, smooth around; rings are level, or upright along a level tube.

    Takes `points` (3,) [m], `radii` [m].
    """
    middle = np.array(points, np.float64)
    along = middle[-1] - middle[0]
    level = abs(along[2]) < np.hypot(along[0], along[1])
    first = np.array([0.0, 0.0, 1.0]) if level else np.array([1.0, 0.0, 0.0])
    second = np.array([-along[1], along[0], 0.0]) / max(np.hypot(along[0], along[1]), 1e-9) if level else np.eye(3)[1]
    angle = 2 * np.pi * np.arange(sides + 1) / sides
    around = np.cos(angle)[:, None, None] * first, np.sin(angle)[:, None, None] * second
    size = np.array(radii, np.float64)
    rings = np.swapaxes(middle + size[:, 0, None] * around[0] + size[:, 1, None] * around[1], 0, 1)
    # Normals of an oval are those of a circle over its radii.
    ovals = np.maximum(size, 1e-3)
    out = np.swapaxes(around[0] / ovals[:, 0, None] + around[1] / ovals[:, 1, None], 0, 1)
    tube = mesh(rings, grid_faces(len(middle), sides + 1), out, material)
    ends = [_cap(rings[end, :-1], direction * along, material) for end, direction in ((0, -1.0), (-1, 1.0))]
    return merge((tube, *ends))


def _cap(ring: NDArray[np.float64], normal: NDArray[np.float64], material: Material) -> Mesh:
    index = np.arange(1, len(ring) - 1)
    faces = np.stack((np.zeros_like(index), index, index + 1), axis=1)
    return mesh(ring, faces, np.broadcast_to(normal, ring.shape), material)


HEAD, _TRUNK, _LEGS = "person_head", "person_trunk", "person_legs"
"""Names of the shapes; those of trunks and legs are followed by ``_`` and the number of their pose."""

_POSES = 8
"""Poses of a stride."""

STANDING = _POSES
"""Number of the pose of who stands."""

_STRIDE = 0.82
"""Length of a stride of two steps over the height [-]."""

_HIP, _SHOULDER, _LEG, _ARM = 0.525, 0.81, 0.245, 0.165  # heights; lengths of half a leg and half an arm
_CLOTH, _SKIN = (Material((0.5, 0.5, 0.5), Surface.PAINT) for _ in range(2))
_HAIR, _SHOE = Material((0.035, 0.025, 0.018)), Material((0.025, 0.023, 0.022))
_HAND = Material((0.34, 0.21, 0.15))
_LEVELS = (("", 10), (MIDDLE, 6), (FAR, 4), (TINY, 3))


@cache
def _figure_shapes() -> Mapping[str, Mesh]:
    """All shapes with their levels of detail; PAINT is trousers, jacket or skin."""
    shapes = {HEAD + ending: _head(sides) for ending, sides in _LEVELS}
    for pose in range(_POSES + 1):
        swing = 0.0 if pose == STANDING else math.sin(2.0 * math.pi * pose / _POSES)
        lift = 0.0 if pose == STANDING else math.cos(2.0 * math.pi * pose / _POSES)
        for ending, sides in _LEVELS:
            shapes[f"{_LEGS}_{pose}{ending}"] = _legs(swing, lift, sides)
            shapes[f"{_TRUNK}_{pose}{ending}"] = _trunk(swing, sides)
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


_SLOWEST_STRIDE = 0.15
"""Speed up to which a person stands [m/s]."""

_JACKETS = np.array(
    [
        *((0.03, 0.03, 0.035), (0.05, 0.06, 0.09), (0.02, 0.03, 0.07), (0.12, 0.11, 0.10), (0.16, 0.03, 0.03)),
        *((0.05, 0.09, 0.05), (0.22, 0.20, 0.16), (0.30, 0.30, 0.30), (0.10, 0.06, 0.03), (0.05, 0.12, 0.20)),
        *((0.35, 0.24, 0.04), (0.08, 0.08, 0.085)),
    ]
)
_TROUSERS = np.array(
    [(0.025, 0.035, 0.07), (0.04, 0.055, 0.10), (0.02, 0.02, 0.022), (0.07, 0.065, 0.06), (0.14, 0.12, 0.09)]
)
_SKIN_TONES = np.array([(0.42, 0.27, 0.20), (0.36, 0.22, 0.15), (0.22, 0.12, 0.075), (0.09, 0.05, 0.035)])
"""Linear reflectances of clothes and skin, from which an id chooses."""


def person_shapes() -> dict[str, Mesh]:
    """Shapes of persons of 1 m height that look to +x, with their levels of detail."""
    return dict(_figure_shapes())


def person_batches(persons: PersonState) -> tuple[Batch, ...]:
    """Build one batch for each shape that is there."""
    if not persons.ids:
        return ()
    looks = np.array([_look(person) for person in persons.ids])
    pose = _poses(persons, looks[:, 2], looks[:, 12])
    # Who is in the same pose stands together, so that all are placed at once.
    order = np.argsort(pose, kind="stable")
    place, looks, pose = persons.position[order], looks[order], pose[order]
    place[:, 2] += KERB * persons.raised[order]
    everybody = placed(HEAD, place, persons.heading[order], looks[:, :3], instance=Instance.PERSON)
    jacket, trousers, skin = looks[:, 3:12].astype(np.float32).reshape(-1, 3, 3).transpose(1, 0, 2)
    ends = [0, *(np.flatnonzero(np.diff(pose)) + 1).tolist(), len(pose)]
    parts = [replace(everybody, paint=skin)]
    for own in map(slice, ends[:-1], ends[1:]):
        for shape, paint in ((_TRUNK, jacket), (_LEGS, trousers)):
            standing = everybody.transforms[own], paint[own], everybody.lamps[own], everybody.instance[own]
            parts.append(Batch(f"{shape}_{pose[own.start]}", *standing))
    return tuple(parts)


def _poses(persons: PersonState, height: NDArray[np.float64], chance: NDArray[np.float64]) -> NDArray[np.int64]:
    """Number of the pose of each: by the way gone along their heading, in which feet keep to the ground."""
    gone = persons.position[:, 0] * np.cos(persons.heading) + persons.position[:, 1] * np.sin(persons.heading)
    phase = np.floor((gone / (_STRIDE * height) + chance) * _POSES).astype(np.int64) % _POSES
    return np.where(persons.speed > _SLOWEST_STRIDE, phase, STANDING)


@lru_cache(maxsize=65536)
def _look(person: str) -> tuple[float, ...]:
    """Size along x, y and z [m], jacket, trousers, skin, and a number from 0 to 1, the same whenever asked."""
    draws = hashlib.blake2b(person.encode(), digest_size=8).digest()
    height = 1.56 + 0.30 * draws[0] / 255.0
    stout = height * (0.92 + 0.22 * draws[1] / 255.0)
    clothes = [
        table[draw % len(table)] for table, draw in zip((_JACKETS, _TROUSERS, _SKIN_TONES), draws[2:5], strict=False)
    ]
    return (stout, stout, height, *np.concatenate(clothes).tolist(), draws[6] / 256.0)
