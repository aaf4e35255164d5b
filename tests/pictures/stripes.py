"""Bright stripes on a dark plane that meet in a known point: the search for lines, without fog, texture or a camera."""

import numpy as np

CENTRE, ROW = 320.3, 60.7
"""The point [px]."""


def road_lines(offsets=(-1.9, -1.75, 1.75, 1.9), noise=1.0, seed=0, contrast=60.0):
    """Bright stripes between lines that meet in (CENTRE, ROW), sampled 4 × 4."""
    v, u = (np.mgrid[: 300 * 4, : 640 * 4] + 0.5) / 4 - 0.5
    lateral = (u - CENTRE) / np.maximum(v - ROW, 1e-6) * 1.4
    stripe = np.zeros(v.shape, bool)
    for left, right in zip(offsets[::2], offsets[1::2], strict=True):
        stripe |= (lateral > left) & (lateral < right) & (v > ROW)
    fine = np.where(stripe, 60.0 + contrast, 60.0)
    image = fine.reshape(300, 4, 640, 4).mean(axis=(1, 3))
    return (image + np.random.default_rng(seed).normal(0, noise, image.shape)).astype(np.float32)
