"""Visibility by sensors beside the one camera, as baselines: a second camera, a radar, a scatterometer."""
