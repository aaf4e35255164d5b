"""Parts of the loop from a scenario: clocks, traffic, fog, sensors, methods; all of them in `fogsim.scenario.build`."""
