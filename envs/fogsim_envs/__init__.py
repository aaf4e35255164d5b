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

for _name, _entry, _steps, _threshold in (
    ("FogAdvisory-v0", "fogsim_envs.advisory:FogAdvisoryEnv", None, None),
    ("FogHighway-v0", "fogsim_envs.highway:FogHighwayEnv", None, None),
    ("FogAdvisory-v1", "fogsim_envs.task:FogAdvisoryV1Env", 600, 25.0),
    ("FogAdvisoryFast-v1", "fogsim_envs.task:FogAdvisoryFastEnv", 520, 21.0),
    ("FogAdvisoryBatch-v1", "fogsim_envs.batch:FogAdvisoryBatchEnv", None, 21.0),
    ("FogAdvisory-v2", "fogsim_envs.task:FogAdvisoryV2Env", 600, 29.1),
    ("FogAdvisoryFast-v2", "fogsim_envs.task:FogAdvisoryFastV2Env", 520, 26.0),
    ("FogAdvisoryBatch-v2", "fogsim_envs.batch:FogAdvisoryBatchV2Env", None, 26.0),
    ("FogDrive-v2", "fogsim_envs.task:FogDriveV2Env", 600, 29.1),
    ("FogHighway-v1", "fogsim_envs.task.highway:FogHighwayV1Env", 375, 33.6),
    ("FogDrive-v1", "fogsim_envs.task:FogDriveEnv", 600, 25.0),
):
    _is_vector = "Batch" in _name
    gymnasium.register(
        id=f"fogsim/{_name}",
        entry_point=None if _is_vector else _entry,
        vector_entry_point=_entry if _is_vector else None,
        max_episode_steps=_steps,
        reward_threshold=_threshold,
    )
