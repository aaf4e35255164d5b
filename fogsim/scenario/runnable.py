"""A scenario, which becomes the plain values that a run is made of."""

from fogsim.scenario.build import run_config
from fogsim.scenario.parts.methods import own_methods
from fogsim.scenario.schema import ScenarioFile
from fogsim.scenario.wording.sentences import SENTENCES
from fogsim.scenario.written_form import resolved
from fogsim.simulation.run_config import RunConfig, RunRecord, ScenarioLike


class Scenario(ScenarioFile, ScenarioLike):
    """A whole scenario."""

    def run_config(self) -> RunConfig:
        """Make the plain values, in SI units and radians, that a run is made of."""
        return run_config(self)

    def run_record(self) -> RunRecord:
        """State the scenario with every default, versions of the user's methods, and the scenario in sentences."""
        return RunRecord(
            resolved(self),
            own_methods(self),
            lambda: {heading: words(self) for heading, words in SENTENCES.items()},
        )
