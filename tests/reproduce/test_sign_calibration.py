"""The operating range of the sign detector, measured by command."""

import json

import pytest

from fogsim.calibration.sign_calibration import measure_operating_range
from fogsim.errors import InputError
from fogsim.estimators.signs.operating_range import OperatingRange
from fogsim.reproduce.belaroussi2015 import PUBLISHED, Setup, reproduce
from fogsim.values import Camera, Response

CAMERA = Camera(320, 160, 300.0, (159.5, 79.5), 1.4, pitch=0.01, response=Response.SRGB)
FOGS = (20.0, 30.0, 45.0)


def test_signs_come_out_of_thinner_fog_from_farther_away() -> None:
    measured = measure_operating_range(CAMERA, 1.0, FOGS, approaches=4, step=4.0)
    assert list(measured.first_detection) == sorted(measured.first_detection)
    assert measured.first_detection[0] < measured.first_detection[-1]
    assert all(0.5 * v < d < 2.5 * v for v, d in zip(measured.visibility, measured.first_detection, strict=True))
    assert OperatingRange(**{name: getattr(measured, name) for name in OperatingRange.__slots__}) == measured


def test_what_cannot_be_measured_is_told() -> None:
    with pytest.raises(InputError, match="approaches: expected at least 4, got 3"):
        measure_operating_range(CAMERA, 1.0, FOGS, approaches=3)


@pytest.mark.nightly
def test_the_evaluation_stands_beside_the_paper() -> None:
    steps: list[tuple[int, int]] = []
    done = reproduce(12, [Setup("small", CAMERA)], 4, fogs=FOGS, watch=lambda step, total: steps.append((step, total)))
    assert [record["visibility_m"] for record in done.records] == list(PUBLISHED)
    assert [cell.paper for cell in done.cells] == [72.0, 172.0, 218.0, 245.0, 285.0, 28.0, 18.0, 25.0, 28.0]
    assert len(done.table) == 1 + len(PUBLISHED)
    assert done.picture.ndim == 3
    assert steps == sorted(steps)
    assert steps[-1][0] == steps[-1][1]
    json.dumps(done.records, allow_nan=False)
