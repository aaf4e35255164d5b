"""A trained agent as a controller: what of an environment's observation a controller knows, and a policy in a file."""

import functools
import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fogsim.core.onnx_network import OnnxNetwork, read_network
from fogsim.core.registry.guard import guarded_call
from fogsim.errors import MethodError
from fogsim.values import Belief, Control, Observation

SPEED_SCALE = 25.0
"""Speed that is 0 in an agent's state, or 1 for a relative speed [m/s]. Nothing is −1, twice that 1."""

_LEAD_SCALE, _VISIBILITY_SCALE = 100.0, 100.0
"""Lead's distance and visibility that are 0 [m]; a tenth of the visibility is −1 and tenfold 1. So what matters in fog
fills the range, as networks wish."""

_QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Quantiles of the believed visibility in an agent's state."""

_LIGHT_RANGE = (-1.0, 5.0)
"""log10 of the illuminance [lx] that is −1 and 1: a moonlit night and the brightest overcast day."""

AGENT_STATE = (
    "speed",
    "lead_present",
    "lead_distance",
    "lead_relative_speed",
    "belief_5_percent",
    "belief_25_percent",
    "belief_median",
    "belief_75_percent",
    "belief_95_percent",
    "belief_deviation",
    "ambient_light",
)
"""Meaning of the entries of `agent_state`."""

_HARDEST_BRAKING, _LARGEST_ACCELERATION = 8.0, 2.5
"""What −1 and 1 of a continuous action stand for [m/s²]; 0 is 0, and between them it is proportional."""

_INPUT = f"one input, float32 of shape (1, {len(AGENT_STATE)})"
_OUTPUT = "one output, float32 of shape (1, 1): the acceleration, −1 … 1 for −8 … 2.5 m/s²"


def agent_state(observation: Observation, belief: Belief) -> tuple[float, ...]:
    """What an agent is given of what a controller knows, `AGENT_STATE`, in about −1 … 1."""
    lead, light = observation.lead, observation.light
    darkest, brightest = _LIGHT_RANGE
    return (
        observation.speed / SPEED_SCALE - 1.0,
        float(lead is not None),
        lead.distance / _LEAD_SCALE - 1.0 if lead else 1.0,
        lead.relative_speed / SPEED_SCALE if lead else 0.0,
        *map(scaled_visibility, belief.visibility_quantiles(_QUANTILES)),
        belief.log_standard_deviation,
        # A bright day without a light sensor.
        2.0 * (math.log10(max(light.illuminance, 1e-9)) - darkest) / (brightest - darkest) - 1.0 if light else 1.0,
    )


def scaled_visibility(visibility: float) -> float:
    """Visibility on a logarithmic scale: −1 for 10 m or less, 0 for 100 m, 1 for 1 km or more (`visibility` [m])."""
    scaled = math.log10(max(visibility, 1e-9) / _VISIBILITY_SCALE) if math.isfinite(visibility) else 1.0
    return min(max(scaled, -1.0), 1.0)


def clipped(state: tuple[float, ...]) -> NDArray[np.float32]:
    """Entries of an agent's state as float32 in −1 … 1."""
    found = np.array(state, dtype=np.float32)
    return np.minimum(np.maximum(found, -1.0, out=found), 1.0, out=found)


def pedal_acceleration(pedal: float) -> float:
    """Acceleration of a continuous action of −1 … 1 [m/s²]."""
    return pedal * (_LARGEST_ACCELERATION if pedal > 0.0 else _HARDEST_BRAKING)


class _TrainedAgent:
    """A network that drives: ``onnx:policy.onnx`` has its weights, and the spaces as the shapes of input and output.

    It is given `AGENT_STATE`, entries of ``state`` of ``fogsim/FogDrive-v1``, and gives the first entry of its
    continuous action, clipped to −1 … 1. It keeps nothing between calls, each within `time_limit` [s].
    """

    def __init__(self, name: str, network: OnnxNetwork, time_limit: float | None) -> None:
        self._who = f"controller {name!r}: its network"
        # A partial, since the line of a function of FogSim's says nothing about a network's failure.
        self._outputs = guarded_call(functools.partial(network.outputs), self._who, None, time_limit)

    def control_by_belief(self, observation: Observation, belief: Belief) -> Control:
        """Drive; see `BeliefController.control_by_belief`."""
        (found,) = self._outputs(clipped(agent_state(observation, belief))[None])
        if found.size != 1 or not np.isfinite(found).all():
            raise MethodError(f"{self._who}: expected {_OUTPUT}; got {found.tolist()} at {observation.time:g} s")
        return Control(pedal_acceleration(min(max(found.item(), -1.0), 1.0)))


def trained_agent(name: str, path: Path, time_limit: float | None = None) -> Callable[[], _TrainedAgent]:
    """Factory of the agent whose network is in a file; InputError if it cannot be one."""
    network = read_network(path)
    inputs = network.session.get_inputs()
    shape: Sequence[object] = inputs[0].shape if len(inputs) == 1 and inputs[0].type == "tensor(float)" else ()
    if len(shape) != 2 or shape[1] != len(AGENT_STATE) or (isinstance(shape[0], int) and shape[0] != 1):
        raise network.wrong_input(_INPUT)
    network.check_output(np.zeros((1, len(AGENT_STATE)), np.float32), "a state of zeros", _OUTPUT, {(1, 1), (1,)})
    return functools.partial(_TrainedAgent, name, network, time_limit)
