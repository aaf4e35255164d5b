"""Airlight by elevation and path: against photon counts, DISORT, conservation and single scattering."""

import math
import platform

import numpy as np
import pytest
from numpy.typing import NDArray

import make_airlight_table
from fogsim.atmosphere import fogged_radiance
from fogsim.atmosphere.fog.koschmieder import daytime_luminance, transmittance
from fogsim.atmosphere.fog.layer_airlight import (
    PATHS,
    layer_table,
    path_means,
    side_light,
    sines,
    slant_airlight,
)
from fogsim.atmosphere.lamps.phase_function import Droplets, phase_function
from fogsim.errors import InputError
from fogsim.render.shading.surfaces import light_share
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, CameraPose, FogBank, FogField, FogPatches, View
from fogsim.values.fog import airlight_share
from tests.atmosphere.tables import read_table

COUNTS = read_table("monte_carlo_airlight.csv")
ALBEDOS = (0.0, 0.1, 0.2, 0.5, 0.8, 1.0)
RHO = 0.1


def field_of(visibility: float, top: float, albedo: float) -> FogField:
    """Fog whose airlight has the level of a ground of illuminance π."""
    level = (airlight_share(albedo),) * 3
    return FogField(extinction_from_visibility(visibility), level, top=top, ground_albedo=albedo)


def seen(field: FogField, eye: float, elevation: float, droplets: str = "moderate_radiation") -> float:
    """Luminance of ground or overcast sky through a layer over ground of illuminance π."""
    slope = math.sin(math.radians(elevation))
    ray_map = np.zeros((3, 3))
    ray_map[:, 2] = (math.cos(math.radians(elevation)), 0.0, slope)
    sky = 3.0 / 7.0 * (1.0 + 2.0 * slope)
    distance, behind = (eye / -slope, field.ground_albedo) if slope < 0 else (math.inf, sky)
    view = View(np.full((1, 1, 3), behind, np.float32), np.full((1, 1), distance, np.float32), np.zeros((1, 1), int))
    return float(fogged_radiance(view, field, (0.0, 0.0, eye), ray_map, droplets)[0, 0, 1])


def test_frames_agree_with_photons() -> None:
    for droplets in ["moderate_radiation", "heavy_advection"]:
        for albedo in ALBEDOS:
            for row in COUNTS[COUNTS["fog"] == droplets]:
                drawn = seen(field_of(row["visibility"], row["top"], albedo), row["eye"], row["elevation"], droplets)
                sky = (1.0 - albedo * row["reflectance"]) / row["transmittance"]
                counted = row["sky"] * sky + albedo * row["ground"]
                noise = 3.0 * math.hypot(sky * row["sky_error"], albedo * row["ground_error"])
                assert abs(drawn - counted) < 0.03 * counted + noise, row


def even_sky(thickness: float, eye: float, albedo: float, droplets: str) -> NDArray[np.float64]:
    """Radiance at an eye under a sky of even luminance, over E / π, at the elevations of the table's lines of sight."""
    table, slopes = layer_table(droplets), sines()
    low = int(np.flatnonzero(table.thickness == thickness)[0])
    at = float(table.reflectance[low])
    by_ground = table.per_albedo[low] + at * table.black[low]
    # Sky and ground of luminance 1 make luminance 1 everywhere.
    source = (1.0 - by_ground) * (1.0 - albedo * at) / (1.0 - at) + albedo * by_ground
    means = path_means(table, source, thickness, eye)
    with np.errstate(divide="ignore"):
        ends = np.where(slopes > 0, thickness - eye, eye) / np.abs(slopes)
    lost = 1.0 - np.exp(-ends)
    scattered = [np.interp(share * (PATHS - 1), np.arange(PATHS), row) for share, row in zip(lost, means, strict=True)]
    behind = np.where(slopes > 0, (1.0 - albedo * at) / (1.0 - at), albedo)
    return np.array(scattered) * lost + behind * (1.0 - lost)


def moments(droplets: Droplets, count: int) -> NDArray[np.float64]:
    """Legendre moments of a phase function."""
    angle = np.linspace(0.0, math.pi, 20_001)
    cosine, weight = np.cos(angle), phase_function(droplets)(angle) * np.sin(angle)
    low, high, found = np.ones_like(cosine), cosine.copy(), []
    for order in range(count):
        found.append(np.sum(weight * low) / np.sum(weight))
        low, high = high, ((2 * order + 3) * cosine * high - (order + 1) * low) / (order + 2)
    return np.array(found)


