"""Episodes that are drawn: repeated, and of splits."""

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.scenario import load_scenario
from fogsim_envs.task.sampling import MOTORWAY, EpisodeChoice, EpisodeSource


def test_a_repeated_episode_is_of_the_same_scenario() -> None:
    scenarios = [load_scenario(MOTORWAY, [f"duration_s={10 + i}"]) for i in range(8)]
    source, rng = EpisodeSource(None, scenarios, None, (), "train"), np.random.default_rng(0)
    seed, drawn = source.draw(rng, EpisodeChoice())
    for _ in range(3):
        again, repeated = source.draw(rng, EpisodeChoice(episode=drawn.episode.as_info()))
        assert (again, repeated.scenario) == (seed, drawn.scenario)


def test_splits_share_no_seed() -> None:
    drawn = {}
    for split in ("train", "test"):
        source, rng = EpisodeSource(MOTORWAY, None, None, (), split), np.random.default_rng(0)
        drawn[split] = {source.draw(rng, EpisodeChoice())[0] for _ in range(100)}
    assert not drawn["train"] & drawn["test"]
    with pytest.raises(InputError, match="unknown split"):
        EpisodeSource(None, None, None, (), "validation")
