"""What rewards judge by."""

import fogsim
from fogsim_envs.rewards import advice_standard


def test_rewards_judge_by_what_the_scenarios_advice_counts_with() -> None:
    own = "{method: stopping_sight_distance, parameters: {reaction_time: 1.5, deceleration: 4.5}}"
    for advice, expected in ((own, (1.5, 4.5)), ("stopping_sight_distance", (2.5, 3.4)), ("none", (2.5, 3.4))):
        standard = advice_standard(fogsim.load_scenario("motorway_fog_bank", [f"advice={advice}"]))
        assert (standard.reaction_time, standard.deceleration) == expected
