"""The keys of a scenario file about sensors next to the camera, the faults of all, and reports from others."""
