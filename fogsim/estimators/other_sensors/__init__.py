"""Visibility by sensors next to the one camera, as baselines: a second camera, a radar, a scatterometer."""
