"""Persons on foot as batches of legs, trunks and heads, clothed by their ids."""

import hashlib
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.road import KERB
from fogsim.scene.roadside import placed
from fogsim.scene.town.figures import HEAD, LEGS, POSES, STANDING, STRIDE, TRUNK, figure_shapes
from fogsim.values.scene import Batch, Instance, Mesh
from fogsim.values.traffic import PersonState

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
_SKIN = np.array([(0.42, 0.27, 0.20), (0.36, 0.22, 0.15), (0.22, 0.12, 0.075), (0.09, 0.05, 0.035)])
"""Linear reflectances of clothes and skin, from which an id chooses."""


def person_shapes() -> dict[str, Mesh]:
    """Shapes of persons of 1 m height that look to +x, with their levels of detail."""
    return dict(figure_shapes())


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
        for shape, paint in ((TRUNK, jacket), (LEGS, trousers)):
            standing = everybody.transforms[own], paint[own], everybody.lamps[own], everybody.instance[own]
            parts.append(Batch(f"{shape}_{pose[own.start]}", *standing))
    return tuple(parts)


def _poses(persons: PersonState, height: NDArray[np.float64], chance: NDArray[np.float64]) -> NDArray[np.int64]:
    """Number of the pose of each: by the way gone along their heading, in which feet keep to the ground."""
    gone = persons.position[:, 0] * np.cos(persons.heading) + persons.position[:, 1] * np.sin(persons.heading)
    phase = np.floor((gone / (STRIDE * height) + chance) * POSES).astype(np.int64) % POSES
    return np.where(persons.speed > _SLOWEST_STRIDE, phase, STANDING)


@lru_cache(maxsize=65536)
def _look(person: str) -> tuple[float, ...]:
    """Size along x, y and z [m], jacket, trousers, skin, and a number from 0 to 1, the same whenever asked."""
    draws = hashlib.blake2b(person.encode(), digest_size=8).digest()
    height = 1.56 + 0.30 * draws[0] / 255.0
    stout = height * (0.92 + 0.22 * draws[1] / 255.0)
    clothes = [table[draw % len(table)] for table, draw in zip((_JACKETS, _TROUSERS, _SKIN), draws[2:5], strict=False)]
    return (stout, stout, height, *np.concatenate(clothes).tolist(), draws[6] / 256.0)
