"""The agent drives the ego itself: acceleration and changes of lane."""

from typing import Any

from numpy.typing import NDArray

from fogsim.advice.agent import pedal_acceleration
from fogsim.values import Command, EgoControl
from fogsim_envs.task.advisory import FogAdvisoryV1Env, FogAdvisoryV2Env

_ACCELERATIONS = (-8.0, -4.0, -2.0, 0.0, 1.0, 2.0)
"""Acceleration of each level [m/s²]: an emergency, hard and gentle braking, none, and a car's usual ones."""

_LANE_CHANGES = (-1, 0, 1)
"""Lanes to the left of each choice."""


class FogDriveEnv(FogAdvisoryV1Env):
    """Drive in fog that only the camera can judge: acceleration and lane.

    Observation, reward, ``info``, episodes and arguments are those of ``fogsim/FogAdvisory-v1`` (`FogAdvisoryV1Env`).
    No one brakes for the agent: it strikes whom it drives into. Lamps are chosen by the scenario's lighting policy.
    In ``state``, the advised speed is 1.

    ### Action
    ``MultiDiscrete([6, 3])``, or with ``continuous=True`` ``Box(-1, 1, (2,))``, or with ``discrete=True``
    ``Discrete(18)``, which is 3 · acceleration + lane

    | entry | discrete | continuous |
    |---|---|---|
    | acceleration | −8, −4, −2, 0, 1, 2 m/s² | −1 … 0 is −8 … 0 m/s², 0 … 1 is 0 … 2.5 m/s² |
    | lane | 0 one to the right, 1 keep it, 2 one to the left | thirds of −1 … 1 |

    A change of lane that would leave the road is not made.

    ### Version history
    * v1: first version
    """

    def _action_levels(self) -> tuple[int, int]:
        return len(_ACCELERATIONS), len(_LANE_CHANGES)

    def _commanded(self, action: NDArray[Any]) -> Command:
        if self._continuous:
            pedal, wheel = action.tolist()
            acceleration = pedal_acceleration(pedal)
            lanes = _LANE_CHANGES[min(int((wheel + 1.0) / 2.0 * len(_LANE_CHANGES)), len(_LANE_CHANGES) - 1)]
        else:
            level, choice = action.tolist()
            acceleration, lanes = _ACCELERATIONS[level], _LANE_CHANGES[choice]
        return Command(lamps=self._built_in.lamps, control=EgoControl(acceleration, lanes))


class FogDriveV2Env(FogDriveEnv, FogAdvisoryV2Env):
    """Drive in fog that only the camera can judge, by day and by night: `FogDriveEnv` in the task of version 2.

    ### Version history
    * v2: estimators, signs and sensors of `FogAdvisoryV2Env`
    """
