"""What each registered method does with input that no foggy road by day gives: a reason or an error, and no warning."""

import dataclasses
import math
import re
from collections.abc import Iterator
from functools import cache
from itertools import islice, product

import numpy as np
import pytest

from fogsim.errors import FogSimError, InputError
from fogsim.estimators import ESTIMATORS, make
from fogsim.values import Camera, Estimate, Frame, LeadMeasurement, Observation, SignSighting

METHODS = sorted(ESTIMATORS)
TRACKING = {"gabb2014", "huang2015", "huang2015_lead", "lead_contrast"}
FOR_THE_NIGHT = {"gallen2014", "gallen2014_veil", "night_road"}
FOR_SIGNS = {"belaroussi2015", "sign_contrast"}
VARIANTS = {name: ({"as_published": True},) for name in ("huang2015", "huang2015_rough", "negru2013", "zhu2015")}
VARIANTS["huang2015_lead"] = {"as_published": True}, {"range_from": "camera"}
"""Methods that also work otherwise."""

ROWS, COLS = 240, 320
CAMERA = Camera(COLS, ROWS, 289.0, (159.5, 119.5), 1.38, np.radians(2.0))
RANGES = (14.0, 18.0, 22.0, 27.0, 33.0, 39.0, 46.0)
"""Of the tracked vehicle, frame by frame [m]."""

PERIOD = 0.4
"""Time between two frames [s]."""


@pytest.fixture(scope="module")
def sequence(render, road):
    """A drive behind a vehicle that draws away, in fog of 100 m."""
    return [render(road.but(camera=CAMERA, lead_distance=d + 1.7), i) for i, d in enumerate(RANGES)]


def observation(image, index: int = 0, **changes) -> Observation:
    """Everything that a vehicle can have, so that no method abstains for want of a sensor."""
    told = {
        "frame": Frame(PERIOD * index, image, CAMERA),
        "speed": 25.0,
        "lead": LeadMeasurement(RANGES[index % len(RANGES)], 10.0),
        "signs": (SignSighting("sign", "speed_limit", 22.2, 80.0 - 10.0 * index, -5.0, 0.9),),
    }
    return Observation(**(told | changes))


@pytest.fixture(scope="module")
def undisturbed(sequence):
    """What a method makes of that drive, which it drives once: whether valid, extinction, deviation, frame by frame."""

    @cache
    def drive(method: str) -> list[tuple[bool, float, float]]:
        estimator = make(method, CAMERA)
        return [said(estimator.update(observation(image, index))) for index, image in enumerate(sequence)]

    return drive


def said(found: Estimate) -> tuple[bool, float, float]:
    return found.valid, found.extinction, found.standard_deviation


def estimates(method: str, image, camera: Camera = CAMERA, **options) -> list[Estimate]:
    estimator = make(method, camera, **options)
    frames = [Frame(PERIOD * index, image, camera) for index in range(4 if method in TRACKING else 2)]
    return [estimator.update(observation(image, index, frame=frame)) for index, frame in enumerate(frames)]


def numbers(value: object) -> Iterator[float]:
    """Every number in diagnostics, however deep."""
    if isinstance(value, Estimate):
        yield from numbers(value.diagnostics)
    elif isinstance(value, dict):
        yield from (number for one in value.values() for number in numbers(one))
    elif isinstance(value, (tuple, list)):
        yield from (number for one in value for number in numbers(one))
    elif isinstance(value, np.ndarray) and value.dtype.kind == "f":
        yield from value.ravel().tolist()
    elif isinstance(value, float):
        yield value


def check_sound(found: Estimate, method: str) -> None:
    """Whatever it says, an estimate is one: no NaN, no deviation without a value, no abstention without a reason."""
    assert found.method == method
    assert math.isfinite(found.extinction)
    assert found.extinction >= 0.0
    assert not any(math.isnan(number) for number in numbers(found.diagnostics))
    if found.valid:
        assert 0.0 < found.standard_deviation < math.inf
    else:
        assert (found.extinction, found.standard_deviation) == (0.0, math.inf)
        assert found.diagnostics["reason"]


def bytes_of(levels: np.ndarray) -> np.ndarray:
    return np.clip(np.broadcast_to(levels, (ROWS, COLS)), 0, 255).astype(np.uint8)


