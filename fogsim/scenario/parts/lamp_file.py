"""Positions and beams of a vehicle's front lamps in a file, ``lamps.yaml``."""

from pathlib import Path
from typing import Annotated

from pydantic import Field, ValidationError

from fogsim.core.files.readers import read_text
from fogsim.errors import InputError
from fogsim.lighting import LampMount
from fogsim.lighting.beams import read_beam
from fogsim.scenario.document import read_document
from fogsim.scenario.mistakes import mistake_lines
from fogsim.scenario.section import Number, Section
from fogsim.values import Beam, Lamp

Height = Annotated[Number, Field(ge=0.1, le=3.0)]
Distance = Annotated[Number, Field(ge=0.0, le=3.0)]
_USUAL = LampMount()


class LampFile(Section):
    """Keys of a file of lamps, in metres; what is left out is as on a usual car."""

    behind_bumper_m: Distance = _USUAL.behind_bumper
    """Distance of the lamps behind the front bumper."""

    half_spacing_m: Distance = _USUAL.half_spacing
    """Distance of each head lamp from the middle of the vehicle."""

    height_m: Height = _USUAL.height
    """Height of the head lamps above the road."""

    fog_half_spacing_m: Distance = _USUAL.fog_half_spacing
    """Distance of each front fog lamp from the middle of the vehicle."""

    fog_height_m: Height = _USUAL.fog_height
    """Height of the front fog lamps above the road."""

    low_beam: str | None = None
    """Table of one lamp's intensities (`fogsim.lighting.beams.read_beam`), next to the file."""

    high_beam: str | None = None
    """The same of the high beam."""

    front_fog: str | None = None
    """The same of the front fog lamp."""


def load_lamps(path: Path) -> LampMount:
    """Read a YAML file with the keys of `LampFile`; InputError has one line for each mistake."""
    document = read_document(path)
    try:
        read = LampFile.model_validate(document.data)
    except ValidationError as error:
        raise InputError(mistake_lines(document, LampFile, error)) from error
    tables = {Lamp.LOW_BEAM: read.low_beam, Lamp.HIGH_BEAM: read.high_beam, Lamp.FRONT_FOG: read.front_fog}
    beams = {
        lamp: _USUAL.beams[lamp] if table is None else _beam(path.parent / table) for lamp, table in tables.items()
    }
    return LampMount(
        read.behind_bumper_m, read.half_spacing_m, read.height_m, read.fog_half_spacing_m, read.fog_height_m, beams
    )


def _beam(path: Path) -> Beam:
    return read_beam(read_text(path), str(path))
