"""The task of ``fogsim/FogAdvisoryFast`` as one kernel over many episodes, without SUMO: for training."""

from fogsim_envs.batch.layout import RuleConstants
from fogsim_envs.batch.vector_env import FogAdvisoryBatchEnv, FogAdvisoryBatchV2Env

__all__ = ["FogAdvisoryBatchEnv", "FogAdvisoryBatchV2Env", "RuleConstants"]
