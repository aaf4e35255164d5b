"""What an agent's run looks like: the camera frame, or a view from above, next to a panel, as an array or in a window.

The window is made by pygame, which comes with highway-env.
"""

import importlib
import os
import sys
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError, UnknownNameError
from fogsim.metrics import step_metrics
from fogsim.recorders import FramePanel
from fogsim.values import Step

RENDER_MODES = ("human", "rgb_array")
"""A window that shows each step as it is made, in the time that it takes; and pictures as arrays."""

_INSTEAD = "take 'rgb_array', or start it under xvfb-run"


def _has_display() -> bool:
    """Whether a window can be opened here, or a driver of SDL is requested, such as ``SDL_VIDEODRIVER=dummy``."""
    if sys.platform in {"win32", "darwin"}:
        return True
    return any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"))


def render_modes() -> list[str]:
    """Modes that work on this computer as it is."""
    return [mode for mode in RENDER_MODES if mode != "human" or _has_display()]


class StepRenderer:
    """Draws steps as an environment's ``render_mode`` asks."""

    def __init__(self, mode: str | None, title: str, make_panel: Callable[[], FramePanel] = FramePanel) -> None:
        if mode is not None and mode not in RENDER_MODES:
            raise UnknownNameError("render_mode", mode, RENDER_MODES)
        if mode == "human" and not _has_display():
            raise InputError(
                "render_mode: 'human' opens a window, and there is no display here (none of DISPLAY, WAYLAND_DISPLAY "
                f"and SDL_VIDEODRIVER is set); {_INSTEAD}"
            )
        self._mode = mode
        self._window = _Window(title)
        self._make_panel = make_panel
        self.begin_episode()

    def begin_episode(self) -> None:
        """Forget the steps of before."""
        self._panel = self._make_panel()
        self._drawn: tuple[Step, NDArray[np.uint8]] | None = None

    def show(self, step: Step, rate: float) -> None:
        """Show a step that was just made, if there is a window, for as long as the step takes (`rate` [1/s])."""
        if self._mode == "human":
            self._window.show(self._picture(step), rate)

    def render(self, step: Step) -> NDArray[np.uint8] | None:
        """What `gymnasium.Env.render` gives: the picture of the latest step; None with a window or without a mode."""
        if self._mode is None:
            gymnasium.logger.warn("render() was called, but no render_mode was given to gymnasium.make()")
        # A window shows the step already.
        return self._picture(step).copy() if self._mode == "rgb_array" else None

    def _picture(self, step: Step) -> NDArray[np.uint8]:
        # The panel remembers what it has drawn, for its charts.
        if self._drawn is None or self._drawn[0] is not step:
            self._drawn = step, self._panel.draw(step, step_metrics(step))
        return self._drawn[1]

    def close(self) -> None:
        """Close the window; closing twice is allowed."""
        self._window.close()


class _Window:
    """A window of pygame, opened with the first picture."""

    def __init__(self, title: str) -> None:
        self._title = title
        self._surface: Any = None

    def show(self, picture: NDArray[np.uint8], rate: float) -> None:
        size = picture.shape[1], picture.shape[0]
        if not self._is_open(size):
            self._open(size)
        self._pygame.surfarray.blit_array(self._surface, picture.swapaxes(0, 1))
        # Otherwise the system takes the window for one that hangs.
        self._pygame.event.pump()
        self._pygame.display.flip()
        self._clock.tick(rate)

    def _is_open(self, size: tuple[int, int]) -> bool:
        """Whether the window still stands: pygame has one, and another environment may have closed or resized it."""
        if self._surface is None or self._pygame.display.get_surface() is not self._surface:
            return False
        return bool(self._surface.get_size() == size)

    def _open(self, size: tuple[int, int]) -> None:
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        # Only who wants a window waits for this.
        self._pygame: Any = importlib.import_module("pygame")
        try:
            self._pygame.display.init()
            self._pygame.display.set_caption(self._title)
            self._surface = self._pygame.display.set_mode(size)
        except self._pygame.error as error:
            raise InputError(f"render_mode: 'human' could not open a window: {error}; {_INSTEAD}") from error
        self._clock = self._pygame.time.Clock()

    def close(self) -> None:
        if self._surface is not None:
            self._surface = None
            self._pygame.display.quit()
