"""The closed loop: traffic → scene → render → atmosphere → camera → estimators → fusion → advice → traffic."""

import dataclasses
import math
from collections.abc import Iterator
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import extinction, fogged_radiance, optical_depth
from fogsim.camera import expose, mounted_pose
from fogsim.errors import SimulationError
from fogsim.pinhole import ray_from_pixel
from fogsim.randomness import Streams, spawn_streams
from fogsim.render import Renderer, make_renderer
from fogsim.scenario import Scenario, build
from fogsim.scene import build_scene, vehicle_batches
from fogsim.sensors import measure_lead, signs_ahead
from fogsim.traffic import libsumo_traffic
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import (
    CameraPose,
    Command,
    Ending,
    FogField,
    Frame,
    Observation,
    SignMap,
    Step,
    TrafficSnapshot,
    Truth,
    View,
)

_SIGHT_LINE = np.geomspace(1.0, 20_000.0, 400)
"""Distances ahead at which the optical depth is looked up to find how far one sees [m]."""


def run(scenario: Scenario, seed: int = 0) -> Iterator[Step]:
    """Run a scenario with its own advice and lighting policy.

    Parameters
    ----------
    scenario : Scenario
        From `load_scenario`.
    seed : int
        The same seed gives the same run, bit for bit.

    Yields
    ------
    Step
        One a camera period; the last has its `ending` set.

    Raises
    ------
    FogSimError
        If a part of the loop cannot start; see `ClosedLoop.start`.
    """
    policy = AdvisedDriving(scenario)
    with ClosedLoop(scenario) as loop:
        step = loop.start(seed)
        yield step
        while step.ending is None:
            step = loop.advance(policy.decide(step))
            yield step


