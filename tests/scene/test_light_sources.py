import dataclasses

import numpy as np
import pytest

from fogsim.scene import build_scene, light_sources, street_lamp_heads, street_lighting, vehicle_batches
from fogsim.scene.lamps import FULL, SIGNAL_LOBES, STREET_ANGLES, STREET_INTENSITIES
from fogsim.scene.vehicles import body_shapes
from fogsim.values import Beam, Lamp, RoadNetwork, SignMap, Surface, TrafficState
from fogsim.values.luminous_intensity import SignalLobe, luminous_intensity
from tests.helpers.vehicles import vehicles

SHAPES = body_shapes()
FLAT = Beam(np.radians([-90.0, 90.0]), np.radians([-90.0, 90.0]), np.full((2, 2), 500.0))
BEAMS = {Lamp.LOW_BEAM: FLAT}
EYE = (0.0, 0.0, 1.2)
SIZES = {"car": (4.5, 1.8, 1.5), "truck": (16.5, 2.55, 4.0), "bus": (12.0, 2.5, 3.4), "motorcycle": (2.2, 0.8, 1.6)}


def one(lamps: Lamp, *, kind: str = "car", gap: float = 30.0, heading: float = 0.0, y: float = 0.0) -> TrafficState:
    """A vehicle whose nearer end is `gap` metres ahead of the origin: its rear, or its front if it comes towards it."""
    x = gap + SIZES[kind][0] * (np.cos(heading) > 0)
    return vehicles([[x, y, 0.5]], ids="v", kinds=kind, heading=heading, size=SIZES[kind], lamps=int(lamps))


def surfaces(state: TrafficState, surface: Surface) -> np.ndarray:
    """Vertices of a lamp's surfaces in the world."""
    (batch,) = vehicle_batches(state, None)
    shape, transform = SHAPES[batch.shape], batch.transforms[0].astype(float)
    return shape.positions[shape.surface == surface] @ transform[:3, :3].T + transform[:3, 3]


def test_lamps_behind_shine_from_their_surfaces() -> None:
    for lamp, surface, intensity in [
        (Lamp.POSITION, Surface.LAMP_POSITION_REAR, 8.0),
        (Lamp.STOP, Surface.LAMP_STOP, 100.0),
        (Lamp.REAR_FOG, Surface.LAMP_REAR_FOG, 200.0),
        (Lamp.INDICATOR_LEFT, Surface.LAMP_INDICATOR_LEFT, 200.0),
        (Lamp.INDICATOR_RIGHT, Surface.LAMP_INDICATOR_RIGHT, 200.0),
    ]:
        for kind in SIZES:
            state = one(lamp, kind=kind)
            found = light_sources(state, None, EYE, BEAMS)
            places = surfaces(state, surface)
            assert 1 <= len(found.intensity) <= 3
            for position, area in zip(found.position, found.area, strict=True):
                nearest = np.linalg.norm(places - position, axis=1).min()
                assert nearest < 0.35  # from a vertex to the middle of its panel, or between two panels of one lamp
                assert (position > places.min(axis=0) - 0.01).all()
                assert (position < places.max(axis=0) + 0.01).all()
                assert 0.001 < area < 0.0145
            small = kind == "motorcycle" and intensity == 200.0
            if not small:
                assert found.intensity.max() == pytest.approx(intensity, rel=0.35)
            assert found.intensity.max() <= intensity
            weights = (0.2126, 0.7152, 0.0722)
            assert found.colour @ weights == pytest.approx(np.ones(len(found.intensity)))


def test_intensity_over_area_is_the_luminance_of_the_surface() -> None:
    for lamp, luminance in ((Lamp.POSITION, 1300.0), (Lamp.STOP, 17e3), (Lamp.REAR_FOG, 20e3)):
        found = light_sources(one(lamp, gap=80.0), None, EYE, BEAMS)
        assert found.intensity / found.area == pytest.approx(np.full(len(found.area), luminance), rel=0.08)


def test_lamps_that_face_away_or_are_dark_are_left_out() -> None:
    rear = Lamp.POSITION | Lamp.STOP | Lamp.REAR_FOG
    assert len(light_sources(one(rear, heading=np.pi), None, EYE, BEAMS).intensity) == 0
    assert len(light_sources(one(Lamp.LOW_BEAM | Lamp.DAYTIME), None, EYE, BEAMS).intensity) == 0
    assert len(light_sources(one(Lamp.NONE), None, EYE, BEAMS).intensity) == 0
    assert len(light_sources(one(rear, gap=1600.0), None, EYE, BEAMS).intensity) == 0
    assert len(light_sources(one(rear), 0, EYE, BEAMS).intensity) == 0
    beside = one(rear, gap=-2.0, y=4.0)
    assert light_sources(beside, None, EYE, BEAMS).intensity.sum() < 1.0
    found = light_sources(vehicles([]), None, EYE, BEAMS)
    assert (found.position.shape, found.colour.shape) == ((0, 3), (0, 3))


