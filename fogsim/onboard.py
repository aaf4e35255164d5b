"""What rides in the ego: from a snapshot of the traffic to a finished step."""

import dataclasses
import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import Air, extinction, field_at, optical_depth_along
from fogsim.camera import averaged, middle_samples, mounted_pose, supersampled
from fogsim.errors import SimulationError
from fogsim.randomness import Streams
from fogsim.render import Renderer, make_renderer
from fogsim.scenario import Scenario, build
from fogsim.scene import build_scene, vehicle_batches
from fogsim.sensors import measure_lead, signs_ahead
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import (
    Camera,
    CameraPose,
    Command,
    Ending,
    FogField,
    Frame,
    Observation,
    RoadNetwork,
    SignMap,
    Step,
    TrafficSnapshot,
    TrafficState,
    Truth,
    View,
)

_SIGHT_LINE = np.geomspace(1.0, 20_000.0, 400)
"""Distances ahead at which the optical depth is looked up to find how far one sees [m]."""


@dataclasses.dataclass(frozen=True, slots=True)
class World:
    """What stands still for all runs of a scenario.

    Attributes
    ----------
    signs : SignMap
        The signs.
    fog : FogField
        The fog.
    air : Air
        The fog as a camera looks through it.
    renderer : Renderer
        Draws roads, roadside and signs, and the vehicles that it is given.
    """

    signs: SignMap
    fog: FogField
    air: Air
    renderer: Renderer


class OnBoard:
    """The ego's camera, sensors, estimators and belief, in the fog of a scenario.

    Parameters
    ----------
    scenario : Scenario
        The scenario; of its traffic, nothing is used.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._camera = build.camera(scenario)
        self._drawn_camera = supersampled(self._camera, scenario.camera.samples)
        self._photographer = build.photographer(scenario)
        self._body = build.body_pitch(scenario)
        self._lead_sensor = build.lead_sensor(scenario)
        self._told_camera = build.told_camera(scenario)
        self._estimators = build.estimators(scenario, self._told_camera)
        self._fusion = build.fusion(scenario)
        self._world: World | None = None
        self._streams: Streams | None = None

    def begin(self, streams: Streams, network: Callable[[], tuple[RoadNetwork, SignMap]]) -> World:
        """Forget earlier runs.

        Parameters
        ----------
        streams : Streams
            Random numbers of this run.
        network : callable
            Gives roads and signs; asked the first time only.

        Raises
        ------
        MissingDependencyError
            If no renderer works here.
        """
        if self._world is None:
            self._world = self._build_world(*network())
        for estimator in self._estimators:
            estimator.reset()
        self._fusion.reset()
        self._photographer.reset()
        self._body.reset()
        self._streams = streams
        return self._world

    def _build_world(self, network: RoadNetwork, signs: SignMap) -> World:
        scene = build_scene(network, signs, np.random.default_rng(self._scenario.scenery_seed))
        fog = build.fog_field(self._scenario, network.route)
        return World(
            signs=signs,
            fog=fog,
            air=Air(fog),
            renderer=make_renderer(self._scenario.renderer, scene, self._scenario.light.illuminance_lx),
        )

    def finish(
        self, index: int, time: float, snapshot: TrafficSnapshot, command: Command, ending: Ending | None
    ) -> Step:
        """See, measure, estimate and believe: everything between the traffic and the next decision.

        Parameters
        ----------
        index : int
            Number of the camera period.
        time : float
            Simulated time since the run began [s].
        snapshot : TrafficSnapshot
            The traffic now.
        command : Command
            What was in force until now.
        ending : Ending or None
            Why the run is over.

        Raises
        ------
        SimulationError
            If `begin` has not been called, or it is closed.
        """
        if self._world is None or self._streams is None:
            raise SimulationError("the run has not been started, or is closed")
        world, state, ego = self._world, snapshot.state, snapshot.ego
        pose = self._pose(state, ego)
        view, radiance = self._see(world, state, ego, pose, time)
        image = self._photographer.take(radiance, self._streams.camera)
        frame = Frame(time, image, self._told_camera)
        observation = self._observe(frame, snapshot, world.signs, self._streams)
        estimates = tuple(estimator.update(observation) for estimator in self._estimators)
        return Step(
            index=index,
            time=time,
            traffic=state,
            ego=ego,
            route_position=snapshot.route_position,
            speed_limit=snapshot.speed_limit,
            leader=snapshot.leader,
            collisions=snapshot.collisions,
            truth=fog_truth(field_at(world.fog, time), pose, self._camera, world.signs),
            view=view,
            observation=observation,
            estimates=estimates,
            belief=self._fusion.update(estimates, time),
            command=command,
            ending=ending,
        )

    def _pose(self, state: TrafficState, ego: int) -> CameraPose:
        grade = self._body.update(float(state.acceleration[ego]))
        heading, setback = float(state.heading[ego]), self._scenario.camera.setback_m
        return mounted_pose(self._camera, state.position[ego], heading, setback, grade)

    def _see(
        self, world: World, state: TrafficState, ego: int, pose: CameraPose, time: float
    ) -> tuple[View, NDArray[np.float32]]:
        """What is drawn without air, and the radiance that comes through the air."""
        camera, samples = self._drawn_camera, self._scenario.camera.samples
        view = world.renderer.render(vehicle_batches(state, ego), camera, pose)
        radiance = world.air.radiance(view, camera, pose, time=time)
        return middle_samples(view, samples), averaged(radiance, samples)

    def _observe(self, frame: Frame, snapshot: TrafficSnapshot, signs: SignMap, streams: Streams) -> Observation:
        state, ego = snapshot.state, snapshot.ego
        speed, reach = float(state.speed[ego]), self._scenario.sensors.sign_reach_m
        return Observation(
            frame=frame,
            speed=speed,
            lead=measure_lead(snapshot.leader, speed, self._lead_sensor, streams.sensors),
            signs=signs_ahead(signs, state.position[ego], float(state.heading[ego]), reach),
        )

    def close(self) -> None:
        """Free the renderer; closing twice is allowed."""
        if self._world is not None:
            self._world.renderer.close()
        self._world, self._streams = None, None


def fog_truth(fog: FogField, pose: CameraPose, camera: Camera, signs: SignMap) -> Truth:
    """The fog at a camera, and as far as it sees along its heading.

    Parameters
    ----------
    fog : FogField
        The fog now.
    pose : CameraPose
        Where the camera is.
    camera : Camera
        Its true calibration.
    signs : SignMap
        The signs that stand in the world.
    """
    eye = np.array(pose.position)
    direction = np.array([math.cos(pose.heading), math.sin(pose.heading), 0.0])
    depth = optical_depth_along(fog, eye, direction, _SIGHT_LINE)
    # Optical depth grows along the line, so the distance at which it reaches ln 20 is found by interpolation.
    reached = depth[-1] >= OPTICAL_DEPTH_AT_VISIBILITY
    sight = float(np.interp(OPTICAL_DEPTH_AT_VISIBILITY, depth, _SIGHT_LINE))
    return Truth(
        extinction=float(extinction(fog, eye)),
        extinction_ahead=OPTICAL_DEPTH_AT_VISIBILITY / sight if reached else 0.0,
        camera=camera,
        pose=pose,
        fog=fog,
        signs=signs,
    )
