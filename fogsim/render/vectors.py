"""Vectors of three numbers in kernels: tuples, which stay in registers where arrays would go through memory."""

import math
from typing import Any

from fogsim.core.jit import kernel

Vector = tuple[float, float, float]
"""Three numbers."""

Triple = tuple[Vector, Vector, Vector]
"""Three vectors: rows or columns of a matrix, or corners of a triangle."""


@kernel
def row(matrix: Any, number: int) -> Vector:
    """First three numbers of a row of an array."""
    return float(matrix[number, 0]), float(matrix[number, 1]), float(matrix[number, 2])


@kernel
def dot(a: Vector, b: Vector) -> float:
    """Inner product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel
def scaled(a: Vector, factor: float) -> Vector:
    """Vector times a number."""
    return a[0] * factor, a[1] * factor, a[2] * factor


@kernel
def unit(a: Vector) -> Vector:
    """Vector of length 1 in the same direction."""
    return scaled(a, 1.0 / math.sqrt(dot(a, a)))


@kernel
def rows_times(rows: Triple, a: Vector) -> Vector:
    """Matrix of rows times a vector."""
    return dot(rows[0], a), dot(rows[1], a), dot(rows[2], a)


@kernel
def columns_times(columns: Triple, a: Vector) -> Vector:
    """Matrix of columns times a vector."""
    x, y, z = a
    p, q, r = columns
    return p[0] * x + q[0] * y + r[0] * z, p[1] * x + q[1] * y + r[1] * z, p[2] * x + q[2] * y + r[2] * z


@kernel
def plus(a: Vector, b: Vector) -> Vector:
    """Sum."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]
