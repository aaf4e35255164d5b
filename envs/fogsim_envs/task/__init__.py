"""The task of the environments from version 1 on: what an episode is, what pays, what an agent observes."""

from fogsim_envs.task.advisory import FogAdvisoryV1Env, FogAdvisoryV2Env
from fogsim_envs.task.drive import FogDriveEnv, FogDriveV2Env
from fogsim_envs.task.episodes import Episode, FogDistribution, ScenarioDistribution
from fogsim_envs.task.fast import FogAdvisoryFastEnv, FogAdvisoryFastV2Env
from fogsim_envs.task.rewards import TaskWeights

__all__ = [
    "Episode",
    "FogAdvisoryFastEnv",
    "FogAdvisoryFastV2Env",
    "FogAdvisoryV1Env",
    "FogAdvisoryV2Env",
    "FogDistribution",
    "FogDriveEnv",
    "FogDriveV2Env",
    "ScenarioDistribution",
    "TaskWeights",
]
