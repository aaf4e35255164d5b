"""From the triangle that each pixel sees to a `View`."""

from fogsim.render.shading.picture import Shading

__all__ = ["Shading"]
