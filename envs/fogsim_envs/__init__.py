"""Gymnasium environments of FogSim: importing this package registers them.

``gym.make("fogsim/FogAdvisory-v0", scenario="motorway_fog_bank")``

`fogsim_envs.camera_wrapper.FogCameraWrapper` adds a camera in fog to any environment of highway-env.
"""

import gymnasium

gymnasium.register(
    id="fogsim/FogAdvisory-v0",
    entry_point="fogsim_envs.advisory:FogAdvisoryEnv",
    vector_entry_point="fogsim_envs.vector:make_vector",
)

gymnasium.register(
    id="fogsim/FogHighway-v0",
    entry_point="fogsim_envs.highway:FogHighwayEnv",
    vector_entry_point="fogsim_envs.vector:make_highway_vector",
)

gymnasium.register(
    id="fogsim/FogAdvisory-v1",
    entry_point="fogsim_envs.task:FogAdvisoryV1Env",
    max_episode_steps=600,
)
