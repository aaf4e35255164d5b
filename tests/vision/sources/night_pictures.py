"""Pictures of lamps by night that FogSim did not draw."""

import numpy as np


def picture(lamps, glow=0.0, background=8.0, shape=(240, 320), noise=1.0, seed=0):
    """Disks of light (column, row, radius, level) before a dark background, each in a glow that falls as 1 / angle.

    `glow` is the width at which it has fallen to a third [px], 0 for none.
    """
    v, u = np.mgrid[: shape[0], : shape[1]].astype(float)
    light = np.full(shape, background)
    for column, row, radius, level in lamps:
        beyond = np.maximum(np.hypot(u - column, v - row) - radius, 0.0)
        light = np.maximum(light, np.where(beyond <= 0.0, level, 0.0))
        if glow:
            light += level * (1.0 / (1.0 + 2.0 * beyond / glow)) * (beyond > 0.0)
    light += np.random.default_rng(seed).normal(0.0, noise, shape)
    return np.clip(light, 0.0, 255.0).round().astype(np.uint8)


def in_colour(grey, colour=(1.0, 1.0, 1.0)):
    """A grey picture with each channel scaled."""
    return np.stack([(grey * share).astype(np.uint8) for share in colour], axis=2)
