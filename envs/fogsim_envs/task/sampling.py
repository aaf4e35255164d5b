"""Draws episodes: from distributions, or as the caller of ``reset`` fixes them."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np

from fogsim.core.parameters import Range
from fogsim.errors import InputError, UnknownNameError, shown
from fogsim.scenario import Scenario, override
from fogsim.scenario.loading import scenario_reader
from fogsim.units import DAY_ILLUMINANCE
from fogsim_envs.hosting import load_first
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
        if {*self.episode, "seed"} != keys:
            raise InputError(
                f"options['episode']: expected info['drawn'], with {sorted(keys)}, got {shown(self.episode)}"
            )
        return Episode(**self.episode)


class Drawn(NamedTuple):
    """An episode and the scenario that it makes."""

    episode: Episode
    scenario: Scenario


class Defaults(NamedTuple):
    """What applies on an environment's own road alone."""

    fog: FogDistribution | None = None  # Unless another is given
    scenes: ScenarioDistribution | None = None  # Unless another is given
    overrides: tuple[str, ...] = ()  # ``key.path=value`` each, before those that are given


MOTORWAY_DEFAULTS, _NO_DEFAULTS = Defaults(FogDistribution(), ScenarioDistribution()), Defaults()


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
        motorway: Path | tuple[Scenario, ...] = MOTORWAY,
        defaults: Defaults = MOTORWAY_DEFAULTS,
    ) -> None:
        self._split = split_number(split)
        self._overrides, self._given_fog = overrides, fog
        self._scenes = distribution if isinstance(distribution, ScenarioDistribution) else None
        is_drawn = distribution is not None and self._scenes is None
        self._is_own = scenario is None and not is_drawn
        self._defaults = defaults if self._is_own else _NO_DEFAULTS
        self._scenes = self._scenes or self._defaults.scenes
        self._scenarios: tuple[AnyScenario, ...]
        if not is_drawn:
            own = motorway if isinstance(motorway, tuple) else (motorway,)
            self._scenarios = own if scenario is None else (scenario,)
        elif scenario is not None:
            raise InputError("scenario and scenario_distribution: give one scenario or several to draw from, not both")
        else:
            self._scenarios = _several(distribution)
        self._kept: dict[tuple[str | Path, tuple[str, ...]], Scenario] = {}
        self._readers: dict[str | Path, Callable[[Iterable[str]], Scenario]] = {}

    def first_scenario(self) -> Scenario:
        """A scenario of them, for what all have in common."""
        scenario = self._loaded(self._scenarios[0], (*self._defaults.overrides, *self._overrides))
        # An environment can be pickled until its first reset, and what reads a file cannot.
        self._readers.clear()
        return scenario

    @property
    def may_be_dark(self) -> bool:
        """Whether lamps may be lit where light is drawn."""
        return self._scenes is not None and self._scenes.darkest < DAY_ILLUMINANCE

    def draw(self, rng: np.random.Generator, choice: EpisodeChoice) -> tuple[int, Drawn]:
        """Draw an episode; as many random numbers are used whatever is fixed.

        A scenario that replaces the environment's own road is run as it is, with fog only if that was given.
        """
        seed, own = numbered(rng, self._split)
        stated = choice.stated_episode
        if stated is not None and stated.seed is not None:
            seed, own = int(stated.seed), np.random.default_rng(stated.seed)
        named = self._scenarios[int(own.integers(len(self._scenarios)))]
        is_replaced = self._is_own and choice.scenario is not None
        defaults, scenes = (_NO_DEFAULTS, None) if is_replaced else (self._defaults, self._scenes)
        fog = self._given_fog or defaults.fog
        visibility = None if choice.visibility is None else float(choice.visibility)
        episode = stated or _drawn(own, scenes, fog, visibility)
        episode = replace(episode, seed=seed, driver=choice.driver or episode.driver)
        settings = [*episode.settings, *defaults.overrides, *self._overrides]
        if visibility is not None and (fog is None or stated is not None):
            settings.append(f"fog.visibility_m={visibility!r}")
        written = choice.scenario if choice.scenario is not None else named
        return seed, Drawn(episode, self._loaded(written, (*settings, *choice.overrides)))

    def _loaded(self, scenario: AnyScenario, settings: tuple[str, ...]) -> Scenario:
        if isinstance(scenario, Scenario):
            return override(scenario, settings)
        return scenario(settings) if callable(scenario) else self._read(scenario, settings)

    def _read(self, scenario: str | Path, settings: tuple[str, ...]) -> Scenario:
        """A scenario from its file; most resets of a fixed scenario ask for the same one again."""
        if (scenario, settings) not in self._kept:
            if len(self._kept) == _KEPT_SCENARIOS:
                self._kept.pop(next(iter(self._kept)))
            read = self._readers.get(scenario)
            if read is None:
                self._readers[scenario] = scenario_reader(scenario)
            self._kept[scenario, settings] = load_first(scenario, settings) if read is None else read(settings)
        return self._kept[scenario, settings]


def _drawn(
    rng: np.random.Generator,
    scenes: ScenarioDistribution | None,
    fog: FogDistribution | None,
    visibility: float | None,
) -> Episode:
    """What is drawn of an episode, in fog of a given visibility where it is densest [m]."""
    episode = Episode() if scenes is None else scenes.draw(rng)
    if fog is None:
        return episode
    return replace(episode, settings=(*episode.settings, fog_setting(fog.draw(rng, visibility))))


def _several(scenarios: object) -> tuple[AnyScenario, ...]:
    if isinstance(scenarios, Sequence) and not isinstance(scenarios, str) and len(scenarios):
        return tuple(scenarios)
    raise InputError(
        f"scenario_distribution: expected a ScenarioDistribution, or a sequence of scenarios, got {scenarios!r}"
    )