class AdvisedDriving:
    """The scenario's own policy: its adviser and its lighting rules, asked once a decision period.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._adviser = build.adviser(scenario)
        self._lighting = build.lighting_policy(scenario)
        self._frames = build.periods(scenario).decision_frames

    def decide(self, step: Step) -> Command:
        """Command for the next camera period; the one in force between decisions."""
        if step.index % self._frames:
            return step.command
        previous = step.command
        return Command(
            advice=self._adviser.advise(step.belief, step.speed_limit, step.time, previous.advice),
            lamps=self._lighting.lamps(step.belief, previous.lamps),
        )


@dataclasses.dataclass(frozen=True, slots=True)
class _World:
    """What stands still for all runs of a scenario."""

    signs: SignMap
    fog: FogField
    renderer: Renderer


class ClosedLoop:
    """One ego vehicle in one simulation, from command to finished step.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._periods = build.periods(scenario)
        self._camera = build.camera(scenario)
        self._sensor = build.sensor(scenario)
        self._lead_sensor = build.lead_sensor(scenario)
        self._told_camera = build.told_camera(scenario)
        self._estimators = build.estimators(scenario, self._told_camera)
        self._fusion = build.fusion(scenario)
        self._traffic = libsumo_traffic(build.traffic_setup(scenario))
        self._world: _World | None = None
        self._streams = spawn_streams(0)
        self._step: Step | None = None

    def start(self, seed: int) -> Step:
        """Begin a run, or begin anew.

        Parameters
        ----------
        seed : int
            Seed of every random number of the run.

        Raises
        ------
        SimulationError
            If SUMO cannot start, runs already in this process, or the ego does not appear.
        MissingDependencyError
            If no renderer works here.
        """
        self._streams = spawn_streams(seed)
        self._traffic.start(self._streams.traffic_seed)
        if self._world is None:
            self._world = self._build_world()
        for estimator in self._estimators:
            estimator.reset()
        self._fusion.reset()
        self._step = None
        snapshot = self._traffic.observe()
        if snapshot is None:
            raise SimulationError("the ego left the road as soon as it had appeared")
        self._step = self._finish(snapshot, self._world, Command())
        return self._step

    def _build_world(self) -> _World:
        network, signs = self._traffic.network()
        scene = build_scene(network, signs, np.random.default_rng(self._scenario.scenery_seed))
        return _World(
            signs=signs,
            fog=build.fog_field(self._scenario, network.route),
            renderer=make_renderer(self._scenario.renderer, scene, self._scenario.light.illuminance_lx),
        )

    def advance(self, command: Command) -> Step:
        """Move by one camera period with a command in force.

        Parameters
        ----------
        command : Command
            Advice and lamps.

        Returns
        -------
        Step
            The finished instant. If the ego left the network on the way, what was last seen of it, with its ending.

        Raises
        ------
        SimulationError
            If the run has not been started or is over.
        """
        if self._step is None or self._world is None or self._step.ending is not None:
            raise SimulationError("the run has not been started or is over: call start() before advance()")
        for _ in range(self._periods.traffic_steps):
            self._traffic.advance(command)
        snapshot = self._traffic.observe()
        if snapshot is None:
            index = self._step.index + 1
            time = index * self._periods.camera_period
            self._step = dataclasses.replace(self._step, index=index, time=time, ending=Ending.LEFT_NETWORK)
        else:
            self._step = self._finish(snapshot, self._world, command)
        return self._step

    def _finish(self, snapshot: TrafficSnapshot, world: _World, command: Command) -> Step:
        """See, measure, estimate and believe: everything between the traffic and the next decision."""
        index = 0 if self._step is None else self._step.index + 1
        time = index * self._periods.camera_period
        state, ego = snapshot.state, snapshot.ego
        pose = mounted_pose(
            self._camera, state.position[ego], float(state.heading[ego]), self._scenario.camera.setback_m
        )
        view = world.renderer.render(vehicle_batches(state, ego), self._camera, pose)
        frame = Frame(time, self._photograph(view, world.fog, pose, self._streams), self._told_camera)
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
            truth=fog_truth(world.fog, pose),
            view=view,
            observation=observation,
            estimates=estimates,
            belief=self._fusion.update(estimates, time),
            command=command,
            ending=self._ending(index, snapshot),
        )

    def _photograph(self, view: View, fog: FogField, pose: CameraPose, streams: Streams) -> NDArray[np.uint8]:
        radiance = fogged_radiance(view, fog, pose.position, ray_from_pixel(self._camera, pose))
        return expose(radiance, self._sensor, self._camera.response, streams.camera)

    def _observe(self, frame: Frame, snapshot: TrafficSnapshot, signs: SignMap, streams: Streams) -> Observation:
        state, ego = snapshot.state, snapshot.ego
        speed, reach = float(state.speed[ego]), self._scenario.sensors.sign_reach_m
        return Observation(
            frame=frame,
            speed=speed,
            lead=measure_lead(snapshot.leader, speed, self._lead_sensor, streams.sensors),
            signs=signs_ahead(signs, state.position[ego], float(state.heading[ego]), reach),
        )

    def _ending(self, index: int, snapshot: TrafficSnapshot) -> Ending | None:
        ego = snapshot.state.ids[snapshot.ego]
        if self._scenario.end_on_collision and any(ego in (c.collider, c.victim) for c in snapshot.collisions):
            return Ending.COLLISION
        if snapshot.route_position >= snapshot.route_length - self._scenario.traffic.stop_before_end_m:
            return Ending.ARRIVED
        return Ending.TIME if index >= self._periods.frames else None

    def close(self) -> None:
        """End the simulation and free the renderer; closing twice is allowed."""
        self._traffic.close()
        if self._world is not None:
            self._world.renderer.close()
        self._world, self._step = None, None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def fog_truth(fog: FogField, pose: CameraPose) -> Truth:
    """The fog at a camera, and as far as it sees along its heading.

    Parameters
    ----------
    fog : FogField
        The fog.
    pose : CameraPose
        Where the camera is.
    """
    eye = np.array(pose.position)
    direction = np.array([math.cos(pose.heading), math.sin(pose.heading), 0.0])
    depth = optical_depth(fog, eye, eye + _SIGHT_LINE[:, None] * direction)
    # Optical depth grows along the line, so the distance at which it reaches ln 20 is found by interpolation.
    reached = depth[-1] >= OPTICAL_DEPTH_AT_VISIBILITY
    sight = float(np.interp(OPTICAL_DEPTH_AT_VISIBILITY, depth, _SIGHT_LINE))
    return Truth(
        extinction=float(extinction(fog, eye)),
        extinction_ahead=OPTICAL_DEPTH_AT_VISIBILITY / sight if reached else 0.0,
    )
