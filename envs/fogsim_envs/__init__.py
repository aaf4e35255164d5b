"""Gymnasium environments of FogSim: importing this package registers them.

``gym.make("fogsim/FogAdvisory-v0", scenario="motorway_fog_bank")``
"""

import gymnasium

gymnasium.register(
    id="fogsim/FogAdvisory-v0",
    entry_point="fogsim_envs.advisory:FogAdvisoryEnv",
    vector_entry_point="fogsim_envs.vector:make_vector",
)
