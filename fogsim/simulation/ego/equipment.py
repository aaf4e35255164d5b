"""What rides in the ego: from a snapshot of the traffic to a finished step."""

import functools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fogsim.atmosphere import field_at, with_change
from fogsim.camera import CAR, BodyPitch, knocked, mounted_pose
from fogsim.core.randomness import Streams
from fogsim.errors import SimulationError
from fogsim.fusion import FUSIONS, DatedFusion
from fogsim.sensors import check_sign_ids, faulty_signs
from fogsim.simulation.chosen_methods import estimators
from fogsim.simulation.ego.camera_rig import CameraRig
from fogsim.simulation.ego.daylight import Ramp, in_daylight
from fogsim.simulation.ego.fog_reports import FogReports
from fogsim.simulation.ego.fog_truth import KnownWay, carriageways, fog_truth
from fogsim.simulation.ego.frame_watch import FrameWatch, LeadHistory, why_useless
from fogsim.simulation.ego.light_sensing import LightSensing, lamp_effects
from fogsim.simulation.ego.measurements import EgoSensors
from fogsim.simulation.ego.road_meters import RoadMeters
from fogsim.simulation.ego.roadside_cameras import RoadsideCameras
from fogsim.simulation.ego.sensor_faults import FaultSchedule
from fogsim.simulation.ego.view_rendering import EgoView, MakeView, Surrounding, view_of_world
from fogsim.simulation.run_config import RunConfig
from fogsim.units import DAY_ILLUMINANCE
from fogsim.values import (
    Belief,
    CameraPose,
    Command,
    Ending,
    Estimate,
    Fault,
    FogField,
    FogReport,
    Frame,
    Lamp,
    Observation,
    RoadNetwork,
    RunningFault,
    SignMap,
    Step,
    TrafficSnapshot,
    TrafficState,
)
from fogsim.values.fault import FaultKind, SignFault, Where
from fogsim.values.light import ALL_LAMPS
from fogsim.values.result_checks import checked_estimate
from fogsim.values.script import Actions


@functools.lru_cache(maxsize=1024)
def _switched_on(lamps: int) -> Lamp:
    """Lamps that are switched on, of those of `TrafficState.lamps`."""
    return ALL_LAMPS & lamps


class _RunParts(NamedTuple):
    """State that lasts for one run: random numbers, faults, meters, reports from others, roads and signs."""

    streams: Streams
    schedule: FaultSchedule
    meters: RoadMeters
    reporters: FogReports
    road: RoadNetwork
    signs: SignMap


