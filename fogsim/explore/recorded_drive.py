"""The drive of a scenario's ego, recorded without frames, that it can be looked at again in other fog."""

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace

from fogsim.errors import FogSimError, InputError, SimulationError
from fogsim.simulation.controlled_driving import own_policy
from fogsim.simulation.loop import ClosedLoop
from fogsim.simulation.run_config import NO_RENDERER, ReportsConfig, RunConfig, check_ego
from fogsim.simulation.timeline import Timeline
from fogsim.values import RoadNetwork, SignMap, Step, TrafficSnapshot
from fogsim.values.script import Actions


@dataclass(frozen=True, slots=True)
class Moment:
    """The traffic at one instant."""

    time: float  # Since the run began [s]
    snapshot: TrafficSnapshot
    actions: Actions  # What the script does from then on


class RecordedDrive:
    """A run that goes on as far as it is asked for; its advice knows the true visibility, since no frame is drawn."""

    def __init__(self, config: RunConfig, seed: int) -> None:
        check_ego(config.traffic.ego, "fogsim explore")
        if config.world.renderer == NO_RENDERER:
            raise InputError("renderer: none draws no frames; --set renderer=auto, with estimators if there are none")
        self._config = _without_frames(config)
        self._loop, self._policy = ClosedLoop(self._config), own_policy(self._config)
        self._timeline, self.moments = Timeline(config.script), list[Moment]()
        self._step: Step | None = None
        self._seed = seed
        self.fault = ""  # What has ended the drive too early

    @property
    def is_over(self) -> bool:
        """Whether there is nothing more to be recorded."""
        return bool(self.fault) or (self._step is not None and self._step.ending is not None)

    @property
    def network(self) -> tuple[RoadNetwork, SignMap]:
        """Roads and signs around the ego."""
        return self._network

    def start(self) -> Step:
        """Record the first moment."""
        step = self._loop.start(self._seed)
        self._network = self._loop.network()
        return self._record(step)

    def advance(self) -> Step:
        """Record the next moment."""
        if self._step is None or self.is_over:
            raise SimulationError("the drive has not been started or is over")
        return self._record(self._loop.advance(self._policy.decide(self._step)))

    def go_on(self) -> None:
        """Record the next moment; a fault ends the drive before it, and is logged."""
        try:
            self.advance()
        except FogSimError as error:
            self.fault = f"the drive ends at {self.moments[-1].time:g} s: {error}"
            logging.getLogger("fogsim").warning("fogsim: %s", self.fault)

    def reach(self, time: float, is_outdated: Callable[[], bool]) -> int | None:
        """Number of the moment at a time [s], or of the last one; None if `is_outdated` says so meanwhile."""
        index = round(time / self._config.periods.camera_period)
        while len(self.moments) <= index and not self.is_over:
            if is_outdated():
                return None
            self.go_on()
        return min(index, len(self.moments) - 1)

    def _record(self, step: Step) -> Step:
        self._step = step
        snapshot = TrafficSnapshot(
            step.traffic,
            step.ego,
            step.route_position,
            route_length=float("inf"),
            speed_limit=step.speed_limit,
            leader=step.leader,
            collisions=step.collisions,
            signal_ahead=step.signal_ahead,
        )
        actions = self._timeline.due(step).actions
        self.moments.append(Moment(step.time, snapshot, actions))
        return step

    def close(self) -> None:
        """End the simulation; closing twice is allowed."""
        self._loop.close()


def _without_frames(config: RunConfig) -> RunConfig:
    """A run of the same traffic that draws nothing: its advice and lamps go by the true visibility."""
    return replace(
        config,
        world=replace(config.world, renderer=NO_RENDERER),
        estimators=(),
        reports=ReportsConfig(),
        advice=replace(config.advice, informed_by="truth", lighting_informed_by="truth"),
        controller=None,
        equipped_share=0.0,
        equipped_vehicles=(),
    )