def test_head_lamps_shine_what_their_beam_has_in_the_direction_of_the_eye() -> None:
    angles = np.radians([-20.0, 0.0, 20.0])
    rising = Beam(angles, angles, np.array([[10.0, 100.0, 1000.0]] * 3))
    straight = one(Lamp.LOW_BEAM, heading=np.pi, gap=60.0)
    found = light_sources(straight, None, EYE, {Lamp.LOW_BEAM: rising})
    assert len(found.intensity) == 2
    right = np.degrees(np.arctan2(found.position[:, 1], found.position[:, 0]))  # of the axis, as the lamps see the eye
    assert found.intensity == pytest.approx(100.0 * 10.0 ** (-right / 20.0), rel=0.02)
    both = {Lamp.LOW_BEAM: FLAT, Lamp.HIGH_BEAM: rising}
    more = light_sources(one(Lamp.LOW_BEAM | Lamp.HIGH_BEAM, heading=np.pi, gap=60.0), None, EYE, both)
    assert more.intensity == pytest.approx(found.intensity + 500.0)
    # What has no beam is dark.
    assert len(light_sources(one(Lamp.HIGH_BEAM, heading=np.pi), None, EYE, BEAMS).intensity) == 0


def test_front_fog_lamps_lie_below_the_head_lamps_and_daytime_lamps_are_dimmer_off_their_axis() -> None:
    state = one(Lamp.LOW_BEAM | Lamp.FRONT_FOG, heading=np.pi)
    found = light_sources(state, None, EYE, {Lamp.LOW_BEAM: FLAT, Lamp.FRONT_FOG: FLAT})
    assert len(found.intensity) == 4
    heights = np.sort(found.position[:, 2])
    assert heights[1] < heights[2] - 0.15
    assert heights[0] > 0.5 + 0.2
    ahead = light_sources(one(Lamp.DAYTIME, heading=np.pi, gap=100.0), None, EYE, BEAMS)
    aside = light_sources(one(Lamp.DAYTIME, heading=np.pi - 0.5, gap=100.0), None, EYE, BEAMS)
    assert ahead.intensity == pytest.approx(np.full(2, 600.0), rel=0.03)
    by_lobe = luminous_intensity(SIGNAL_LOBES[SignalLobe.DAYTIME], 0.5, 0.0) / FULL
    assert aside.intensity == pytest.approx(600.0 * by_lobe, rel=0.05)


def test_street_lamps_within_400_m_shine_by_their_angle(motorway: RoadNetwork) -> None:
    heads = np.array([[20.0, 0.0, 8.0], [10.0, 0.0, 8.0], [500.0, 0.0, 8.0], [100.0, 3.0, 8.0]])
    empty = dataclasses.replace(one(Lamp.NONE), lamps=np.zeros(1, np.int32))
    found = light_sources(empty, None, EYE, BEAMS, heads)
    assert len(found.intensity) == 3
    angle = np.arctan2(np.hypot(*(heads[[0, 1, 3], :2]).T), 8.0 - 1.2)
    assert found.intensity == pytest.approx(np.interp(angle, STREET_ANGLES, STREET_INTENSITIES))
    assert np.interp(np.radians(65.0), STREET_ANGLES, STREET_INTENSITIES) == 3000.0
    assert 500.0 <= np.interp(np.radians(82.0), STREET_ANGLES, STREET_INTENSITIES) <= 1000.0
    assert (found.area > 0.01).all()
    above = light_sources(empty, None, (0.0, 0.0, 9.0), BEAMS, heads)
    assert len(above.intensity) == 0
    scene = build_scene(motorway, SignMap(), np.random.default_rng(1), street_lamps=True)
    assert len(light_sources(empty, None, EYE, BEAMS, street_lamp_heads(scene)).intensity) > 5
    heads = np.array([[0.0, 0.0, 8.0]])
    lighting = street_lighting(heads, 0.1)
    below = light_sources(one(Lamp.NONE), None, (0.0, 0.0, 0.0), {}, heads)
    assert np.interp(0.0, lighting.angle, lighting.intensity) == pytest.approx(below.intensity[-1])
    assert np.dot(lighting.colour, (0.2126, 0.7152, 0.0722)) == pytest.approx(1.0)
    assert lighting.sky_illuminance == 0.1
