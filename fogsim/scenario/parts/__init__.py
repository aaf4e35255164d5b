"""Parts of the loop from a scenario: sensors, methods, lamps; all of it in `fogsim.scenario.build`."""
