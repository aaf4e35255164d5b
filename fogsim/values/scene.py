"""The world as triangles and materials, without any graphics library."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum, StrEnum

import numpy as np
from numpy.typing import NDArray

MIDDLE, FAR, TINY, SPECK = LEVELS_OF_DETAIL = (":middle", ":far", ":tiny", ":speck")
"""Endings of the names of a shape's levels of detail for when it is small in the picture, the finest first."""


GROUND_SQUARE = 160.0
"""Side of the squares of the ground that are built and drawn as pieces [m]."""


class Instance(IntEnum):
    """Instance ids that renderers draw (see `View.instance`): the vehicle in row i has FIRST_VEHICLE + i."""

    SKY = 0
    TERRAIN = 1
    ROAD = 2
    ROADSIDE = 3
    SIGN = 4
    TRAFFIC_LIGHT = 5
    PERSON = 6
    FIRST_VEHICLE = 16


class Surface(IntEnum):
    """How a vertex's surface gets its radiance.

    MATT is lit by the sky; PAINT in the same way, with the vehicle's paint in place of its own colour; ROAD has asphalt
    grain and painted lines; TERRAIN has grass grain; lamps and the lenses of traffic lights add light of their own
    while lit, LAMP_STREET and the diodes of signs always; SHEETING is MATT by day and sends the light of head lamps
    back to where it came from.
    """

    MATT = 0
    PAINT = 1
    ROAD = 2
    TERRAIN = 3
    LAMP_POSITION_REAR = 4
    LAMP_STOP = 5
    LAMP_REAR_FOG = 6
    LAMP_INDICATOR_LEFT = 7
    LAMP_INDICATOR_RIGHT = 8
    LAMP_HEAD = 9
    SHEETING = 10
    LAMP_STREET = 11
    LENS_RED = 12
    LENS_YELLOW = 13
    LENS_GREEN = 14
    DIODES_WHITE = 15
    DIODES_RED = 16


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """Triangles; a mesh equals none but itself.

    Attributes
    ----------
    positions : (n, 3) float32
        Vertices [m].
    normals : (n, 3) float32
        Unit normals.
    reflectance : (n, 3) float32
        Linear diffuse reflectance, 0 … 1.
    surface : (n,) int32
        `Surface` of each vertex, the same for the three of a triangle.
    road : (n, 4) float32
        On a ROAD surface: distance along the lane [m], offset to the left of its middle [m], half its width [m], and
        its lines as 3 · left + right with 0 none, 1 solid, 2 dashed. Elsewhere unused (zero).
    instance : (n,) int32
        Instance id drawn for a mesh that stands still; unused for the shape of a batch.
    faces : (m, 3) uint32
        Vertices of each triangle.
    """

    positions: NDArray[np.float32]
    normals: NDArray[np.float32]
    reflectance: NDArray[np.float32]
    surface: NDArray[np.int32]
    road: NDArray[np.float32]
    instance: NDArray[np.int32]
    faces: NDArray[np.uint32]


@dataclass(frozen=True, slots=True)
class Batch:
    """Copies of one shape, each at its own place.

    Attributes
    ----------
    shape : str
        Name of the shape among the scene's shapes.
    transforms : (n, 4, 4) float32
        From the shape's coordinates to the world.
    paint : (n, 3) float32
        Linear reflectance of PAINT surfaces.
    lamps : (n,) int32
        Lit lamps, bits of `Lamp` and of `SignalLight`, and of `fogsim.values.light.dark_on`.
    instance : (n,) int32
        Instance id of each copy.
    """

    shape: str
    transforms: NDArray[np.float32]
    paint: NDArray[np.float32]
    lamps: NDArray[np.int32]
    instance: NDArray[np.int32]


class RoadSurface(StrEnum):
    """How roads reflect the sky's light by the angle at which they are seen (see `tools/make_road_reflectance.py`).

    LAMBERTIAN roads are as bright from everywhere; DRY ones are coarse asphalt, CIE's standard surface R2, 1.8 times
    as bright at 1° as from above; WORN ones are polished smooth, R4; WET ones have a film of water, W1.
    """

    LAMBERTIAN = "lambertian"
    DRY = "dry"
    WORN = "worn"
    WET = "wet"


@dataclass(frozen=True, slots=True)
class Pavement:
    """What roads are like.

    Attributes
    ----------
    surface : RoadSurface
        How they reflect.
    wheel_tracks : float
        How much darker they are where wheels roll, as a share; negative for brighter.
    repairs : float
        Standard deviation of the reflectance of stretches of older and newer asphalt, as a share.
    """

    surface: RoadSurface = RoadSurface.LAMBERTIAN
    wheel_tracks: float = 0.035
    repairs: float = 0.0


USUAL_PAVEMENT = Pavement()
"""What roads are like where nothing else is asked for."""


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything that stands still, and the shapes of what moves.

    Attributes
    ----------
    ground : Mesh
        Roads and signs and all that is near the ground and drawn once, merged.
    shapes : mapping from str to Mesh
        Shapes that batches refer to.
    scenery : tuple of Batch
        Copies that stand still (trees, posts).
    pavement : Pavement
        What roads are like.
    """

    ground: Mesh
    shapes: Mapping[str, Mesh]
    scenery: tuple[Batch, ...]
    pavement: Pavement = USUAL_PAVEMENT
