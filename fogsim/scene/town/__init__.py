"""What towns have next to houses and street lamps: traffic lights and persons on foot."""

from fogsim.scene.town.persons import person_batches, person_shapes
from fogsim.scene.town.traffic_lights import signal_batches, signal_light_sources, signal_posts, signal_shapes

__all__ = [
    "person_batches",
    "person_shapes",
    "signal_batches",
    "signal_light_sources",
    "signal_posts",
    "signal_shapes",
]
