"""How long a camera's shutter is open."""

from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class Shutter:
    """How long the camera looks, and how finely that is drawn."""

    open_time: float = 0.0  # Time for which it is open [s]; 0 freezes what moves
    instants: int = 1  # Instants in it that are drawn, odd, so that one is in the middle
    follows_exposure: bool = False  # Whether that time is the longest of an automatic exposure

    def at(self, share: float) -> "Shutter":
        """The shutter at an exposure."""
        return replace(self, open_time=share * self.open_time) if self.follows_exposure else self

    def offsets(self) -> tuple[float, ...]:
        """Times from the middle of the exposure at which is drawn [s], the middle itself last."""
        half = self.instants // 2
        steps = self.open_time / self.instants
        return (*(steps * n for n in range(-half, half + 1) if n), 0.0)
