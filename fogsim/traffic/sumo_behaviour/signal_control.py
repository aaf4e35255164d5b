"""Traffic lights that a script holds in a state, and gives back to their program."""

import math

from fogsim.errors import InputError, suggest
from fogsim.traffic.sumo.link import Api
from fogsim.values.script import SetSignal


class SignalControl:
    """Sets traffic lights; remembers which, to give them back."""

    def __init__(self, api: Api) -> None:
        self._lights = api.trafficlight
        self._programs: dict[str, str] = {}
        self._until: dict[str, float] = {}

    def begin(self, action: SetSignal, time: float) -> None:
        """Let traffic lights show something else (`time` [s])."""
        known, signal = list(self._lights.getIDList()), action.signal
        if signal not in known:
            raise InputError(f"there are no traffic lights {signal!r} in the net; {suggest(signal, known)}")
        self._give_back(signal)
        program = str(self._lights.getProgram(signal))
        if action.phase is None:
            self._programs[signal] = program
            self._lights.setRedYellowGreenState(signal, self._state(action))
        else:
            self._lights.setPhase(signal, self._phase(action, program))
        if math.isfinite(action.hold):
            self._until[signal] = time + action.hold
            if action.phase is not None:
                self._lights.setPhaseDuration(signal, action.hold)

    def _state(self, action: SetSignal) -> str:
        links = len(self._lights.getRedYellowGreenState(action.signal))
        if len(action.state) not in (1, links):
            raise InputError(
                f"the traffic lights {action.signal!r} have {links} links: expected {links} letters, or one for all, "
                f"got {action.state!r}"
            )
        return action.state if len(action.state) == links else action.state * links

    def _phase(self, action: SetSignal, program: str) -> int:
        logics = {logic.programID: logic for logic in self._lights.getAllProgramLogics(action.signal)}
        phases = len(logics[program].phases)
        if action.phase is None or not 0 <= action.phase < phases:
            raise InputError(
                f"the program of the traffic lights {action.signal!r} has phases 0 to {phases - 1}, got {action.phase}"
            )
        return action.phase

    def update(self, time: float) -> None:
        """Give back the lights whose time is over (`time` [s])."""
        for signal in [one for one, end in self._until.items() if time >= end - 1e-9]:
            self._give_back(signal)

    def release(self) -> None:
        """Give all lights back to their programs."""
        for signal in list(self._programs):
            self._give_back(signal)

    def _give_back(self, signal: str) -> None:
        self._until.pop(signal, None)
        if signal in self._programs:
            self._lights.setProgram(signal, self._programs.pop(signal))
