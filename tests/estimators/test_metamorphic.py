"""What holds for every registered method whatever the picture: scale, crop, tilt, gain, pixel depth, memory.

A new method is tested by itself, because the registry is what is iterated. It must be able to tell from the drive of
this file (day, flat road with marks, a tracked vehicle that draws away, V = 100 m), or be named in `NOT_BY_DAY`.

Where the picture is drawn anew, a relation holds to the method's own uncertainty only: another pixel grid has other
noise, other rounding, and another piece of the road's texture in each row. `close` therefore allows two and a half
standard deviations of the difference (1 of 80 by chance; the pictures are the same ones every time) and never less than
3 %; that the deviations themselves are small is part of the drive's own test.
"""

import copy
import math
from dataclasses import replace

import numpy as np
import pytest

from fogsim.core.registry import parameters
from fogsim.estimators import ESTIMATORS, make
from fogsim.estimators.huang2015_medians import Huang2015Repair
from fogsim.estimators.negru2013 import Negru2013Repair
from fogsim.estimators.zhu2015_road import Zhu2015Repair
from fogsim.values import Camera, Estimate, Frame, LeadMeasurement, Observation, Response

NOT_BY_DAY = {
    "belaroussi2015": "needs signs: tests/estimators/signs/test_belaroussi2015.py",
    "sign_contrast": "needs signs: tests/estimators/signs/test_sign_contrast.py",
    "hautiere2006_stereo": "needs a second camera: tests/estimators/test_hautiere2006_stereo.py",
    "gabb2014": "needs a vehicle that disappears: tests/estimators/test_gabb2014.py",
    "scatterometer": "needs a sensor of its own: tests/estimators/test_scatterometer.py",
    "night_road": "reads lamplight: tests/estimators/night/test_night_road.py",
    "gallen2014": "reads lamplight: tests/estimators/night/test_gallen2014.py",
    "gallen2014_halo": "reads lamplight: tests/estimators/night/test_gallen2014.py",
    "gallen2014_veil": "reads lamplight: tests/estimators/night/test_gallen2014_veil.py",
}
"""Methods that cannot tell from this drive by day, and where their relations are tested instead."""

CONFIRMED = {"huang2015_rough": Huang2015Repair, "negru2013": Negru2013Repair, "zhu2015": Zhu2015Repair}
"""Methods that the day model confirms, and their repairs."""

METHODS = sorted(set(ESTIMATORS) - set(NOT_BY_DAY))
RANGES = (14.0, 18.0, 22.0, 26.0, 30.0, 35.0, 40.0, 45.0, 50.0)
"""Of the tracked vehicle before the own bumper, which is 1.7 m before the camera [m]."""

TRACKING = {"huang2015", "huang2015_lead", "lead_contrast"}
"""Methods that need the whole drive; others are given its last frames."""

CAMERA = Camera(480, 360, 433.0, (239.5, 179.5), 1.38, np.radians(2.0))
PERIOD = 0.4


@pytest.fixture(scope="module")
def drive(render, road):
    """Function from what is different and a camera to the frames of the drive; `lead=False` leaves the vehicle out."""

    def frames(camera: Camera = CAMERA, *, lead: bool = True, **changes) -> list[np.ndarray]:
        scene = replace(road, camera=camera, **changes)
        return [render(replace(scene, lead_distance=d + 1.7 if lead else None), i) for i, d in enumerate(RANGES)]

    return frames


def indices(method: str) -> range:
    """Frames of the drive that a method is given."""
    return range(0 if method in TRACKING else len(RANGES) - 3, len(RANGES))


def told_of(index, image, camera=CAMERA, scale=1.0, start=0.0, told=True) -> Observation:
    lead = LeadMeasurement(scale * RANGES[index], 10.0 * scale) if told else None
    return Observation(Frame(start + PERIOD * index, image, camera), 25.0, lead)


def looks(method, images, camera, *, scale=1.0, start=0.0, told=True, **options) -> list[Estimate]:
    """What a method says frame by frame; it is given those of the options that it has."""
    known = parameters(ESTIMATORS[method])
    estimator = make(method, camera, **{name: value for name, value in options.items() if name in known})
    return [estimator.update(told_of(i, images[i], camera, scale, start, told)) for i in indices(method)]


