"""Draws episodes: from distributions, or as the caller of ``reset`` fixes them."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np

from fogsim.core.parameters import Range
from fogsim.errors import InputError, UnknownNameError, shown
from fogsim.scenario import Scenario, load_scenario, override
from fogsim.units import DAY_ILLUMINANCE
from fogsim_envs.task.episodes import Episode, FogDistribution, ScenarioDistribution, check_driver, fog_setting

MOTORWAY, MOTORWAY_2 = (Path(__file__).with_name(name) for name in ("motorway.yaml", "motorway_2.yaml"))
"""The road of the default task, in version 1 and in version 2."""

_SPLITS = ("train", "test")
"""Streams of random numbers that never overlap."""

AnyScenario = str | Path | Scenario | Callable[[Sequence[str]], Scenario]
"""A name in the catalogue, a file, a scenario, or what makes one with ``key.path=value`` each."""

_KEPT_SCENARIOS = 8


@dataclass(frozen=True, slots=True)
class EpisodeChoice:
    """What of an episode is not to be drawn: the options of ``reset``."""

    scenario: AnyScenario | None = None  # The scenario
    visibility: Annotated[float, Range(1.0, math.inf, "m")] | None = None  # Visibility where the fog is densest [m]
    overrides: Iterable[str] = ()  # ``key.path=value`` each, after all others
    driver: str | None = None  # The ego's own driver
    episode: Episode | Mapping[str, Any] | None = None  # All that is drawn, or its `Episode.as_info`

    def __post_init__(self) -> None:
        """Refuse a driver or an episode that cannot be."""
        if self.driver is not None:
            check_driver(self.driver)
        _ = self.stated_episode

    @property
    def stated_episode(self) -> Episode | None:
        """The episode that is given."""
        if not isinstance(self.episode, Mapping):
            return self.episode
        keys = {one.name for one in fields(Episode)}
        if set(self.episode) != keys:
            raise InputError(
                f"options['episode']: expected info['drawn'], with {sorted(keys)}, got {shown(self.episode)}"
            )
        return Episode(**self.episode)


class Drawn(NamedTuple):
    """An episode and the scenario that it makes."""

    episode: Episode
    scenario: Scenario


def is_own_motorway(
    scenario: AnyScenario | None, distribution: ScenarioDistribution | Sequence[AnyScenario] | None
) -> bool:
    """Whether episodes are drawn on the task's own motorway, whose fog is drawn too by default."""
    return scenario is None and (distribution is None or isinstance(distribution, ScenarioDistribution))


def numbered(rng: np.random.Generator, split: int) -> tuple[int, np.random.Generator]:
    """Seed of an episode, even in one split and odd in the other, and what all else is drawn by."""
    seed = 2 * int(rng.integers(2**30)) + split
    return seed, np.random.default_rng(seed)


def split_number(split: str) -> int:
    """Number of a split by its name."""
    if split not in _SPLITS:
        raise UnknownNameError("split", split, _SPLITS)
    return _SPLITS.index(split)


class EpisodeSource:
    """What the episodes of an environment are drawn from."""

    def __init__(
        self,
        scenario: AnyScenario | None,
        distribution: ScenarioDistribution | Sequence[AnyScenario] | None,
        fog: FogDistribution | None,
        overrides: tuple[str, ...],
        split: str,
        motorway: Path = MOTORWAY,
    ) -> None:
        self._split = split_number(split)
        self._drawn = ScenarioDistribution() if scenario is None and distribution is None else distribution
        self._fog = FogDistribution() if fog is None and is_own_motorway(scenario, distribution) else fog
        self._overrides = overrides
        if isinstance(self._drawn, ScenarioDistribution) or self._drawn is None:
            self._scenarios: tuple[AnyScenario, ...] = (motorway if scenario is None else scenario,)
        elif scenario is not None:
            raise InputError("scenario and scenario_distribution: give one scenario or several to draw from, not both")
        else:
            self._scenarios = _several(self._drawn)
        self._kept: dict[tuple[str | Path, tuple[str, ...]], Scenario] = {}

    def first_scenario(self) -> Scenario:
        """A scenario of them, for what all have in common."""
        return self._loaded(self._scenarios[0], self._overrides)

    @property
    def may_be_dark(self) -> bool:
        """Whether lamps may be lit where light is drawn."""
        return isinstance(self._drawn, ScenarioDistribution) and self._drawn.darkest < DAY_ILLUMINANCE

    def draw(self, rng: np.random.Generator, choice: EpisodeChoice) -> tuple[int, Drawn]:
        """Draw an episode; as many random numbers are used whatever is fixed."""
        seed, own = numbered(rng, self._split)
        named = self._scenarios[int(own.integers(len(self._scenarios)))]
        episode = choice.stated_episode or self._episode(own, choice.visibility)
        if choice.driver is not None:
            episode = Episode(episode.settings, choice.driver, episode.light, episode.script)
        settings = [*episode.settings, *self._overrides]
        if choice.visibility is not None and (self._fog is None or choice.episode is not None):
            settings.append(f"fog.visibility_m={choice.visibility!r}")
        written = choice.scenario if choice.scenario is not None else named
        return seed, Drawn(episode, self._loaded(written, (*settings, *choice.overrides)))

    def _episode(self, rng: np.random.Generator, visibility: float | None) -> Episode:
        episode = self._drawn.draw(rng) if isinstance(self._drawn, ScenarioDistribution) else Episode()
        if self._fog is None:
            return episode
        fog = fog_setting(self._fog.draw(rng, visibility))
        return Episode((*episode.settings, fog), episode.driver, episode.light, episode.script)

    def _loaded(self, scenario: AnyScenario, settings: tuple[str, ...]) -> Scenario:
        if isinstance(scenario, Scenario):
            return override(scenario, settings)
        return scenario(settings) if callable(scenario) else self._read(scenario, settings)

    def _read(self, scenario: str | Path, settings: tuple[str, ...]) -> Scenario:
        """A scenario from its file; most resets of a fixed scenario ask for the same one again."""
        if (scenario, settings) not in self._kept:
            if len(self._kept) == _KEPT_SCENARIOS:
                self._kept.pop(next(iter(self._kept)))
            self._kept[scenario, settings] = load_scenario(scenario, settings)
        return self._kept[scenario, settings]


def _several(scenarios: object) -> tuple[AnyScenario, ...]:
    if isinstance(scenarios, Sequence) and not isinstance(scenarios, str) and len(scenarios):
        return tuple(scenarios)
    raise InputError(
        f"scenario_distribution: expected a ScenarioDistribution, or a sequence of scenarios, got {scenarios!r}"
    )