def texture(rng: np.random.Generator) -> np.ndarray:
    """Leaves and branches: grains of 1 to 11 pixels."""
    out = np.zeros((ROWS, COLS))
    for size in (1, 2, 5, 11):
        grains = rng.normal(0.0, 12.0, (ROWS // size + 1, COLS // size + 1))
        out += grains.repeat(size, axis=0).repeat(size, axis=1)[:ROWS, :COLS]
    return out


def without_road() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(3)
    row = np.arange(ROWS)[:, None]
    below = row - int(CAMERA.horizon_row)
    noise, forest = rng.normal(0.0, 1.5, (ROWS, COLS)), 60.0 + texture(rng)
    lit = 120.0 * np.clip((below - 2) / 124.0, 0.0, 1.0) ** 2 + 2.0
    cells = np.indices((ROWS, COLS))
    return {
        "black": bytes_of(np.zeros(1)),
        "grey": bytes_of(np.full(1, 128)),
        "white": bytes_of(np.full(1, 255)),
        "noise": rng.integers(0, 256, (ROWS, COLS), dtype=np.uint8),
        "colour noise": rng.integers(0, 256, (ROWS, COLS, 3), dtype=np.uint8),
        **{
            f"checkerboard of {size} px": bytes_of((cells // size).sum(axis=0) % 2 * 255) for size in (1, 7, 12, 24, 60)
        },
        "upright stripes": bytes_of(cells[1] // 40 % 2 * 255),
        "ramp": bytes_of(200.0 - 140.0 * row / ROWS),
        "faint ramp with noise": bytes_of(150.0 - 50.0 * row / ROWS + noise),
        "ramp below a bright sky": bytes_of(240.0 - np.clip(below, 0, None)),
        "slanting ramp": bytes_of(180.0 - 160.0 * (cells[0] / ROWS + cells[1] / COLS) / 2.0),
        "night": bytes_of(lit + noise),
        "forest": bytes_of(forest),
        "sky alone": bytes_of(150.0 + 60.0 * row / ROWS + noise),
        "forest before the sky": bytes_of(np.where(below > -50, forest, 200.0)),
        "snow, brighter than the sky": bytes_of(np.where(below > 0, 230.0, 150.0) + noise),
        "wall": bytes_of(np.where(below > -50, 70.0, 200.0) + noise),
    }


WITHOUT_ROAD = without_road()


def random_picture(seed: int) -> tuple[np.ndarray, Camera]:
    rng = np.random.default_rng(seed)
    camera = Camera(96, 72, rng.uniform(30, 300), (48.0, rng.uniform(0, 72)), 1.4, rng.uniform(-0.3, 0.3))
    rows = np.interp(np.arange(72), np.sort(rng.uniform(0, 72, 5)), rng.uniform(0, 300, 5))
    noise = rng.normal(0, rng.choice([0, 1, 20]), (72, 96))
    return np.clip(rows[:, None] + noise, 0, 255).astype(np.uint8), camera


@pytest.mark.parametrize("method", METHODS)
def test_a_picture_without_a_road_by_day_is_refused_with_a_reason(method):
    for name, image in WITHOUT_ROAD.items():
        for found in estimates(method, image):
            check_sound(found, method)
            # A road by night is what methods for the night are for.
            assert not found.valid or (name == "night" and method in FOR_THE_NIGHT), name


@pytest.mark.parametrize("method", METHODS)
def test_an_upside_down_camera_is_refused_or_turned(method, render, road):
    upright = render(road.but(camera=CAMERA))
    turned = np.ascontiguousarray(upright[::-1, ::-1])
    assert not any(found.valid for found in estimates(method, turned))
    told = dataclasses.replace(CAMERA, roll=math.pi)
    assert not any(found.valid for found in estimates(method, upright, told))
    for found in estimates(method, turned, told):
        check_sound(found, method)


@pytest.mark.parametrize("method", METHODS)
def test_tiny_images_are_refused_with_a_reason(method):
    for size in ((1, 1), (16, 16), (2, 300), (300, 2), (33, 20)):
        camera = Camera(*size, 100.0, (size[0] / 2, size[1] / 2), 1.4)
        for value in (0, 90, 255):
            for found in estimates(method, np.full(size[::-1], value, np.uint8), camera):
                check_sound(found, method)
                assert not found.valid, (size, value)


@pytest.mark.parametrize("method", METHODS)
def test_a_horizon_outside_the_image_is_refused_with_a_reason(method, render, road):
    image = render(road.but(camera=CAMERA, lead_distance=20.0))
    for pitch in (-89.0, -40.0, 40.0, 89.0):
        for found in estimates(method, image, dataclasses.replace(CAMERA, pitch=math.radians(pitch))):
            check_sound(found, method)
            assert not found.valid, pitch
            assert method not in ("negru2013", "zhu2015") or "horizon" in found.diagnostics["reason"]


@pytest.mark.parametrize("method", METHODS)
def test_nothing_odd_gets_out_of_random_pictures(method):
    for seed in range(6):
        image, camera = random_picture(seed)
        for found in estimates(method, image, camera):
            check_sound(found, method)


@pytest.mark.parametrize(
    ("method", "options"), [(name, options) for name, variants in VARIANTS.items() for options in variants]
)
def test_other_variants_are_as_careful(method, options):
    for name in ("black", "white", "grey", "noise", "colour noise", "night"):
        for found in estimates(method, WITHOUT_ROAD[name], **options):
            assert method == "negru2013" or (not found.valid and found.diagnostics["reason"]), name
    for seed in range(6):
        image, camera = random_picture(seed)
        for found in estimates(method, image, camera, **options):
            assert 0.0 <= found.extinction < math.inf
            assert found.valid == (found.standard_deviation < math.inf)


GREY = np.full((ROWS, COLS), 90, np.uint8)
WRONG_IMAGES = {
    "none": (None, "an array of uint8 or an array of uint16, got None"),
    "a list": ([[1, 2], [3, 4]], r"an array of uint8 .*, got \[\[1, 2\], \[3, 4\]\]"),
    "floats": (GREY / 255.0, r"an array of uint8 .*, got an array of float64, shape \(240, 320\)"),
    "NaN": (np.full((ROWS, COLS), np.nan), "an array of uint8 .*, got an array of float64"),
    "truth values": (GREY > 3, "an array of uint8 .*, got an array of bool"),
    "int64": (GREY.astype(np.int64), "an array of uint8 .*, got an array of int64"),
    "16 bits": (GREY.astype(np.uint16), "8 bits must have dtype uint8.*got uint16"),
    "objects": (GREY.astype(object), "an array of uint8 .*, got an array of object"),
    "empty": (np.zeros((0, 0), np.uint8), "0×0 pixels.*its camera has 320×240"),
    "one row": (GREY[0], r"shape \(rows, cols\) or \(rows, cols, 3\), got \(320,\)"),
    "two channels": (np.dstack([GREY] * 2), r"got \(240, 320, 2\)"),
    "opacity": (np.dstack([GREY] * 4), r"got \(240, 320, 4\)"),
    "four axes": (GREY[None, :, :, None], r"got \(1, 240, 320, 1\)"),
    "turned": (GREY.T, "240×320 pixels.*its camera has 320×240"),
    "half": (GREY[::2, ::2], "160×120 pixels.*its camera has 320×240"),
}


WRONG_TIMES = (
    (PERIOD, r"before that of an earlier one, 0\.8 s, got 0\.4 s; call reset\(\)"),
    (math.nan, "time must be a number, finite, got nan"),
    (math.inf, "time must be a number, finite, got inf"),
    (-math.inf, "time must be a number, finite, got -inf"),
    (None, "time must be a number, finite, got None"),
    ("3", "time must be a number, finite, got '3'"),
)
OTHER_CAMERAS = {"pitch": 0.03}, {"response": "srgb"}, {"principal_point": (160.0, 119.5)}, {"bits": 10}


@pytest.mark.parametrize("method", METHODS)
def test_frames_that_cannot_be_are_told_and_leave_no_trace(method, sequence, undisturbed):
    """The error says what was expected and what came, and later estimates are those of a drive without the frame."""
    disturbed = make(method, CAMERA)
    for index, frame in enumerate(sequence):
        for image, told in WRONG_IMAGES.values() if index in (0, 3) else ():
            with pytest.raises(InputError, match=told):
                disturbed.update(observation(image, index))
        for time, told in WRONG_TIMES if index == 3 else ():
            with pytest.raises(InputError, match=told):
                disturbed.update(observation(frame, frame=Frame(time, frame, CAMERA)))
        for changes in OTHER_CAMERAS if index == 3 else ():
            other = Frame(PERIOD * index, GREY, dataclasses.replace(CAMERA, **changes))
            with pytest.raises(InputError, match="camera must be that of the estimator"):
                disturbed.update(observation(GREY, frame=other))
        assert said(disturbed.update(observation(frame, index))) == undisturbed(method)[index]


@pytest.mark.parametrize("method", METHODS)
def test_values_beyond_the_bit_depth_are_told(method):
    estimator = make(method, dataclasses.replace(CAMERA, bits=10))
    with pytest.raises(InputError, match=r"10 bits must have values 0 … 1023, got one of 1024"):
        estimator.update(Observation(np.full((ROWS, COLS), 1024, np.uint16)))
    with pytest.raises(InputError, match="10 bits must have dtype uint16"):
        estimator.update(Observation(GREY))


def sound_or_told(method: str, frames, *changes) -> list[Estimate]:
    """Estimates of a drive; in place of one that is refused with a message that says something, nothing."""
    estimator, found, messages = make(method, CAMERA), [], []
    for index, (frame, change) in enumerate(zip(frames, changes, strict=True)):
        try:
            found.append(estimator.update(observation(frame, index, **change)))
        except FogSimError as error:
            messages.append(str(error))
    for estimate in found:
        check_sound(estimate, method)
    # It names what was wrong with which value.
    assert all(re.search(r"(distance|speed|time|diameter|lateral|value|range).*got", message) for message in messages)
    return found


ODD = [math.nan, math.inf, -math.inf]
ODD_SPEEDS = [math.nan, -10.0, 1e9]
ODD_LEADS = [*((distance, 10.0) for distance in (math.nan, math.inf, -1.0, 0.0, 1e9)), (20.0, math.nan), (20.0, -1e9)]


@pytest.mark.parametrize("method", METHODS)
def test_an_odd_range_is_refused_or_made_nothing_of(method, sequence):
    frames = sequence[:5]
    for lead in ((math.nan, math.inf), (1e-9, 1e9), (1e9, -10.0)):
        found = sound_or_told(method, frames, *[{"lead": LeadMeasurement(*lead)}] * len(frames))
        assert method not in ("huang2015_lead", "lead_contrast") or not any(one.valid for one in found)
    # Bad measurements among good ones.
    changes = [change for lead in ODD_LEADS for change in ({}, {"lead": LeadMeasurement(*lead)})]
    images = [sequence[index % len(sequence)] for index in range(len(changes))]
    assert len(sound_or_told(method, images, *changes)) >= len(ODD_LEADS)


@pytest.mark.parametrize("method", METHODS)
def test_an_odd_own_speed_is_refused_or_made_nothing_of(method, sequence, undisturbed):
    frames = sequence[:5]
    for speed in ODD_SPEEDS:
        odd: list[dict] = [{}] * len(frames)
        odd[2] = {"speed": speed}
        found = sound_or_told(method, frames, *odd)
        assert found[-1].valid == undisturbed(method)[4][0], speed


@pytest.mark.parametrize("method", METHODS)
def test_an_odd_sign_is_refused_or_made_nothing_of(method, sequence):
    frames = sequence[:5]
    odd = product(("value", "distance", "lateral", "diameter"), (*ODD, -1.0, 0.0, 1e9))
    # To other methods than those of signs, all of them mean the same: nothing.
    for field, value in odd if method in FOR_SIGNS else islice(odd, 1):
        sign = dataclasses.replace(observation(GREY).signs[0], **{field: value})
        sound_or_told(method, frames, *[{"signs": (sign,)}] * len(frames))


@pytest.mark.parametrize("method", METHODS)
def test_time_may_stand_and_begins_anew_after_a_reset(method, sequence):
    estimator = make(method, CAMERA)
    for time in (5.0, 5.0):
        check_sound(estimator.update(observation(sequence[0], frame=Frame(time, sequence[0], CAMERA))), method)
    estimator.reset()
    check_sound(estimator.update(observation(sequence[0])), method)