class EgoEquipment:
    """The ego's camera, sensors, estimators and belief, in the fog of a run.

    Parameters
    ----------
    config : RunConfig
        The run; of its traffic, only the reading radius is used.
    make_view : callable
        Makes what draws the world.
    """

    def __init__(self, config: RunConfig, make_view: MakeView = view_of_world) -> None:
        camera, period = config.camera, config.periods.camera_period
        self._config, self._make_view = config, make_view
        self._rig = CameraRig(camera, period)
        self._body_pitch = BodyPitch(camera.suspension, period)
        self._sensors = EgoSensors(config.sensors)
        self._light_sensing = LightSensing(config.sensors.light)
        self._schedule: FaultSchedule | None = None
        self._light = Ramp(config.world.illuminance)
        self._daylight = self._light.first
        self._fog: FogField | None = None
        self._fog_now: FogField | None = None
        self._watch, self._leads = FrameWatch(), LeadHistory()
        self._fusion = DatedFusion(config.fusion.make(FUSIONS), config.fusion.name)
        self._view_renderer: EgoView | None = None
        self._streams: Streams | None = None
        self._meters: RoadMeters | None = None
        self._reporters: FogReports | None = None
        self._roadside_cameras: RoadsideCameras | None = None
        self._way = KnownWay()
        self._network: tuple[RoadNetwork, SignMap] | None = None
        self._sign_faults: tuple[FaultKind, ...] = ()
        self._mount_camera(CAR)

    def _mount_camera(self, body: str) -> None:
        """Put the camera where it belongs on a kind of body, and pass its calibration to the estimators."""
        self._body = body
        self._rig.mount_on(body)
        self._estimators = estimators(self._config.estimators, self._rig.assumed)

    def start_run(
        self, streams: Streams, network: Callable[[], tuple[RoadNetwork, SignMap]], body: str = CAR
    ) -> FogField:
        """Forget earlier runs, and lay the scenario's fog along the route.

        Parameters
        ----------
        streams : Streams
            Random numbers of this run.
        network : callable
            Gives roads and signs; what is drawn is kept while the route stays the same.
        body : str
            Body kind of the ego; see `TrafficState.types`.

        Returns
        -------
        FogField
            The fog at the start of the run, and how it changes.

        Raises
        ------
        MissingDependencyError
            If no renderer works here.
        """
        if body != self._body:
            self.close()
            self._fog = self._fog_now = None
            self._mount_camera(body)
        found = network()
        if self._network is not None and not np.array_equal(found[0].route, self._network[0].route):
            self.close()
            self._fog = self._fog_now = None
        if self._view_renderer is None:
            self._network = road, _ = found
            self._meters = RoadMeters(self._config.advice.sections, road.route, road.route_limits)
            self._reporters = FogReports(self._config.reports, road.route)
            self._way = KnownWay(road.route, carriageways(road.lanes))
            self._sensors.enter_road(road.structures)
        self._schedule = FaultSchedule(streams.faults)
        self.begin_faults(self._config.sensors.faults, 0.0)
        view = self._view_of_world(())
        for estimator in self._estimators:
            estimator.reset()
        self._fusion.reset()
        self._rig.reset(streams.camera)
        self._body_pitch.reset()
        self._sensors.reset(streams)
        self._watch.reset()
        self._leads.reset()
        self._streams, self._roadside_cameras = streams, None
        if self._reporters is not None:
            self._reporters.reset(streams.reports)
        if self._meters is not None:
            self._meters.reset()
        self._light = Ramp(self._config.world.illuminance)
        self._daylight = self._light.first
        if self._fog is None:
            self._fog = view.fog
        self._fog = self._config.world.fog.of_run(self._fog, streams.patch_seed)
        self._enter_fog(self._fog)
        return self._fog

    def _view_of_world(self, faults: Sequence[RunningFault]) -> EgoView:
        """What draws the world, built again where signs have gone or come back since the last time."""
        if self._network is None:
            raise SimulationError("the run has not been started, or is closed")
        road, signs = self._network
        of_signs = tuple(one.kind for one in faults if isinstance(one.kind, SignFault))
        if self._view_renderer is None or of_signs != self._sign_faults:
            if self._view_renderer is not None:
                self._view_renderer.close()
            world = self._config.world
            standing = faulty_signs(signs, of_signs, Where.WORLD) if of_signs else signs
            self._view_renderer = self._make_view(world, self._config.camera, road, standing, self._body)
            self._sign_faults = of_signs
            if self._fog_now is not None:
                self._view_renderer.enter_fog(self._fog_now)
        return self._view_renderer

    def begin(self, actions: Actions, time: float, first_time: float) -> FogField:
        """Let what a script asks of fog, light and sensors begin.

        Parameters
        ----------
        actions : Actions
            What begins.
        time : float
            When it does [s].
        first_time : float
            Time of the first step in which it is in force [s].

        Returns
        -------
        FogField
            The fog from now on, over time; the same object if it does as before.

        Raises
        ------
        SimulationError
            If `start_run` has not been called, or it is closed.
        """
        if self._fog_now is None:
            raise SimulationError("the run has not been started, or is closed")
        fog = self._fog_now
        for change in actions.fog:
            fog = with_change(fog, time, change.density, change.duration)
        if actions.fog:
            self._enter_fog(fog)
        for light in actions.light:
            self._light = self._light.turned(time, light.illuminance, light.duration, light.by_factors)
        if actions.faults:
            self.begin_faults(actions.faults, first_time)
        return fog

    def _enter_fog(self, fog: FogField) -> None:
        self._fog_now = fog
        if self._view_renderer is not None:
            self._view_renderer.enter_fog(fog)

    def begin_faults(self, faults: Iterable[Fault], time: float) -> None:
        """Let faults of the sensors begin, next to those of the scenario.

        Parameters
        ----------
        faults : iterable of Fault
            The faults.
        time : float
            When they are in force for the first time, after their delays [s]: the time of a step to come.

        Raises
        ------
        SimulationError
            If `start_run` has not been called, or it is closed.
        InputError
            If a sign is named that there is none of.
        """
        if self._schedule is None or self._network is None:
            raise SimulationError("the run has not been started, or is closed")
        ordered = tuple(faults)
        check_sign_ids((fault.kind for fault in ordered), self._network[1])
        self._schedule.begin(ordered, time)

    def complete_step(
        self,
        index: int,
        time: float,
        snapshot: TrafficSnapshot,
        command: Command,
        ending: Ending | None,
        sent: Sequence[tuple[str, FogReport]] = (),
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
        sent : sequence of (str, FogReport)
            Ids of equipped vehicles, and what they have seen in their last pictures; `look_from_roadside`.

        Raises
        ------
        SimulationError
            If `start_run` has not been called, or it is closed.
        """
        parts = self._run_parts()
        faults = parts.schedule.at(time)
        renderer, light = self._lit_world(faults, time)
        state, ego, camera = snapshot.state, snapshot.ego, knocked(self._rig.camera, [one.kind for one in faults])
        pose, fog = self._pose(state, ego), field_at(renderer.fog, time)
        reports = parts.reporters.heard(time, state, ego, fog, sent)
        parts.meters.hear(reports)
        truth = fog_truth(
            fog,
            pose,
            camera,
            renderer.signs,
            state,
            parts.meters.measure(fog),
            self._way,
            tuple(one.fault for one in faults),
            snapshot.route_position,
            light,
        )
        if light < DAY_ILLUMINANCE:
            truth = replace(truth, lamp_effects=lamp_effects(state, ego, fog, truth.extinction_ahead))
        view, frame, right = self._rig.take(
            lambda state, pose, camera: renderer.render(state, ego, pose, time, camera, light),
            state,
            ego,
            pose,
            camera,
            faults,
            parts.streams.camera,
            time,
        )
        speed = float(state.speed[ego])
        old = self._watch.stale_reason(frame, speed) if self._estimators else ""
        observation = Observation(
            frame=frame,
            speed=speed,
            lead=self._sensors.lead(snapshot, faults, parts.streams),
            signs=self._sensors.signs(snapshot, parts.signs, faults, parts.streams),
            # 0 would be unknown.
            camera_setback=max(self._rig.setback, 0.001),
            lamps=_switched_on(int(state.lamps[ego])),
            light=self._light_sensing.measure(state, ego, fog, light),
            reports=reports,
            right=right,
            scattering=self._sensors.scattering(snapshot, fog, time, faults),
            camera_trouble=old or (why_useless(frame, time) if self._estimators else ""),
        )
        estimates = self._estimate(frame, observation, time, old)
        return Step(
            index=index,
            time=time,
            traffic=state,
            ego=ego,
            route_position=snapshot.route_position,
            speed_limit=snapshot.speed_limit,
            leader=snapshot.leader,
            signal_ahead=snapshot.signal_ahead,
            collisions=snapshot.collisions,
            truth=truth,
            view=view,
            observation=observation,
            estimates=estimates,
            belief=self._believe(estimates, observation, time, snapshot.route_position),
            command=command,
            ending=ending,
            reading_radius=self._config.traffic.reading_radius,
        )

    def look_from_roadside(self, time: float, state: TrafficState) -> tuple[tuple[str, FogReport], ...]:
        """See by roadside cameras at a time [s]: part of what is `sent` to all in `complete_step`.

        Parameters
        ----------
        time : float
            Time [s].
        state : TrafficState
            Traffic at that time.
        """
        sensors = self._config.reports.roadside
        if sensors is None or sensors.camera is None:
            return ()
        parts = self._run_parts()
        if self._roadside_cameras is None:
            period, rng = self._config.periods.camera_period, parts.streams.reports.spawn(1)[0]
            self._roadside_cameras = RoadsideCameras(sensors, sensors.camera, period, parts.road.route, rng)
        renderer, light = self._lit_world(parts.schedule.at(time), time)
        reports = self._roadside_cameras.look(
            time, light, lambda pose, camera: renderer.render(state, None, pose, time, camera, light)[1]
        )
        return tuple((report.source, report) for report in reports)

    def _lit_world(self, faults: Sequence[RunningFault], time: float) -> tuple[EgoView, float]:
        """What draws the world in the daylight of now, and its illuminance [lx]."""
        renderer, light = self._view_of_world(faults), self._light.at(time)
        if light != self._daylight:
            self._daylight = light
            self._enter_fog(in_daylight(renderer.fog, light))
        return renderer, light

    def _run_parts(self) -> "_RunParts":
        """What lives as long as one run."""
        found = self._streams, self._schedule, self._meters, self._reporters, self._network
        streams, schedule, meters, reporters, network = found
        if streams is None or schedule is None or meters is None or reporters is None or network is None:
            raise SimulationError("the run has not been started, or is closed")
        return _RunParts(streams, schedule, meters, reporters, *network)

    def _believe(self, estimates: tuple[Estimate, ...], observation: Observation, time: float, place: float) -> Belief:
        """What is believed after this step."""
        return self._fusion.update_at(estimates, time, place, observation.reports)

    def surrounding(self, state: TrafficState, ego: int, pose: CameraPose) -> Surrounding:
        """Describe the surroundings of the camera.

        Parameters
        ----------
        state : TrafficState
            Every vehicle.
        ego : int
            Row of the one that carries the camera.
        pose : CameraPose
            Where the camera is.

        Raises
        ------
        SimulationError
            If no run has begun.
        """
        if self._view_renderer is None:
            raise SimulationError("the run has not been started: call begin()")
        return self._view_renderer.surrounding(state, ego, pose)

    def _pose(self, state: TrafficState, ego: int) -> CameraPose:
        body_pitch = self._body_pitch.update(float(state.acceleration[ego]))
        heading, grade = float(state.heading[ego]), float(state.grade[ego])
        return mounted_pose(self._rig.camera, state.position[ego], heading, self._rig.setback, grade, body_pitch)

    def _estimate(self, frame: Frame, observation: Observation, time: float, old: str) -> tuple[Estimate, ...]:
        """Results of all estimators; a frame that shows nothing new is rejected with a reason."""
        if not self._estimators:
            return ()
        self._leads.add(time, observation.lead)
        if old:
            return tuple(Estimate.invalid(estimator.method, old) for estimator in self._estimators)
        # A late frame belongs with what the radar measured when it was taken.
        lead = self._leads.at(frame.time)
        observation = observation if lead is observation.lead else replace(observation, lead=lead)
        return tuple(
            checked_estimate(chosen.name, estimator.update(observation))
            for chosen, estimator in zip(self._config.estimators, self._estimators, strict=True)
        )

    def close(self) -> None:
        """Free the renderer; closing twice is allowed."""
        if self._view_renderer is not None:
            self._view_renderer.close()
        self._view_renderer, self._streams, self._schedule = None, None, None
