"""The keys of a scenario file about sensors beside the camera, the faults of all, and what others tell."""