def disort(thickness: float, eye: float, albedo: float, slopes: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same by DISORT."""
    import nanodisort

    state = nanodisort.DisortState()
    state.nstr, state.nmom, state.nlyr, state.ntau, state.numu, state.nphi = 64, 64, 1, 2, len(slopes), 1
    state.allocate()
    state.usrtau = state.usrang = state.lamber = state.quiet = True
    state.intensity_correction = False
    # A layer that absorbs nothing at all is singular.
    state.dtauc, state.ssalb = np.array([thickness]), np.array([1.0 - 1e-9])
    state.pmom = moments(Droplets.MODERATE_RADIATION, 65).reshape(-1, 1)
    state.utau, state.umu, state.phi = np.array([thickness - eye, thickness]), -slopes[::-1], np.zeros(1)
    state.fbeam, state.umu0, state.fisot, state.albedo = 0.0, 0.5, 1.0, albedo
    state.solve()
    return np.asarray(state.uu[::-1, 0, 0] * math.pi / state.rfldn[1])


@pytest.mark.skipif(platform.machine() != "x86_64", reason="nanodisort comes ready-made for x86-64 alone")
def test_the_table_agrees_with_disort() -> None:
    for layer in [3, 10, 16, 19, 22, 24, 27]:
        for albedo in [0.0, 0.1, 0.5, 1.0]:
            thickness = float(layer_table("moderate_radiation").thickness[layer])
            slopes = sines()
            here = np.flatnonzero(np.abs(slopes) > math.sin(math.radians(0.5)))[::3]  # it takes no more than 64
            for eye in (0.003 * thickness, 0.02 * thickness):
                ours = even_sky(thickness, eye, albedo, "moderate_radiation")[here]
                theirs = disort(thickness, eye, albedo, slopes[here])
                assert np.max(np.abs(ours / theirs - 1.0)[slopes[here] > -0.05]) < (0.02 if thickness > 0.4 else 0.03)
                assert np.max(np.abs(ours - theirs)) < 0.006


def test_light_is_conserved() -> None:
    for droplets in list(Droplets):
        table = layer_table(droplets)
        for thickness in table.thickness[::6]:
            everywhere = even_sky(float(thickness), 0.01 * float(thickness), 1.0, droplets)
            assert everywhere == pytest.approx(1.0, abs=2e-3)


def test_a_thin_layer_scatters_once() -> None:
    droplets = Droplets.HEAVY_RADIATION
    _, _, transmittance, (black, _), _ = make_airlight_table.layer(make_airlight_table.scattering(droplets), 1e-4)
    assert transmittance == pytest.approx(1.0, abs=1e-3)
    angle, turn = np.meshgrid(np.linspace(0, math.pi, 20_001), math.pi * (np.arange(100) + 0.5) / 100, indexing="ij")
    weight = phase_function(droplets)(angle) * np.sin(angle)
    weight /= weight.sum()
    looks = make_airlight_table.LOOKS
    for index in range(0, len(looks), 5):
        slope, flat = math.sin(math.radians(looks[index])), math.cos(math.radians(looks[index]))
        height = slope * np.cos(angle) + flat * np.sin(angle) * np.cos(turn)
        once = np.sum(np.where(height > 0, 3.0 / 7.0 * (1.0 + 2.0 * height), 0.0) * weight)
        assert black[len(black) // 2, len(looks) + index] == pytest.approx(once, rel=0.01)


@pytest.mark.parametrize("layer", [4, 26])
def test_the_table_is_what_its_tool_makes(layer: int) -> None:
    for droplets in (Droplets.HEAVY_ADVECTION, Droplets.MODERATE_RADIATION):
        table = layer_table(droplets)
        matrix, thickness = make_airlight_table.scattering(droplets), float(table.thickness[layer])
        heights, reflectance, transmittance, (black, _), upright = make_airlight_table.layer(matrix, thickness)
        assert table.reflectance[layer] == pytest.approx(reflectance, abs=1e-4)
        assert table.transmittance[layer] == pytest.approx(transmittance, abs=1e-4)
        assert (table.vertical_black[layer], table.vertical_per_albedo[layer]) == pytest.approx(upright, abs=1e-4)
        level = np.interp(thickness * table.place, heights, black[:, len(make_airlight_table.LOOKS)])
        assert table.black[layer, :, len(table.elevation) // 2] == pytest.approx(level, rel=2e-3)


@pytest.mark.parametrize("visibility", [30.0, 100.0, 400.0])
def test_a_black_target_at_the_visibility_has_five_percent_of_contrast(visibility: float) -> None:
    ray_map = np.zeros((3, 3))
    ray_map[0, 2] = 1.0
    for albedo in ALBEDOS:
        field = field_of(visibility, 250.0, albedo)
        seen_at = []
        for distance in (visibility, 1e6):
            view = View(np.zeros((1, 1, 3), np.float32), np.full((1, 1), distance, np.float32), np.zeros((1, 1), int))
            seen_at.append(float(fogged_radiance(view, field, (0.0, 0.0, 1.3), ray_map)[0, 0, 1]))
        assert 1.0 - seen_at[0] / seen_at[1] == pytest.approx(0.05, abs=1e-3)
        if visibility == 100.0:  # the level is that of a horizontal line of sight
            assert seen_at[1] == pytest.approx(airlight_share(albedo), rel=0.02)


def test_transmittance_is_that_of_koschmieder() -> None:
    camera, pose = Camera(32, 24, 30.0, (16, 12), 1.3), CameraPose((0.0, 0.0, 1.3), 0.0)
    distance = np.geomspace(1.0, 300.0, 32 * 24).reshape(24, 32).astype(np.float32)
    view = View(np.zeros((24, 32, 3), np.float32), distance, np.zeros((24, 32), int))
    layer = field_of(100.0, 250.0, RHO)
    even = FogField(layer.extinction, layer.airlight, top=layer.top)
    assert np.array_equal(transmittance(view, layer, camera, pose), transmittance(view, even, camera, pose))
    near = daytime_luminance(view, layer, camera, pose)
    assert np.all(np.diff(near[12, :, 1]) > 0.0)


def test_what_is_no_layer_and_an_eye_above_it_are_refused() -> None:
    for wrong, told in [
        ({"ground_albedo": 1.2}, "albedo of the ground must lie within 0 … 1, got 1.2"),
        ({"ground_albedo": math.nan}, "ground_albedo must be a number, finite or nothing, got nan"),
        ({"ground_albedo": RHO, "top": math.inf}, "even layer of fog on flat land, not with no top"),
        ({"ground_albedo": RHO, "banks": (FogBank((0, 0), (1, 0), 0, 50, 10, 0.1),)}, "not with banks"),
        ({"ground_albedo": RHO, "patches": FogPatches(20, 5, 0.3)}, "not with patches"),
    ]:
        with pytest.raises(InputError, match=told):
            FogField(0.03, (1.0, 1.0, 1.0), **({"top": 250.0} | wrong))
    with pytest.raises(InputError, match=r"the eye, 1.3 m above the lowest road, is above the fog, whose top is 1 m"):
        slant_airlight(field_of(100.0, 1.0, RHO), 1.3, "moderate_radiation")
    with pytest.raises(InputError, match=r"optical thickness up to 100, got 149.8"):
        slant_airlight(field_of(5.0, 250.0, RHO), 1.3, "moderate_radiation")


def test_surfaces_get_the_light_of_what_they_see() -> None:
    """Against the radiance of drawn lines of sight, over all that is before a surface tilted up from the vertical."""
    for visibility, albedo in [(50.0, 0.0), (100.0, 0.1), (100.0, 0.8), (400.0, 0.1), (400.0, 1.0)]:
        for tilt in [0, 30, 60]:
            field, elevation = field_of(visibility, 250.0, albedo), np.radians(np.arange(-89.5, 90.0))
            light = [seen(field, 0.02, math.degrees(one)) if one > 0 else albedo for one in elevation.tolist()]
            up, turn = math.sin(math.radians(tilt)), np.radians(np.arange(0.5, 360.0))
            facing = np.outer(np.sin(elevation), up + 0.0 * turn)
            facing += np.outer(np.cos(elevation), math.cos(math.radians(tilt)) * np.cos(turn))
            weight = np.maximum(facing, 0.0) * np.cos(elevation)[:, None]
            expected = float((np.array(light)[:, None] * weight).sum() / weight.sum())
            sides = side_light(field, "moderate_radiation")
            # The sky's brightness does not go by the square of the tilt alone.
            assert light_share(0.0, 0.0, up, *sides) == pytest.approx(expected, rel=0.02 if tilt == 0 else 0.06)
