"""Asphalt by the angle at which it is seen, and along the road: the model, its table, and what renderers draw."""

import dataclasses
import math

import numpy as np
import pytest

import make_road_reflectance as model
from fogsim.render import make_renderer
from fogsim.render.shading.pavement import PERIOD, asphalt, mean_of_stretches, reflectance_at, reflectance_by_sine
from fogsim.scenario import build, load_scenario
from fogsim.values import CameraPose, Pavement, RoadSurface, Scene, View
from tests.render.conftest import Place, camera, rays
from tests.render.test_cpu import ILLUMINANCE, road

REAL = [surface for surface in RoadSurface if surface is not RoadSurface.LAMBERTIAN]
CAMERA = camera(640, 480)


def view(pavement: Pavement, pose: CameraPose, lines: int = 0, pitch: float | None = None) -> View:
    seen_by = CAMERA if pitch is None else dataclasses.replace(CAMERA, pitch=pitch)
    return make_renderer("cpu", Scene(road(lines), {}, (), pavement), ILLUMINANCE).render((), seen_by, pose)


@pytest.mark.parametrize(("q0", "s1"), [(0.1, 0.25), (0.07, 0.58), (0.07, 1.11), (0.08, 1.55)])
def test_the_model_has_the_measures_of_cies_standard_surfaces(q0: float, s1: float) -> None:
    made = model.of_standard(q0, s1)
    assert model.lamp_measures(made) == pytest.approx((q0, s1), rel=1e-4)
    # What was not fitted: the albedo of asphalt (R1 is concrete or brightened), and that it falls with the angle.
    angles = np.radians([0.5, 1.0, 2.3, 5.0, 10.0, 20.0, 45.0, 89.9])
    reflectance = [made.reflectance(float(angle)) for angle in angles]
    assert np.all(np.diff(reflectance) < 0.0)
    assert reflectance[-1] == pytest.approx(0.2 if q0 == 0.1 else 0.085, abs=0.02)


def test_the_model_has_its_limits() -> None:
    # A smooth surface mirrors as Fresnel has it (4 % of n = 1.5 from above); no surface gives more than it gets.
    smooth = model.Road(0.0, 0.02)
    assert float(model.fresnel(np.array(1.0), 1.5)) == pytest.approx(0.04)
    assert smooth.reflectance(math.radians(30.0)) == pytest.approx(float(model.fresnel(np.array(0.5), 1.5)), rel=0.02)
    for roughness in (0.1, 0.3, 1.0):
        for angle in (0.3, 3.0, 30.0, 90.0):
            assert 0.0 < model.Road(0.0, roughness).reflectance(math.radians(angle) - 1e-6) < 1.0


@pytest.mark.parametrize("surface", REAL)
def test_the_table_is_the_models(surface: RoadSurface) -> None:
    made = {name: one for name, _, one in model.roads()}
    above = made["dry"].reflectance(model.ABOVE)
    for angle in (0.1, 0.7, 1.0, 3.3, 8.0, 21.0, 60.0):
        ratio = made[surface].reflectance(math.radians(angle)) / above
        seen = reflectance_at(reflectance_by_sine(surface), math.sin(math.radians(angle)))
        assert seen == pytest.approx(ratio, rel=0.003)
    assert reflectance_at(reflectance_by_sine(RoadSurface.LAMBERTIAN), 0.3) == 1.0


def test_the_road_is_as_bright_as_the_angle_has_it() -> None:
    for pitch in [0.03, 0.5]:
        for pose in [CameraPose((0.0, 0.0, 1.38), 0.0), CameraPose((0.0, 3.0, 2.6), 0.3)]:
            for surface in REAL:
                plain, real = (view(Pavement(one), pose, pitch=pitch) for one in (RoadSurface.LAMBERTIAN, surface))
                ray = rays(dataclasses.replace(CAMERA, pitch=pitch), pose)
                sine = -ray[..., 2] / np.linalg.norm(ray, axis=-1)
                paved = plain.instance == 2
                table = reflectance_by_sine(surface)
                expected = np.interp(np.sqrt(np.maximum(sine, 0.0)), np.linspace(0.0, 1.0, len(table)), table)[paved]
                assert np.allclose(real.radiance[paved] / plain.radiance[paved], expected[:, None], rtol=0.003)
                assert np.array_equal(real.radiance[~paved], plain.radiance[~paved])


def test_paint_keeps_its_own_reflectance() -> None:
    pose = CameraPose((0.0, 0.0, 1.38), 0.0)
    plain, wet = (view(Pavement(one), pose, lines=4) for one in (RoadSurface.LAMBERTIAN, RoadSurface.WET))
    paint = (plain.instance == 2) & (plain.radiance[..., 1] > 0.59 * ILLUMINANCE / math.pi)
    assert paint.sum() > 100
    assert np.allclose(wet.radiance[paint], plain.radiance[paint], rtol=0.01)


def test_stretches_keep_the_mean_and_have_their_deviation_at_any_distance() -> None:
    integral = asphalt(Pavement(repairs=0.1)).stretches
    metres = np.array([mean_of_stretches(integral, one + 0.5, 1.0) for one in range(PERIOD)])
    assert metres.mean() == pytest.approx(0.0, abs=1e-9)
    assert metres.std() == pytest.approx(1.0)
    for start, extent in ((3.25, 40.0), (PERIOD - 10.0, 50.0), (-7.0, 200.0)):
        fine = start + extent * (np.arange(20_000) + 0.5) / 20_000 - 0.5 * extent
        mean = metres[np.floor(fine).astype(int) % PERIOD].mean()
        assert mean_of_stretches(integral, start, extent) == pytest.approx(mean, abs=2e-3)
    pose = CameraPose((0.0, 0.0, 1.38), 0.0)
    plain, mended = (view(Pavement(repairs=one), pose) for one in (0.0, 0.1))
    row = 300
    ratio = mended.radiance[row, 320, 1] / plain.radiance[row, 320, 1]
    ahead = plain.distance[row, 320] * math.cos(math.asin(1.38 / plain.distance[row, 320]))
    assert ratio == pytest.approx(1.0 + 0.1 * mean_of_stretches(integral, ahead, 0.3), abs=0.01)


def test_all_renderers_draw_the_same_road(place: Place) -> None:
    scene = Scene(place.scene.ground, {}, (), Pavement(RoadSurface.WET, repairs=0.0))
    made = {name: make_renderer(name, scene, ILLUMINANCE) for name in ("cpu", "opengl", "pyrender")}
    views = {name: one.render((), CAMERA, place.pose) for name, one in made.items()}
    for one in made.values():
        one.close()
    cpu, opengl, reference = (views[name] for name in ("cpu", "opengl", "pyrender"))
    difference = np.abs(cpu.radiance - opengl.radiance)
    assert np.mean(np.all(difference <= 0.01 * cpu.radiance + 1.0, axis=-1)) >= 0.99
    paved = (cpu.instance == 2) & (reference.instance == 2)
    for rows in (slice(245, 260), slice(300, 320), slice(420, 440)):
        part = np.zeros_like(paved)
        part[rows] = paved[rows]
        assert np.median(reference.radiance[part] / cpu.radiance[part]) == pytest.approx(1.0, abs=0.04)


def test_a_scenario_says_what_its_roads_are_like() -> None:
    usual = load_scenario("motorway_fog_bank")
    assert build.world_config(usual).pavement == Pavement()
    wet = load_scenario("motorway_fog_bank", ["pavement={surface: wet, wheel_tracks: -0.1, repairs: 0.05}"])
    assert build.world_config(wet).pavement == Pavement(RoadSurface.WET, -0.1, 0.05)
