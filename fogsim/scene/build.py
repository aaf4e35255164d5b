"""The scene that stands still, from a network and its signs."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fogsim.core.garbage import no_garbage_collection
from fogsim.errors import InputError
from fogsim.scene.edges import Edge, lane_edge
from fogsim.scene.ground import Border, GroundPlan, Rail
from fogsim.scene.junctions import Areas
from fogsim.scene.lane_index import LaneIndex
from fogsim.scene.light_sources import lamp_posts, street_lamp_shapes
from fogsim.scene.polyline import SHORTEST, parallel, true_spans
from fogsim.scene.road import FAST, free_edges
from fogsim.scene.roadside import placed, post_shapes, stations, trees
from fogsim.scene.signs import gantries, sign_batches, sign_shapes
from fogsim.scene.structures import building_places, structure_batches, structure_shapes
from fogsim.scene.terrain import Terrain
from fogsim.scene.town import person_shapes, signal_posts, signal_shapes
from fogsim.scene.trees import house_places, house_shapes, houses, shapes_in_use, tree_shapes
from fogsim.scene.vehicles import body_shapes, box_shapes
from fogsim.values.road import Lane, LaneKind, RoadNetwork, SignMap
from fogsim.values.scene import USUAL_PAVEMENT, Batch, Mesh, Pavement, Scene

_RAIL_BEHIND_SHOULDER = 0.5  # [m]
_POST_SPACING = 4.0  # of guard rails [m]
_DELINEATOR_SPACING = 50.0  # [m]


def build_scene(
    network: RoadNetwork,
    signs: SignMap,
    rng: np.random.Generator,
    *,
    street_lamps: bool = False,
    pavement: Pavement = USUAL_PAVEMENT,
) -> Scene:
    """Build road, roadside and shapes of vehicles from any network of lanes.

    Returns shapes have levels of detail for when they are small in the picture (see `LEVELS_OF_DETAIL`).
    """
    return ScenePlan(network, signs, rng, street_lamps=street_lamps, pavement=pavement).scene()


class ScenePlan:
    """What there is in a scene, and where: any part of its ground can be built of it, the same in any order.

    Parameters
    ----------
    network, signs, rng, street_lamps, pavement
        See `build_scene`.

    Attributes
    ----------
    ground : GroundPlan
        The ground.
    shapes, scenery, pavement
        See `Scene`.
    lanes : int
        Number of lanes.

    Raises
    ------
    InputError
        If no lane has a length.
    """

    @no_garbage_collection()
    def __init__(
        self,
        network: RoadNetwork,
        signs: SignMap,
        rng: np.random.Generator,
        *,
        street_lamps: bool = False,
        pavement: Pavement = USUAL_PAVEMENT,
    ) -> None:
        self.pavement = pavement
        lanes = _with_length([lane for lane in network.lanes if len(lane.centreline) > 1])
        if not lanes:
            raise InputError(f"a scene needs at least one lane with a length, got {len(network.lanes)} lanes without")
        driven = [lane for lane in lanes if lane.kind in {LaneKind.CARRIAGEWAY, LaneKind.JUNCTION}]
        index, terrain = LaneIndex(lanes), Terrain(lanes)
        # Lanes across a junction show only where its area does not reach.
        crossing = [lane for lane in lanes if lane.kind is LaneKind.JUNCTION]
        inside = Areas(network.areas).cover_all([lane.centreline for lane in crossing])
        across = [lane for lane, is_inside in zip(crossing, inside, strict=True) if is_inside]
        within = {lane.lane_id for lane in across}
        edges = _free_sides([lane for lane in lanes if lane.lane_id not in within], index)
        rails, posts = _furniture(edges, index)
        bridges = gantries(signs.signs, driven) if driven else []
        hanging = [sign for gantry in bridges for sign in gantry.signs]
        shapes = {**body_shapes(), **post_shapes(), **tree_shapes(rng), **sign_shapes(signs.signs)}
        shapes |= structure_shapes(network.structures)
        posts += signal_posts(network.signal_heads)
        if street_lamps:
            shapes |= street_lamp_shapes()
            posts += lamp_posts(edges, index)
        walls = building_places(network.structures)
        built = houses(edges, index, terrain, rng, walls)
        shapes |= shapes_in_use(house_shapes(), built)
        taken = np.concatenate([house_places(built), walls])
        growing = trees([(edge.side, edge.line) for edge in edges], index, taken, shapes, terrain, rng)
        beside = structure_batches(network.structures)
        self.lanes = len(lanes)
        # What moves or changes comes last: it leaves the numbers of all else as they are.
        self.shapes: Mapping[str, Mesh] = {**shapes, **signal_shapes(), **person_shapes(), **box_shapes()}
        self.scenery = _joined([*posts, *sign_batches(signs.signs, hanging, terrain), *built, *growing, *beside])
        borders = [Border(edge, along) for edge, along in zip(edges, rails, strict=True)]
        self.ground = GroundPlan(network.areas, lanes, across, borders, bridges, index, terrain)

    def scene(self) -> Scene:
        """Build the whole scene."""
        return Scene(ground=self.ground.mesh(), shapes=self.shapes, scenery=self.scenery, pavement=self.pavement)


def _with_length(lanes: Sequence[Lane]) -> list[Lane]:
    """Lanes that are more than one place (see `cleaned`)."""
    lines = [lane.centreline[:, :2] for lane in lanes]
    first = np.cumsum([0, *map(len, lines[:-1])])
    places = np.concatenate([np.zeros((0, 2)), *lines])
    off = places - np.repeat(places[first[: len(lines)]], [len(line) for line in lines], axis=0)
    farthest = np.maximum.reduceat(np.hypot(off[:, 0], off[:, 1]), first) if lines else np.zeros(0)
    return [lane for lane, length in zip(lanes, farthest.tolist(), strict=True) if length >= SHORTEST]


def _free_sides(lanes: Sequence[Lane], index: LaneIndex) -> list[Edge]:
    """Free sides of lanes, see `free_edges`."""
    limits = {_place(lane.centreline[-1]): lane.speed_limit for lane in lanes if lane.kind is LaneKind.CARRIAGEWAY}
    found = list[Edge]()
    for lane in lanes:
        if lane.kind is LaneKind.CROSSING:
            continue
        if lane.kind is LaneKind.JUNCTION:
            # Its own limit is what its bend allows; what lies next to it is as next to the road that leads to it.
            lane = replace(lane, speed_limit=limits.get(_place(lane.centreline[0]), lane.speed_limit))  # noqa: PLW2901
        found += [lane_edge(lane, side, line, index) for side, line in free_edges(lane, index)]
    return found


def _place(point: NDArray[np.float64]) -> tuple[int, int]:
    column, row = np.round(point[:2] / 0.5).astype(int).tolist()
    return column, row


def _furniture(edges: Sequence[Edge], index: LaneIndex) -> tuple[list[tuple[Rail, ...]], list[Batch]]:
    """Guard rails of each free side of fast roads, and their posts and delineators, clear of other lanes."""
    rails, batches = list[tuple[Rail, ...]](), list[Batch]()
    for edge in edges:
        along = list[Rail]()
        if edge.speed_limit >= FAST:
            side, distance = edge.side, edge.inner + edge.shoulder + _RAIL_BEHIND_SHOULDER
            free = index.clearance(parallel(edge.line, side * (distance + 0.2)), same_level=2.5, within=1.0) >= 0.4
            for start, end in true_spans(free, least=2):
                line = edge.line[start:end]
                posts, heading = stations(line, _POST_SPACING, side * (distance + 0.15))
                delineators, direction = stations(line, _DELINEATOR_SPACING, side * (distance + 0.35))
                along.append(Rail(line, side, distance))
                batches += [placed("rail_post", posts, heading), placed("delineator", delineators, direction)]
        rails.append(tuple(along))
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
