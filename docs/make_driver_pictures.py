"""Draw what drivers in fog can see: ``python docs/make_driver_pictures.py`` (a second)."""

import math
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from fogsim.traffic import DriverSight
from fogsim.traffic.drivers.adaptation import adaptation, contrast_ratio
from fogsim.traffic.drivers.lamp_intensity import rear_intensity
from fogsim.traffic.drivers.sight import inherent_contrast
from fogsim.units import extinction_from_visibility
from fogsim.values import Lamp

OUT = Path(__file__).resolve().parent / "pictures"
ILLUMINANCES = np.geomspace(0.01, 1e5, 281)
VISIBILITIES = (30.0, 60.0, 120.0, math.inf)
COLOURS = ("#1b6ca8", "#d1495b", "#edae49", "#444444")
DARK_PAINT = inherent_contrast((0.1, 0.1, 0.1))


def draw_distances(axes: Axes, intensity: float, title: str) -> None:
    """Distance at which a leader is first seen, over the light of the sky."""
    for visibility, colour in zip(VISIBILITIES, COLOURS, strict=True):
        k = extinction_from_visibility(visibility)
        seen = [DriverSight(lux).seen_distance(k, DARK_PAINT, intensity) for lux in ILLUMINANCES]
        name = "clear air" if math.isinf(visibility) else f"V_met {visibility:g} m"
        axes.plot(ILLUMINANCES, seen, color=colour, label=name)
    axes.set(xscale="log", yscale="log", xlabel="illuminance [lx]", ylabel="first seen at [m]", ylim=(9, 2000))
    axes.set_title(title)


def draw_thresholds(axes: Axes) -> None:
    """What the eye asks for, over what it asks for by day."""
    eyes = [adaptation(lux) for lux in ILLUMINANCES]
    for distance, style in ((20.0, "-"), (200.0, "--")):
        ratios = [contrast_ratio(eye, distance) for eye in eyes]
        axes.plot(ILLUMINANCES, ratios, style, color=COLOURS[0], label=f"contrast, car {distance:g} m away")
    day = eyes[-1].eye_threshold
    axes.plot(ILLUMINANCES, [eye.eye_threshold / day for eye in eyes], color=COLOURS[1], label="light of a lamp")
    axes.set(xscale="log", yscale="log", xlabel="illuminance [lx]", ylabel="threshold over that by day")
    axes.set_title("thresholds (Adrian 1989)")


def main() -> None:
    """Draw and save."""
    mpl.rcParams.update({"font.size": 9, "axes.titlesize": 9, "legend.fontsize": 7.5, "legend.frameon": False})
    figure, axes = plt.subplots(1, 3, figsize=(12, 3.4), layout="constrained")
    draw_distances(axes[0], 0.0, "leader without lamps, own head lamps lit")
    draw_distances(axes[1], rear_intensity(int(Lamp.POSITION)), "leader with tail lamps (8 cd)")
    draw_thresholds(axes[2])
    for one in axes:
        one.legend()
    figure.savefig(OUT / "drivers_sight.png", dpi=100)


if __name__ == "__main__":
    main()
