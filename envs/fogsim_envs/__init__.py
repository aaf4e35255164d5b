"""Gymnasium environments of FogSim: importing this package registers them.

``gym.make("fogsim/FogAdvisory-v0", scenario="motorway_fog_bank")``

`fogsim_envs.camera_wrapper.FogCameraWrapper` adds a camera in fog to any environment of highway-env.
"""

import importlib
from typing import TYPE_CHECKING, Any

import gymnasium

if TYPE_CHECKING:
    from fogsim_envs.evaluation import Evaluation, evaluate

__all__ = ["Evaluation", "evaluate"]


def __getattr__(name: str) -> Any:
    """Import the evaluation when it is asked for: registering takes a tenth of a second, and the rest seconds."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module("fogsim_envs.evaluation"), name)


# A reward_threshold lies halfway between FogSim's rule, which goes by the belief alone, and the oracle, which knows the
# fog: docs/reference/environments.md has the returns.

gymnasium.register(
    id="fogsim/FogAdvisory-v0",
    entry_point="fogsim_envs.advisory:FogAdvisoryEnv",
)

gymnasium.register(
    id="fogsim/FogHighway-v0",
    entry_point="fogsim_envs.highway:FogHighwayEnv",
)

gymnasium.register(
    id="fogsim/FogAdvisory-v1",
    entry_point="fogsim_envs.task:FogAdvisoryV1Env",
    max_episode_steps=600,
    reward_threshold=25.0,
)

gymnasium.register(
    id="fogsim/FogAdvisoryFast-v1",
    entry_point="fogsim_envs.task:FogAdvisoryFastEnv",
    max_episode_steps=520,
    reward_threshold=21.0,
)

gymnasium.register(
    id="fogsim/FogAdvisoryBatch-v1",
    vector_entry_point="fogsim_envs.batch:FogAdvisoryBatchEnv",
    reward_threshold=21.0,
)

gymnasium.register(
    id="fogsim/FogAdvisory-v2",
    entry_point="fogsim_envs.task:FogAdvisoryV2Env",
    max_episode_steps=600,
    reward_threshold=29.1,
)

gymnasium.register(
    id="fogsim/FogAdvisoryFast-v2",
    entry_point="fogsim_envs.task:FogAdvisoryFastV2Env",
    max_episode_steps=520,
    reward_threshold=26.0,
)

gymnasium.register(
    id="fogsim/FogAdvisoryBatch-v2",
    vector_entry_point="fogsim_envs.batch:FogAdvisoryBatchV2Env",
    reward_threshold=26.0,
)

gymnasium.register(
    id="fogsim/FogDrive-v2",
    entry_point="fogsim_envs.task:FogDriveV2Env",
    max_episode_steps=600,
    reward_threshold=29.1,
)

gymnasium.register(
    id="fogsim/FogHighway-v1",
    entry_point="fogsim_envs.task.highway:FogHighwayV1Env",
    max_episode_steps=375,
    reward_threshold=33.6,
)

gymnasium.register(
    id="fogsim/FogDrive-v1",
    entry_point="fogsim_envs.task:FogDriveEnv",
    max_episode_steps=600,
    reward_threshold=25.0,
)
