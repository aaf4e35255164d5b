"""The keys of a scenario file about sensors next to the camera, the faults of all, and what others tell."""
