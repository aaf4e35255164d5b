"""Message signs along a motorway as the agents of one PettingZoo environment, ``fogsim/FogCorridor-v1``.

``from fogsim_envs.corridor import parallel_env``; needs the extra ``fogsim[rl]``.
"""

from fogsim_envs.corridor.environment import FogCorridorEnv, parallel_env
from fogsim_envs.corridor.rewards import CorridorWeights

__all__ = ["CorridorWeights", "FogCorridorEnv", "parallel_env"]