def last(method, images, camera=CAMERA, **how) -> Estimate:
    return looks(method, images, camera, **how)[-1]


def numbers(found: Estimate) -> tuple[bool, float, float]:
    return found.valid, found.extinction, found.standard_deviation


def spread(found: Estimate) -> float:
    """Relative standard deviation."""
    return found.standard_deviation / found.extinction


def close(found: Estimate, reference: Estimate) -> bool:
    """Whether a visibility is that of a reference, to 2.5 deviations of the difference or 3 %."""
    if not (found.valid and reference.valid):
        return False
    apart = abs(math.log(found.visibility / reference.visibility))
    return apart <= max(0.03, 2.5 * math.hypot(spread(found), spread(reference)))


@pytest.fixture(scope="module")
def reference(drive):
    images = drive()
    return {method: last(method, images) for method in METHODS}


@pytest.mark.parametrize("method", METHODS)
def test_the_drive_tells(reference, method):
    """All that follows compares with this: 100 m, within 10 %, and no deviation that would excuse anything.

    Methods of the road's brightness do not know the sky, the camera and the surface, and are less sure.
    """
    found = reference[method]
    told = f"{method} says nothing of the drive ({found.diagnostics.get('reason')}): mend it or name it in NOT_BY_DAY"
    assert found.valid, told
    assert found.visibility == pytest.approx(100.0, rel=0.1)
    if method not in CONFIRMED:
        assert spread(found) < 0.1


@pytest.mark.parametrize("method", CONFIRMED)
def test_confirmation_makes_methods_of_the_road_less_sure(drive, reference, method):
    """What it adds is what they do not know of sky, camera and surface; by themselves they are as sure as others."""
    repairs = [repair for repair in CONFIRMED[method] if repair.value != "confirmed"]
    alone = last(method, drive(), repairs=repairs)
    assert alone.visibility == pytest.approx(reference[method].visibility)
    assert spread(alone) < 0.1
    assert spread(alone) < spread(reference[method]) < 0.3


@pytest.mark.parametrize("method", METHODS)
def test_thinner_fog_is_seen_farther(drive, method):
    seen = [last(method, drive(visibility=visibility)) for visibility in (40.0, 110.0, 320.0)]
    assert all(found.valid for found in seen)
    extinctions = [found.extinction for found in seen]
    assert extinctions == sorted(extinctions, reverse=True)
    assert extinctions[0] > 6.0 * extinctions[-1]


@pytest.mark.parametrize("method", METHODS)
def test_visibility_scales_with_focal_length_and_ranges(drive, reference, method):
    """Twice the focal length, the horizon on the same row, twice the ranges: a world twice as deep.

    The same pixels, so their noise is the same. The slant path is that of another angle (0.3 %), and what a method
    knows in metres (patches of the road, spacing of kept pictures, sideways room) is not twice as large: 4 %.
    """
    pitch = np.arctan(np.tan(CAMERA.pitch) / 2)
    deep = replace(CAMERA, focal_length=2 * CAMERA.focal_length, pitch=pitch)
    doubled = {"setback": 3.4, "range_deviation": 0.5, "pitch_deviation": np.radians(0.05)}
    found = last(method, drive(), deep, scale=2.0, **doubled)
    assert found.valid
    assert found.visibility == pytest.approx(2 * reference[method].visibility, rel=0.04)


@pytest.mark.parametrize("method", METHODS)
def test_visibility_scales_with_the_mount_height(drive, method):
    """Twice the height over the same picture of a road alone; a method that needs a vehicle misses it at any height.

    Widths and patches that a method knows in metres then fill other columns and rows: 5 %.
    """
    images = drive(lead=False)
    single = last(method, images, told=False)
    double = last(method, images, replace(CAMERA, mount_height=2 * CAMERA.mount_height), told=False)
    if not single.valid:
        assert "vehicle" in single.diagnostics["reason"]
        assert double.diagnostics["reason"] == single.diagnostics["reason"]
        return
    assert double.valid
    assert double.visibility == pytest.approx(2 * single.visibility, rel=0.05)


