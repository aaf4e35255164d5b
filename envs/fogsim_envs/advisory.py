"""The agent advises the ego's speed and chooses its lamps."""

import functools
from collections.abc import Iterable, Sequence
from pathlib import Path

from fogsim.core.parameters import checked_parameters
from fogsim.scenario import Scenario, override
from fogsim_envs.advising import AdvisingEnv
from fogsim_envs.hosting import TIMEOUT, Timeout, begin, checked_timeout, load_first
from fogsim_envs.plain_arguments import takes_plain_data
from fogsim_envs.rewards import RewardWeights
from fogsim_envs.spaces import ImageSize


@takes_plain_data
@checked_parameters
class FogAdvisoryEnv(AdvisingEnv):
    """Advise a vehicle's speed and lamps in fog that only its camera can judge.

    One step is one decision period of the scenario (0.5 s in ``motorway_fog_bank``).

    ### Action
    ``MultiDiscrete([13, 3])``, or with ``continuous=True`` ``Box(-1, 1, (2,))``

    | entry | discrete | continuous |
    |---|---|---|
    | advised speed | level i is 20 + 10 i km/h; level 12 is no advice | −1 … 1 is 20 … 130 km/h; 1 is no advice |
    | lamps | 0 low beam, 1 and front fog, 2 and rear fog | thirds of −1 … 1 |

    ### Observation
    ``Dict`` of what the vehicle itself has; the truth is in ``info["truth"]`` and nowhere else

    | key | space | meaning |
    |---|---|---|
    | camera | uint8 (rows, cols, 3) | the latest frame |
    | signs | float32 (8, 4) in −1 … 1 | signs by the map: distance / 250 m, lateral / 25 m, value / 50 m/s, size / 2 |
    | signs_mask | 0 or 1 (8,) | which rows of ``signs`` are filled |
    | state | float32 (11,) in −1 … 1 | see below |

    ``state``: own speed / 50 m/s; lead present; lead distance / 200 m; lead relative speed / 50 m/s; estimate valid;
    estimated visibility on a log scale (1 m … 10 km to 0 … 1); relative deviation of the estimate; believed visibility
    on the same scale; deviation of ln k; advised speed in force / 50 m/s; fog lamps lit.

    ### Reward
    Sum of the terms in ``info["reward_terms"]``: progress, visibility_margin, conflict, discomfort, collision, lamps
    (`fogsim_envs.rewards`; weights by ``reward_weights``).

    ### Start and end
    The ego enters the road in running traffic. Terminated by a collision of the ego, by its arrival or if it leaves
    the network; truncated after the scenario's duration.

    ### Arguments
    scenario : name in the catalogue, file, or `fogsim.Scenario`
    overrides : ``key.path=value`` each, as after ``fogsim run --set``; ``reset(options={"overrides": [...]})`` adds
    to them for one episode
    image_size : (width, height) of the camera; None keeps the scenario's
    continuous : which action space
    reward_weights : `RewardWeights`
    render_mode : None, "rgb_array" (the camera frame next to a panel with estimate, truth, advice, speed and lamps), or
    "human" (that in a window, each step as long as it takes)
    timeout : how long a child process that runs the simulation may give no sign of life [s]; ``inf`` for ever

    ### Version history
    * v0: first version
    """

    def __init__(
        self,
        scenario: str | Path | Scenario = "motorway_fog_bank",
        *,
        overrides: Iterable[str] = (),
        image_size: ImageSize | None = (160, 120),
        continuous: bool = False,
        reward_weights: RewardWeights | None = None,
        render_mode: str | None = None,
        timeout: Timeout = TIMEOUT,
    ) -> None:
        checked_timeout(timeout)
        super().__init__(
            functools.partial(_loaded, scenario),
            functools.partial(begin, timeout=timeout),
            overrides=overrides,
            image_size=image_size,
            continuous=continuous,
            reward_weights=reward_weights,
            render_mode=render_mode,
        )


def _loaded(scenario: str | Path | Scenario, settings: Sequence[str]) -> Scenario:
    return override(scenario, settings) if isinstance(scenario, Scenario) else load_first(scenario, settings)
