"""What the kernels of shading share: the picture's geometry, and the surfaces that are seen."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

Array = NDArray[np.float32]
Wide = NDArray[np.float64]
Numbers = NDArray[np.int32]
Index = NDArray[np.int64]

OBJECT, ROAD, TERRAIN, SKY = range(4)
"""Kinds of surfaces: colour that varies over a triangle, textured ground, and what is no triangle."""

# Columns of a surface. A plane is three numbers: times column, row and 1.
INSTANCE, LEAST, MOST = range(3)  # least and greatest 1/z [1/m]
DEPTH = 4  # plane of 1/z [1/m]
LIGHT = 7  # radiance per channel: planes of it over z, or numbers
RESPONSE = 16  # lamp response times distance in the same way
LOW, HIGH = 25, 28  # least and greatest radiance of its corners
RESPONSE_LOW, RESPONSE_HIGH = 31, 34
ALONG, ACROSS = 7, 10  # of roads: planes of the distance along and across the lane, over z
WHITE, HALF_WIDTH, LINES, COLOUR = 25, 26, 27, 28  # radiance of a white surface, half a lane, lines, reflectance
START = 31  # of roads: from where on the distance along the lane is counted [m]
COLUMNS = 40


class Light(NamedTuple):
    """Light and what shines."""

    white: float  # Radiance of a level white surface [cd/m²]
    # vertical, below: what reaches a vertical surface, and one that faces down, over what reaches a level one [-]
    vertical: float
    below: float
    zenith: Wide  # (3,): Radiance of the zenith [cd/m²]
    terrain: Wide  # (4,): Height of the terrain [m], infinite below if there is none, and its reflectance
    lamp_masks: Numbers  # (surfaces,) int32: Lamps any of which lights a surface, −1 if it is always lit
    lamp_radiance: Wide  # (surfaces, 3): Radiance that it then adds [cd/m²]


class Meshes(NamedTuple):
    """What shading reads of a `MeshTable`; see there."""

    positions: Array
    normals: Array
    reflectance: Array
    surface: Numbers
    instance: Numbers
    road: Array
    faces: Numbers
    first_face: Index


class Copies(NamedTuple):
    """A `Drawing` as plain numbers; records once as 32-bit floats and once as 32-bit integers."""

    mesh: Index
    record: Array
    integers: Numbers
    first: Index


class Spans(NamedTuple):
    """Neighbouring pixels of a row that see the same."""

    span: Numbers  # (n, 4) int32: Row, first column, last column and surface
    # (triangle_ids,) int32: Number of the surface of each triangle id, or −2 − its copy as long as it has none
    surface_of_triangle: Numbers
    # triangle_id, copy (n,) int32: of each surface, from number 2 on; number 0 is the sky and 1 the terrain
    triangle_id: Numbers
    copy: Numbers
    kind: Numbers  # (n,) int32: Kind of each
    surface: Wide  # What else there is to say of each


class Picture(NamedTuple):
    """The arrays of a `View`, those of three channels flat, so that compilers know that pixels are 3 numbers apart.

    The lamp response is empty if it is not wanted.
    """

    radiance: Array
    distance: Array
    instance: Numbers
    response: Array


ONE, TWO, THREE = np.uint64(1), np.uint64(2), np.uint64(3)


@kernel
def first_of(v: np.uint64, u: np.uint64, columns: np.uint64) -> np.uint64:
    """Index of a pixel's first channel in a picture of so many columns."""
    return THREE * (v * columns + u)
