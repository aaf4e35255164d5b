"""The task of ``fogsim/FogAdvisoryFast-v1`` as one kernel over many episodes, without SUMO: for training."""

from fogsim_envs.batch.vector_env import FogAdvisoryBatchEnv

__all__ = ["FogAdvisoryBatchEnv"]
