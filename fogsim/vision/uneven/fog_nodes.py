"""Nodes of the path ahead, and how ln k of fog that is not even varies over them before anything is seen."""

import functools
import math

import numpy as np

from fogsim.core.linear_algebra import inverse_of
from fogsim.vision.strips import joint_kernels
from fogsim.vision.uneven.uneven_kernels import FogNodes

NODES = (0.0, *(12.0 * 1.4**i for i in range(5)), *(60.0 * 1.2**i for i in range(14)))
"""Nodes of the path [m]: nearly two rows apart, in a camera of 800 px·m, where the road is far."""

MEAN, BROAD = math.log(0.01), 1.6
"""Mean and standard deviation of ln k of fog before anything is seen [ln 1/m]."""

_ROUGHNESS = 0.03
"""Standard deviation of ln k from node to node next to that [-]."""

UNEVENNESS = ((0.4, 300.0), (0.25, 100.0), (0.7, 30.0), (0.7, 100.0), (2.0, 80.0))
"""Standard deviations of ln k along the way [-], and their correlation lengths [m]: nearly even, patches, banks."""

BANK = 2.0
"""Standard deviation of the rise of ln k into a bank [-]."""


@functools.cache
def fog_nodes(deviation: float, length: float, count: int) -> FogNodes:
    """Nodes of fog of some unevenness (`length` [m])."""
    nodes = np.array(NODES[:count])
    # Where nodes are farther apart than patches are long, a node stands for their mean.
    size = np.maximum(np.diff(nodes, prepend=-NODES[1]) / length, 1e-3)
    share = np.sqrt(2.0 * (size - 1.0 + np.exp(-size))) / size
    apart = math.sqrt(3.0) / length * np.abs(nodes[:, None] - nodes)
    covariance = deviation**2 * (1.0 + apart) * np.exp(-apart) * share[:, None] * share + BROAD**2
    covariance += _ROUGHNESS**2 * np.eye(count)
    logarithm = joint_kernels.invert(covariance, np.empty_like(covariance))
    return FogNodes(nodes, MEAN, inverse_of(covariance), logarithm)


@functools.cache
def bank_nodes(first: int, count: int) -> FogNodes:
    """Nodes of fog that is even up to a bank, and even in it."""
    nodes = fog_nodes(*UNEVENNESS[0], count).nodes
    inside = (np.arange(count) >= first).astype(np.float64)
    covariance = BROAD**2 + BANK**2 * inside[:, None] * inside + _ROUGHNESS**2 * np.eye(count)
    logarithm = joint_kernels.invert(covariance, np.empty_like(covariance))
    return FogNodes(nodes, MEAN, inverse_of(covariance), logarithm)
