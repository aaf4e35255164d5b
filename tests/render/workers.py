"""A vector environment whose workers draw, as a program of its own: START_METHOD RENDERER [--draw-first].

With the start method "none", this process draws one frame itself.
"""

import sys
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AsyncVectorEnv

from fogsim.render import Renderer, make_renderer
from fogsim.scene import build_scene
from fogsim.values import Camera, CameraPose, Lane, LaneMarking, RoadNetwork, SignMap

CAMERA = Camera(64, 48, 57.0, (32.0, 24.0), 1.38)


def renderer_of_a_road(name: str) -> Renderer:
    line = np.array([[-100.0, 0.0, 0.0], [500.0, 0.0, 0.0]])
    lane = Lane("e_0", "e", line, 3.5, 36.0, LaneMarking.SOLID, LaneMarking.DASHED, outermost=True)
    return make_renderer(name, build_scene(RoadNetwork((lane,), line), SignMap(), np.random.default_rng(1)), 1e4)


class DrivingEnv(gymnasium.Env[Any, Any]):
    """Observes distances while it drives along a road."""

    def __init__(self, renderer: str) -> None:
        self.observation_space = gymnasium.spaces.Box(0.0, np.inf, (48, 64), np.float32)
        self.action_space = gymnasium.spaces.Discrete(2)
        self._name, self._x = renderer, 0.0
        self._renderer: Renderer | None = None

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        self._x = 0.0
        # Not before: gymnasium makes an environment in the parent too, to ask for its spaces.
        self._renderer = self._renderer or renderer_of_a_road(self._name)
        return self._draw(), {}

    def step(self, action: int) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        self._x += 2.5 + float(action)
        return self._draw(), 0.0, False, False, {}

    def _draw(self) -> Any:
        assert self._renderer is not None
        return self._renderer.render((), CAMERA, CameraPose((self._x, 0.0, 1.38), 0.0)).distance

    def close(self) -> None:
        if self._renderer is not None:
            self._renderer.close()


def draw_in_workers(method: str, renderer: str) -> None:
    envs = AsyncVectorEnv([lambda: DrivingEnv(renderer)] * 2, context=method, shared_memory=False)
    first, _ = envs.reset(seed=1)
    last = [envs.step(np.zeros(2, np.int64))[0] for _ in range(3)][-1]
    envs.close()
    alike = np.array_equal(last[0], last[1]) and not np.array_equal(first, last)
    print("frames", len(first), len(last), "alike" if alike else "different")  # noqa: T201


def main() -> None:
    method, renderer, *options = sys.argv[1:]
    own = renderer_of_a_road(renderer) if options or method == "none" else None
    pose = CameraPose((0.0, 0.0, 1.38), 0.0)
    if own is not None:
        own.render((), CAMERA, pose)
        print("one frame")  # noqa: T201
    if method != "none":
        try:
            draw_in_workers(method, renderer)
        except Exception as error:  # noqa: BLE001 - whatever a worker says is printed
            print(type(error).__name__, error)  # noqa: T201
    if own is not None:
        own.render((), CAMERA, pose)
        print("parent draws on")  # noqa: T201


if __name__ == "__main__":
    main()
