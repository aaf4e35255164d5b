"""Known facts about a drive by night: the own lamps that were lit, and calibrations."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from fogsim.core.parameters import accepted_parameters
from fogsim.estimators import ESTIMATORS
from fogsim.values import Lamp

NIGHT_METHODS = ("gallen2014", "gallen2014_halo", "gallen2014_veil", "night_road")
"""Methods that use lamplight."""


@dataclass(frozen=True, slots=True)
class NightDrive:
    """A drive by night.

    Attributes
    ----------
    lamps : Lamp
        Own head lamps that were lit.
    setback : float
        Distance of the camera behind the front bumper [m]; 0 if unknown: then 1.9 m.
    head_lamps : Path or None
        File of the head lamps (docs/explanation/night.md); None for a car's usual lamps.
    halos : Path or None
        File of ``fogsim calibrate halos``; None for the paper's threshold.
    """

    lamps: Lamp = Lamp.LOW_BEAM
    setback: float = 0.0
    head_lamps: Path | None = None
    halos: Path | None = None

    def parameters_of(self, method: str) -> Mapping[str, object]:
        """Parameters of a method for this drive.

        Parameters
        ----------
        method : str
            Its name in the registry.
        """
        taken = accepted_parameters(ESTIMATORS[method])
        files = {"head_lamps": self.head_lamps, "halos": self.halos}
        return {name: str(path) for name, path in files.items() if path is not None and name in taken}
