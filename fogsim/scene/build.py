"""The scene that stands still, from a network and its signs."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.scene.bodies import body_shapes
from fogsim.scene.chainage import Chainage
from fogsim.scene.edges import Edge, edge_meshes, guard_rail, lane_edge
from fogsim.scene.houses import house_places, house_shapes, houses, shapes_in_use
from fogsim.scene.junctions import Areas, area_mesh, free_borders, walkable
from fogsim.scene.lane_index import LaneIndex
from fogsim.scene.polyline import Points, cleaned, parallel, refined, true_spans
from fogsim.scene.road import FAST, LONGEST, footway_mesh, free_edges, lane_mesh, transverse_markings
from fogsim.scene.roadside import placed, post_shapes, stations, trees
from fogsim.scene.signs import gantries, gantry_mesh, sign_batches, sign_shapes
from fogsim.scene.solids import merge
from fogsim.scene.street_lamps import lamp_posts, street_lamp_shapes
from fogsim.scene.terrain import Terrain, plain_mesh
from fogsim.scene.trees import tree_shapes
from fogsim.values.road import Lane, LaneKind, RoadNetwork, SignMap
from fogsim.values.scene import Batch, Mesh, Scene

_RAIL_BEHIND_SHOULDER = 0.5  # [m]
_LOOK = 1.0  # whether a road lies across a footway is looked at every so many metres
_ASTRAY = 0.3  # how far footways may reach onto a road [m]
_STICKING_OUT = 0.4  # how far lanes may stick out of their junction [m]
_POST_SPACING = 4.0  # of guard rails [m]
_DELINEATOR_SPACING = 50.0  # [m]


def build_scene(network: RoadNetwork, signs: SignMap, rng: np.random.Generator, *, street_lamps: bool = False) -> Scene:
    """Build road, roadside and shapes of vehicles from any network of lanes.

    Parameters
    ----------
    network : RoadNetwork
        The lanes; lanes shorter than 0.05 m are left out.
    signs : SignMap
        The signs.
    rng : numpy Generator
        What scatters and shapes the trees.
    street_lamps : bool
        Whether lamps stand along the roads (see `street_lamp_heads`).

    Returns
    -------
    Scene
        Shapes have levels of detail for when they are small in the picture (see `LEVELS_OF_DETAIL`).

    Raises
    ------
    InputError
        If no lane has a length.
    """
    lanes = [lane for lane in network.lanes if len(lane.centreline) > 1 and len(cleaned(lane.centreline)) > 1]
    driven = [lane for lane in lanes if lane.kind in {LaneKind.CARRIAGEWAY, LaneKind.JUNCTION}]
    if not driven:
        raise InputError(f"a scene needs at least one lane with a length, got {len(network.lanes)} lanes without")
    index, terrain = LaneIndex(lanes), Terrain(lanes)
    areas = Areas(network.areas)
    # Lanes across a junction show only where its area does not reach; some stick out of it in bends.
    across = [lane for lane in lanes if lane.kind is LaneKind.JUNCTION and areas.cover(lane.centreline)]
    bulging = [lane for lane in across if not areas.cover(_sides(lane))]
    covered = {lane.lane_id for lane in across}
    lanes = [lane for lane in lanes if lane.lane_id not in covered]
    borders = _borders(network, lanes, index)
    pavement, posts = _pavement(network, [*lanes, *bulging], driven), list[Batch]()
    for lane, edge in borders:
        pavement += edge_meshes(edge, terrain, index)
        if lane is not None and lane.speed_limit >= FAST:
            rails, standing = _furniture(edge, index)
            pavement += rails
            posts += standing
    bridges = gantries(signs.signs, driven)
    hanging = [sign for gantry in bridges for sign in gantry.signs]
    land = terrain.mesh()
    parts = [plain_mesh(lanes, terrain.plain), *pavement, *(gantry_mesh(gantry, terrain) for gantry in bridges)]
    shapes = {**body_shapes(), **post_shapes(), **tree_shapes(rng), **sign_shapes(signs.signs)}
    edges = [edge for lane, edge in borders if lane is not None]
    if street_lamps:
        shapes |= street_lamp_shapes()
        posts += lamp_posts(edges, index)
    built = houses(edges, index, terrain, rng)
    shapes |= shapes_in_use(house_shapes(), built)
    growing = trees([(edge.side, edge.line) for edge in edges], index, house_places(built), shapes, terrain, rng)
    scenery = _joined([*posts, *sign_batches(signs.signs, hanging, terrain), *built, *growing])
    return Scene(ground=merge(parts if land is None else [*parts, land]), shapes=shapes, scenery=scenery)


def _sides(lane: Lane) -> Points:
    """Both sides of a lane but for what may well stick out of a junction, and for the ends, which lie on its border."""
    line, half = refined(cleaned(lane.centreline), 2.0), max(lane.width / 2 - _STICKING_OUT, 0.0)
    if len(line) < 3:
        return line
    return np.concatenate((parallel(line, half)[1:-1], parallel(line, -half)[1:-1]))


def _pavement(network: RoadNetwork, lanes: Sequence[Lane], driven: Sequence[Lane]) -> list[Mesh]:
    """Lanes, junctions, footways and what is painted across them."""
    seen = [lane for lane in lanes if lane.kind in {LaneKind.CARRIAGEWAY, LaneKind.JUNCTION}]
    chainage = Chainage(driven)
    footways = [lane for lane in lanes if lane.kind is LaneKind.FOOTWAY]
    paved = [area_mesh(area) for area in walkable(network.areas, driven)]
    return [
        *(lane_mesh(lane, chainage) for lane in seen),
        *(footway_mesh(line, (-half, half)) for line, half in _kept_off(footways, LaneIndex(driven))),
        *(area for area in paved if area is not None),
        *transverse_markings(lanes),
    ]


def _kept_off(footways: Sequence[Lane], driven: LaneIndex) -> Iterator[tuple[Points, float]]:
    """Spans of footways where no road lies across them, each with half its width [m]."""
    for lane in footways:
        line, half = refined(cleaned(lane.centreline), LONGEST), lane.width / 2
        least = min(half, 0.8) - _ASTRAY
        if np.any(driven.clearance(refined(line, _LOOK), same_level=2.5) < least):
            line = refined(line, _LOOK)
        for start, end in true_spans(driven.clearance(line, same_level=2.5) >= least, least=2):
            yield line[start:end], half


def _borders(network: RoadNetwork, lanes: Sequence[Lane], index: LaneIndex) -> list[tuple[Lane | None, Edge]]:
    """Free sides of lanes outside junctions, and those of junctions, which belong to no lane."""
    found: list[tuple[Lane | None, Edge]] = []
    limits = {_place(lane.centreline[-1]): lane.speed_limit for lane in lanes if lane.kind is LaneKind.CARRIAGEWAY}
    for lane in lanes:
        if lane.kind is LaneKind.CROSSING:
            continue
        if lane.kind is LaneKind.JUNCTION:
            # Its own limit is what its bend allows; what lies beside it is as beside the road that leads to it.
            lane = replace(lane, speed_limit=limits.get(_place(lane.centreline[0]), lane.speed_limit))  # noqa: PLW2901
        found += [(lane, lane_edge(lane, side, line, index)) for side, line in free_edges(lane, index)]
    leading = [lane for lane in lanes if lane.kind in {LaneKind.CARRIAGEWAY, LaneKind.FOOTWAY}]
    junctions = [area for area in network.areas if area.kind is LaneKind.JUNCTION]
    if junctions and leading:
        found += [(None, edge) for edge in free_borders(junctions, leading, index)]
    return found


def _place(point: NDArray[np.float64]) -> tuple[int, int]:
    column, row = np.round(point[:2] / 0.5).astype(int).tolist()
    return column, row


def _furniture(edge: Edge, index: LaneIndex) -> tuple[list[Mesh], list[Batch]]:
    """Guard rails, their posts and delineators along a free side, where they stand clear of other lanes."""
    side, distance = edge.side, edge.inner + edge.shoulder + _RAIL_BEHIND_SHOULDER
    free = index.clearance(parallel(edge.line, side * (distance + 0.2)), same_level=2.5) >= 0.4
    rails, batches = list[Mesh](), list[Batch]()
    for start, end in true_spans(free, least=2):
        line = edge.line[start:end]
        posts, heading = stations(line, _POST_SPACING, side * (distance + 0.15))
        delineators, direction = stations(line, _DELINEATOR_SPACING, side * (distance + 0.35))
        rails.append(guard_rail(line, side, distance))
        batches += [placed("rail_post", posts, heading), placed("delineator", delineators, direction)]
    return rails, batches


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
