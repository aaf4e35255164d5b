"""The scene that stands still, from a network and its signs."""

import numpy as np

from fogsim.errors import InputError
from fogsim.scene.bodies import body_shapes
from fogsim.scene.chainage import Chainage
from fogsim.scene.polyline import LaneIndex, cleaned, parallel
from fogsim.scene.road import FAST, edge_meshes, free_edges, guard_rail, lane_mesh, shoulder_width, terrain
from fogsim.scene.roadside import placed, post_shapes, stations, trees
from fogsim.scene.signs import sign_mesh
from fogsim.scene.solids import merge
from fogsim.scene.trees import tree_shapes
from fogsim.values.road import Lane, RoadNetwork, SignMap
from fogsim.values.scene import Batch, Mesh, Scene

_RAIL_BEHIND_SHOULDER = 0.5  # [m]
_POST_SPACING = 4.0  # of guard rails [m]
_DELINEATOR_SPACING = 50.0  # [m]


def build_scene(network: RoadNetwork, signs: SignMap, rng: np.random.Generator) -> Scene:
    """Build road, roadside and shapes of vehicles from any network of lanes.

    Parameters
    ----------
    network : RoadNetwork
        The lanes; lanes shorter than 0.05 m are left out.
    signs : SignMap
        The signs.
    rng : numpy Generator
        What scatters and shapes the trees.

    Returns
    -------
    Scene
        Some shapes have a simple stand-in, named with the ending ":far", for when they are small in the picture.

    Raises
    ------
    InputError
        If no lane has a length.
    """
    lanes = [lane for lane in network.lanes if len(lane.centreline) > 1 and len(cleaned(lane.centreline)) > 1]
    if not lanes:
        raise InputError(f"a scene needs at least one lane with a length, got {len(network.lanes)} lanes without")
    ground = min(float(lane.centreline[:, 2].min()) for lane in lanes) - 0.1
    index, chainage = LaneIndex(lanes), Chainage(lanes)
    parts = [terrain(lanes, ground), *(lane_mesh(lane, chainage) for lane in lanes)]
    posts: list[Batch] = []
    stretches = []
    for lane in lanes:
        for side, line in free_edges(lane, index):
            stretches.append((side, line))
            parts += edge_meshes(lane, side, line, chainage, ground)
            if lane.speed_limit >= FAST:
                rails, standing = _furniture(lane, side, line, index)
                parts += rails
                posts += standing
    parts += [sign_mesh(sign, ground) for sign in signs.signs]
    shapes = {**body_shapes(), **post_shapes(), **tree_shapes(rng)}
    scenery = _joined([*posts, *trees(stretches, index, shapes, ground, rng)])
    return Scene(ground=merge(parts), shapes=shapes, scenery=scenery)


def _furniture(lane: Lane, side: int, line: np.ndarray, index: LaneIndex) -> tuple[list[Mesh], list[Batch]]:
    """Guard rail, its posts and delineators along a free side, where they stand clear of other lanes."""
    distance = lane.width / 2 + shoulder_width(lane, side) + _RAIL_BEHIND_SHOULDER
    if np.any(index.clearance(parallel(line, side * (distance + 0.2)), same_level=2.5) < 0.4):
        return [], []
    posts, heading = stations(line, _POST_SPACING, side * (distance + 0.15))
    delineators, direction = stations(line, _DELINEATOR_SPACING, side * (distance + 0.35))
    batches = [placed("rail_post", posts, heading), placed("delineator", delineators, direction)]
    return [guard_rail(line, side, distance)], batches


def _joined(batches: list[Batch]) -> tuple[Batch, ...]:
    """One batch a shape."""
    by_shape: dict[str, list[Batch]] = {}
    for batch in batches:
        by_shape.setdefault(batch.shape, []).append(batch)
    return tuple(
        Batch(
            shape=shape,
            transforms=np.concatenate([batch.transforms for batch in group]),
            paint=np.concatenate([batch.paint for batch in group]),
            lamps=np.concatenate([batch.lamps for batch in group]),
            instance=np.concatenate([batch.instance for batch in group]),
        )
        for shape, group in by_shape.items()
    )
