"""Night pictures without traffic: a flat road by own lamps in fog, with noise, as a camera has them."""

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import Air
from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.calibration.veil_references import flat_road
from fogsim.lighting import own_head_lamps
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, CameraPose, FogField, Lamp, Lights, LightSources
from fogsim.values.camera import Response
from fogsim.values.camera_response import respond

CAMERA = Camera(160, 120, 144.0, (79.5, 59.5), 1.38, pitch=0.035, response=Response.SRGB)
SETBACK = 1.7


def night_picture(
    visibility: float,
    *,
    camera: Camera = CAMERA,
    lamps: Lamp = Lamp.LOW_BEAM,
    asphalt: float = 0.013,
    droplets: Droplets = Droplets.MODERATE_RADIATION,
    saturation: float = 2.5,
    noise: float = 0.002,
    daylight: float = 0.0,
    seed: int = 1,
) -> NDArray[np.uint8]:
    """(rows, cols, 3) uint8: the road by night.

    Light that fills the sensor is ``saturation`` [cd/m²], ``noise`` a share of it, and ``daylight`` the sky's luminance
    [cd/m²], of which the road shows a tenth.
    """
    pose = CameraPose((0.0, 0.0, camera.mount_height), 0.0)
    view = flat_road(camera, pose, asphalt)
    sky = np.isinf(view.distance)
    view.radiance[sky] = daylight
    view.radiance[~sky] = 0.1 * daylight
    air = Air(FogField(extinction_from_visibility(visibility), (daylight,) * 3), droplets)
    lit = Lights(own_head_lamps(lamps, camera.mount_height, SETBACK), LightSources.none())
    light = air.radiance(view, camera, pose, lit).astype(np.float64) / saturation
    light += noise * np.random.default_rng(seed).standard_normal(light.shape)
    return np.round(255 * respond(np.clip(light, 0.0, 1.0), camera.response, camera.black_level)).astype(np.uint8)
