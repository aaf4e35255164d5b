"""The task of `fogsim_envs.task.advisory` without frames: estimates are drawn as they were measured to err."""

import dataclasses
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import extinction
from fogsim.core.parameters import checked_parameters
from fogsim.errors import InputError
from fogsim.fusion import FUSIONS, DatedFusion
from fogsim.recorders import FramePanel, draw_view_from_above
from fogsim.scenario import Scenario, build
from fogsim.scenario.section import Method
from fogsim.values import Step
from fogsim_envs.hosting import TIMEOUT, Timeout
from fogsim_envs.plain_arguments import takes_plain_data
from fogsim_envs.rendering import RENDER_MODES, StepRenderer
from fogsim_envs.spaces import ImageSize
from fogsim_envs.task.advisory import FogAdvisoryV1Env, FogAdvisoryV2Env
from fogsim_envs.task.episodes import FogDistribution, ScenarioDistribution
from fogsim_envs.task.rewards import TaskWeights
from fogsim_envs.task.sampling import Defaults
from fogsim_envs.task.surrogate import MEASURED, MEASURED_2, EstimatorSurrogate, SurrogateTable

_WITHOUT_FRAMES = ("renderer=none", "estimators=[]", "camera.width=16", "camera.height=16")
FAST_ROAD = ("road.length_m=2000", "demand.oncoming_vph=0", "clocks.traffic_step_s=0.5", "duration_s=260")

FAST_FOG = FogDistribution(ahead=(400.0, 400.0), reach=1500.0)
"""The ego starts 300 m before the bank."""

FAST_SCENARIO = ScenarioDistribution(demand=(200.0, 500.0, 800.0, 1200.0))


@takes_plain_data
@checked_parameters
class FogAdvisoryFastEnv(FogAdvisoryV1Env):
    """Advise a vehicle's speed and lamps in fog, without frames: for fast learning.

    Action, reward, ``info`` and episodes are those of ``fogsim/FogAdvisory-v1`` (`FogAdvisoryV1Env`), the observation
    is its ``state``. No frame is drawn: what camera and estimator would say is drawn from how negru2013 was measured
    to err there, given visibility ahead and light (`fogsim_envs.task.surrogate`); the belief is the filter's, made of
    that. The way is 2 km, the bank 300 m ahead of the start, and SUMO's step is 0.5 s, as long as the decision period.
    So a policy that was learnt here can be evaluated on ``fogsim/FogAdvisory-v1`` with ``observation="state"``, by real
    frames.

    ### Arguments
    scenario, scenario_distribution, fog_distribution, split, overrides, continuous, discrete, reward_weights,
    flat_info, metrics, timeout : as in `FogAdvisoryV1Env`
    observation, image_size : "state" and None, so that the keywords are those of `FogAdvisoryV1Env`
    render_mode : None, "rgb_array" (road, traffic and fog from above next to a panel with belief, truth, advice, speed
    and lamps), or "human", which shows it in a window
    surrogate : file with a table of your own, made by ``benchmarks/surrogate.py --fit``; None for the one that was
    measured

    ### Version history
    * v1: first version
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 2}  # noqa: RUF012 - Gymnasium's own way
    _measured_errors = MEASURED
    _defaults = Defaults(FAST_FOG, FAST_SCENARIO, FAST_ROAD)

    def __init__(
        self,
        scenario: str | Path | Scenario | None = None,
        *,
        scenario_distribution: ScenarioDistribution | Sequence[str | Path | Scenario] | None = None,
        fog_distribution: FogDistribution | None = None,
        split: str = "train",
        observation: str = "state",
        overrides: Iterable[str] = (),
        image_size: ImageSize | None = None,
        continuous: bool = False,
        discrete: bool = False,
        reward_weights: TaskWeights | None = None,
        render_mode: str | None = None,
        surrogate: str | Path | None = None,
        flat_info: bool = False,
        metrics: bool = False,
        timeout: Timeout = TIMEOUT,
    ) -> None:
        if observation != "state" or image_size is not None:
            raise InputError(
                "observation, image_size: expected 'state' and None, since no frame is drawn here, got "
                f"{observation!r} and {image_size!r}; fogsim/FogAdvisory-v1 draws frames"
            )
        table = SurrogateTable.load(self._measured_errors if surrogate is None else Path(surrogate))
        self._surrogate = EstimatorSurrogate(table)
        super().__init__(
            scenario,
            scenario_distribution=scenario_distribution,
            fog_distribution=fog_distribution,
            split=split,
            observation="state",
            overrides=(*_WITHOUT_FRAMES, *overrides),
            image_size=None,
            continuous=continuous,
            discrete=discrete,
            reward_weights=reward_weights,
            render_mode=render_mode,
            flat_info=flat_info,
            metrics=metrics,
            timeout=timeout,
        )

    def _make_renderer(self, render_mode: str | None) -> StepRenderer:
        return StepRenderer(render_mode, type(self).__name__, _panel_beside_view_from_above)

    def _check(self, scenario: Scenario) -> None:
        """Any scenario will do: nothing is drawn."""

    def _begin(self, scenario: Scenario, seed: int) -> Step:
        self._fusion, self._illuminance = (
            DatedFusion(build.method(scenario, scenario.fusion).make(FUSIONS)),
            scenario.light.illuminance_lx,
        )
        self._surrogate.reset(np.random.default_rng((2, seed)))
        # The belief is made here, of estimates that the loop knows nothing of.
        return super()._begin(scenario.model_copy(update={"fusion": Method(method="none")}), seed)

    def _completed(self, step: Step) -> Step:
        estimates = (self._surrogate.estimate(step.truth.extinction_ahead, self._illuminance),)
        belief = self._fusion.update_at(estimates, step.time, step.route_position, step.observation.reports)
        return dataclasses.replace(step, estimates=estimates, belief=belief)


class FogAdvisoryFastV2Env(FogAdvisoryFastEnv, FogAdvisoryV2Env):
    """Advise a vehicle's speed and lamps in fog, by day and by night, without frames: for fast learning.

    As `FogAdvisoryFastEnv`, but in the task of `FogAdvisoryV2Env`: estimates are drawn from how its estimators were
    measured to err. So a policy that was learnt here can be evaluated on ``fogsim/FogAdvisory-v2``.

    ### Version history
    * v2: as above
    """

    _measured_errors = MEASURED_2


def _panel_beside_view_from_above() -> FramePanel:
    return FramePanel(_view_from_above)


def _view_from_above(step: Step) -> Any:
    return draw_view_from_above(step, partial(_extinction_now, step))


def _extinction_now(step: Step, places: NDArray[np.float64]) -> NDArray[np.float64]:
    fog = step.truth.fog
    return np.zeros(places.shape[:-1]) if fog is None else extinction(fog, places, step.time)