DIM = {"airlight": 140.0, "asphalt": 42.0, "mark": 105.0, "terrain": 31.5, "lead_paint": 21.0, "noise": 0.7}
TOLD = {
    # All light at 70 % and the noise with it: steps of whole grey levels are coarser by as much.
    "gain": (CAMERA, DIM),
    # Koschmieder's law is linear in light. Noise of the darker parts is amplified otherwise.
    "response": (replace(CAMERA, response=Response.SRGB), {}),
    # Turning back interpolates between pixels, and corners show other ground.
    "roll": (replace(CAMERA, roll=np.radians(-4.0)), {}),
    # The horizon lies on other rows; the road about the inflection is the same.
    "pitch": (replace(CAMERA, pitch=np.radians(4.0)), {}),
}


@pytest.mark.parametrize("change", TOLD)
@pytest.mark.parametrize("method", METHODS)
def test_gain_and_what_is_told_of_the_camera_are_undone(drive, reference, method, change):
    camera, light = TOLD[change]
    assert close(last(method, drive(camera, **light), camera), reference[method])


@pytest.mark.parametrize("method", METHODS)
def test_a_crop_that_is_told_changes_nothing(drive, method):
    """Two windows of one picture, 24 px apart, with the principal point where it then is: sky and kerb differ only."""
    u0, v0 = CAMERA.principal_point
    size = CAMERA.width + 24, CAMERA.height + 24
    images, found = drive(replace(CAMERA, width=size[0], height=size[1], principal_point=(u0 + 12, v0 + 12))), []
    for first in (0, 24):
        rows, cols = slice(first, first + CAMERA.height), slice(first, first + CAMERA.width)
        told = replace(CAMERA, principal_point=(u0 + 12 - first, v0 + 12 - first))
        found.append(last(method, [image[rows, cols] for image in images], told))
    assert close(*found)


def three(image):
    return np.repeat(image[:, :, None], 3, axis=2)


SAME = {
    # Luminance weights add up to one: equal to the rounding of sums, and all that is decided by them.
    "grey in three channels": (three, {}, 1e-3),
    # The largest value is 2^12 − 1, not 16 · 255: a gain of 0.4 %.
    "more bits": (lambda image: three(image.astype(np.uint16) * 16), {"camera": replace(CAMERA, bits=12)}, 0.01),
    # Only differences of time count; 10⁶ s leave 10⁻¹⁰ s of them.
    "a later clock": (np.copy, {"start": 1e6}, 1e-6),
}


@pytest.mark.parametrize("change", SAME)
@pytest.mark.parametrize("method", METHODS)
def test_the_same_picture_otherwise_given_says_the_same(drive, reference, method, change):
    given, how, rel = SAME[change]
    found = last(method, [given(image) for image in drive()], **how)
    assert found.extinction == pytest.approx(reference[method].extinction, rel=rel)


@pytest.mark.parametrize("method", METHODS)
def test_neither_layout_nor_identity_of_what_is_given_matters(drive, reference, method):
    images = [np.asfortranarray(image) for image in drive()]
    for image in images:
        image.flags.writeable = False
    kept = copy.deepcopy(images)
    assert numbers(last(method, images, replace(CAMERA))) == numbers(reference[method])
    assert all(np.array_equal(a, b) for a, b in zip(images, kept, strict=True))


@pytest.mark.parametrize("method", METHODS)
def test_two_of_a_kind_do_not_share_a_memory_and_what_was_reset_is_as_new(drive, reference, method):
    """Two estimators take turns on two drives, as if each were alone; then the second one begins the first's."""
    images, other = drive(), drive(visibility=320.0)
    one, two = make(method, CAMERA), make(method, CAMERA)
    first = []
    for index in indices(method):
        first.append(numbers(one.update(told_of(index, images[index]))))
        two.update(told_of(index, other[index]))
    assert first[-1] == numbers(reference[method])
    two.reset()
    assert [numbers(two.update(told_of(index, images[index]))) for index in indices(method)] == first


@pytest.mark.parametrize("method", METHODS)
def test_looking_twice_at_one_picture_is_no_second_witness(drive, method):
    """The same frame again has the same errors: the deviation may not fall as if they were others."""
    image = drive(lead=False)[0]
    found = looks(method, [image] * len(RANGES), CAMERA, told=False)
    if not found[0].valid:
        assert "vehicle" in found[0].diagnostics["reason"]
        assert not found[-1].valid
        return
    assert found[-1].standard_deviation >= 0.7 * found[0].standard_deviation
    assert found[-1].extinction == pytest.approx(found[0].extinction, rel=0.02)
