"""An ego in a simulation that another program runs."""

import contextlib
import dataclasses
import math
import warnings
from types import TracebackType
from typing import Self

from fogsim.core.parameters import checked_parameters
from fogsim.core.randomness import spawn_streams
from fogsim.errors import InputError, SimulationError, UnplayedWarning
from fogsim.simulation.controlled_driving import own_policy
from fogsim.simulation.ego.equipment import EgoEquipment
from fogsim.simulation.loop import DriversFog
from fogsim.simulation.run_config import RunConfig
from fogsim.simulation.timeline import Timeline
from fogsim.traffic import AttachedTraffic
from fogsim.units import clock_time
from fogsim.values import NOTHING_UNPLAYED, Begun, Command, Step
from fogsim.values.result_checks import checked_command


class AttachedSession:
    """An ego in a simulation that another program runs; see `fogsim.attach`."""

    def __init__(self, config: RunConfig, traffic: AttachedTraffic, drivers: bool, seed: int) -> None:
        if config.has_equipped:
            raise InputError(
                "attach: traffic.equipped and a list of egos are for simulations that FogSim runs; attach to one ego"
            )
        self._name = config.name
        # A scenario for another ego gives fog and camera; whom else it names drives in another simulation.
        self._reports_unplayed = config.traffic.ego == traffic.ego
        self._traffic = traffic
        self._drivers = drivers
        self._seed = seed
        self._equipment = EgoEquipment(config)
        self._policy = own_policy(config)
        self._timeline = Timeline(config.script)
        self._begun: tuple[Begun, ...] = ()
        self._last: Step | None = None
        self._command = Command()
        self._times: tuple[float, float] | None = None
        self._index = 0
        self._drivers_fog = DriversFog()
        self._started = False
        self._equipped = False
        self._looked = False
        self._closed = False

    def observe(self) -> Step | None:
        """Take in what the last simulation step has brought; to be called after each.

        Returns the finished instant, its time counted from the first; None while the ego is not on the road. An ego
        that is teleported is off the road at least once. Until it is back the last command, if there was any, stays in
        force, and the other drivers go on in the fog.
        """
        if self._closed:
            raise SimulationError("the session is closed")
        self._looked = True
        now = math.nan
        if self._started:
            now = self._traffic.look()
        elif self._traffic.ego_is_there():
            self._traffic.start(self._seed)
            self._started = True
        else:
            return None
        snapshot = self._traffic.observe()
        if snapshot is None:
            if self._last is not None:
                self._drivers_fog.set_time(self._elapsed(now))
                self._traffic.obey(self._command)
            return None
        if not self._equipped:
            body = snapshot.state.types[snapshot.ego]
            fog = self._equipment.start_run(spawn_streams(self._seed), self._traffic.network, body)
            self._equipped = True
            if self._drivers:
                self._drivers_fog.enter(fog, self._traffic)
        time = self._elapsed(snapshot.state.time)
        self._drivers_fog.set_time(time)
        sent = self._equipment.look_from_roadside(time, snapshot.state)
        step = self._equipment.complete_step(self._index, time, snapshot, self._command, None, sent)
        step, self._begun = dataclasses.replace(step, begun=self._begun), ()
        self._index += 1
        return step

    def _elapsed(self, now: float) -> float:
        began, last = (now, now) if self._times is None else self._times
        if now < last:
            raise SimulationError(
                f"the simulation's time went back from {last:g} s to {now:g} s: attach again after reloading it"
            )
        self._times = (began, now)
        return clock_time(now - began)

    @checked_parameters
    def advise(self, step: Step, command: Command | None = None) -> Command:
        """Put a command in force for the next simulation step; to be called before each of them.

        The other drivers' sight in the fog, their choice of speed and scripted events are put in force here too.

        Returns what is in force.
        """
        if self._closed:
            raise SimulationError("the session is closed")
        self._command = self._policy.decide(step) if command is None else checked_command(command)
        if step is not self._last:
            self._begin_what_is_due(step)
            self._last = step
        self._traffic.obey(self._command)
        return self._command

    def _begin_what_is_due(self, step: Step) -> None:
        """Let begin what the timeline asks for after a step, which is looked at once."""
        due = self._timeline.due(step)
        if due.parts:
            fog = self._equipment.begin(due.actions, step.time, step.time)
            if due.actions.fog:
                self._drivers_fog.change(fog)
        refused = self._traffic.begin(due.actions.traffic) if due.actions.traffic else ()
        self._begun += self._timeline.begun(due, refused)

    def close(self) -> None:
        """Let drivers drive and see by themselves again and free the renderer; the simulation goes on.

        Every vehicle gets back what was changed about it: top speed, time headway, lane-change mode, the ego's own
        speed, and sight of its leader.
        """
        is_reporting = self._reports_unplayed and self._started and not self._closed
        self._end()
        unplayed = self._traffic.unplayed() if is_reporting else NOTHING_UNPLAYED
        if is_reporting and self._last is not None:
            unplayed += self._timeline.unplayed(self._last)
        if unplayed:
            warnings.warn(f"{self._name}: not played: {unplayed}", UnplayedWarning, stacklevel=2)

    def _end(self) -> None:
        if not self._closed and not self._started and self._looked:
            warnings.warn(self._traffic.absence(), stacklevel=2)
        try:
            if not self._closed and self._started:
                # No one is left to be held in a simulation that has ended first.
                with contextlib.suppress(SimulationError):
                    self._traffic.release()
        finally:
            self._closed = True
            self._equipment.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None:
            self.close()
        else:
            # The error counts: after a message that was broken off, traci fails in odd ways.
            with contextlib.suppress(Exception):
                self._end()
