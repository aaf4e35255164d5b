"""Traffic signs: faces as shapes, posts and gantries to hang them from."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.roadside import placed, tube
from fogsim.scene.signs.faces import back
from fogsim.scene.signs.gantry import Gantry, gantries, gantry_mesh
from fogsim.scene.signs.kinds import SIGN_KINDS, SignKind, face_of, shape_name
from fogsim.scene.solids import Material, merge
from fogsim.scene.terrain import Terrain
from fogsim.values.road import Sign
from fogsim.values.scene import FAR, TINY, Batch, Instance, Mesh

__all__ = ["SIGN", "SIGN_KINDS", "Gantry", "SignKind", "gantries", "gantry_mesh", "sign_batches", "sign_shapes"]

SIGN = Instance.SIGN
_BACK = Material((0.28, 0.285, 0.29))
_POST = "sign_post"


def sign_shapes(signs: Sequence[Sign]) -> dict[str, Mesh]:
    """Shapes of the faces of signs, of diameter 1, and of a post 1 m high; what is too small to see is blended."""
    shapes = {_POST: tube(0.0, 1.0, 0.038, 0.038, _BACK)} if signs else {}
    for name, sign in {shape_name(sign): sign for sign in signs}.items():
        face = face_of(sign)
        shapes[name] = merge((face.near(), back(face.outline, _BACK)))
        rear = back(face.coarse, _BACK)
        shapes |= {name + FAR: merge((face.far(), rear)), name + TINY: merge((face.tiny(), rear))}
    return shapes


def sign_batches(signs: Sequence[Sign], hanging: Sequence[Sign], terrain: Terrain) -> list[Batch]:
    """Every sign where the map says, and posts under those that do not hang from a gantry."""
    batches = [_face(sign) for sign in signs]
    held = {sign.sign_id for sign in hanging}
    standing = [sign for sign in signs if sign.sign_id not in held]
    return [*batches, _posts(standing, terrain)] if standing else batches


def _face(sign: Sign) -> Batch:
    # The face is drawn in its own plane: x to its reader's right, y up, z towards the reader.
    ahead = np.array([np.cos(sign.heading), np.sin(sign.heading), 0.0])
    transform = np.eye(4, dtype=np.float32)
    transform[:3, :3] = sign.diameter * np.column_stack(((ahead[1], -ahead[0], 0.0), (0, 0, 1), -ahead))
    transform[:3, 3] = sign.position
    return Batch(
        shape=shape_name(sign),
        transforms=transform[None],
        paint=np.zeros((1, 3), np.float32),
        lamps=np.zeros(1, np.int32),
        instance=np.full(1, Instance.SIGN, np.int32),
    )


def _posts(signs: Sequence[Sign], terrain: Terrain) -> Batch:
    heading = np.array([sign.heading for sign in signs])
    behind = np.array([0.05 * sign.diameter + 0.045 for sign in signs])
    places = np.array([sign.position for sign in signs])
    places[:, :2] += behind[:, None] * np.column_stack((np.cos(heading), np.sin(heading)))
    top = places[:, 2] + 0.35 * np.array([sign.diameter for sign in signs])
    places[:, 2] = np.minimum(terrain.height(places[:, :2]), places[:, 2]) - 0.3
    size: NDArray[np.float64] = np.column_stack((np.ones((len(signs), 2)), top - places[:, 2]))
    return placed(_POST, places, heading, size, instance=Instance.SIGN)
