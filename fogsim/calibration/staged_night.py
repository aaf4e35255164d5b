"""Staged scenes by night: a straight road with signs and lane marks, lamps along it, vehicles with theirs."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import Air
from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.calibration.sign_calibration import sign_beside
from fogsim.calibration.staged_road import StagedVehicle, staged_traffic, straight_road
from fogsim.camera.exposure import AutoExposure, Metering, Pixels, Sensor, expose, metered_luminance, sensor_at
from fogsim.camera.exposure import wanted_saturation as saturation_for
from fogsim.camera.glare import LensGlare
from fogsim.lighting import LampMount, own_head_lamps
from fogsim.render import Renderer, make_renderer
from fogsim.scene import build_scene, light_sources, street_lamp_heads, street_lighting, vehicle_batches
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, CameraPose, FogField, Lamp, Lights, LightSources, SignMap, TrafficState

SETBACK = 1.7
"""Distance of the camera behind the front bumper [m]."""

DARK = 1e-4
"""Horizontal illuminance of the sky: an overcast night without a moon [lx]."""

_CLEAR = 1e-6
"""Extinction coefficient of a clear night [1/m]."""

_AUTOMATIC = AutoExposure(Metering.HIGHLIGHTS, 0.6, 0.0, 1e5, 100.0, 4.0)
"""As scenarios have it, but that it follows at once."""

GLARE = 0.01
"""Share of lamps' light that the lens scatters; the default of a scenario's camera [-]."""

_SIGNS_APART = 70.0
_ROAD = 2
"""What a view's pixels have where they show the road."""

_FAR = 1200.0
_CAR = StagedVehicle()


@dataclass(frozen=True, slots=True)
class NightVehicle:
    """A vehicle with its lamps lit."""

    distance: float  # From the camera to its end that is nearer [m]
    left: float = 0.0  # How far its middle is left of the camera [m]
    lamps: Lamp = Lamp.POSITION | Lamp.LOW_BEAM  # What is lit
    oncoming: bool = False  # Whether it comes toward the camera
    vehicle: StagedVehicle = _CAR  # What it is


@dataclass(frozen=True, slots=True)
class NightScene:
    """What there is at one instant."""

    place: float = 0.0  # Where along the road the camera is [m]
    vehicles: tuple[NightVehicle, ...] = ()  # Others on the road
    street_lamps: bool = False  # Whether street lamps are lit
    own: Lamp = Lamp.POSITION | Lamp.LOW_BEAM  # Lit lamps of the vehicle that carries the camera
    strength: float = 1.0  # Intensity of all other lamps over the usual one [-]
    pavement: float = 1.0  # What the road returns of the own lamps' light, over what dry asphalt does [-]


class NightRoad:
    """A straight road by night, as a camera sees it."""

    def __init__(
        self, camera: Camera, droplets: Droplets = Droplets.MODERATE_RADIATION, glare: float = GLARE, seed: int = 0
    ) -> None:
        rng = np.random.default_rng(seed)
        places = np.arange(30.0, _FAR, _SIGNS_APART)
        signs = SignMap(tuple(sign_beside(f"s{x:.0f}", "speed_limit", float(x), 0.7, rng) for x in places))
        self.camera, self._glare = camera, LensGlare(camera, glare) if glare > 0 else None
        self._signs, self._seed = signs, seed
        self._drawn: dict[bool, tuple[Renderer, NDArray[np.float64]]] = {}
        self._air = Air(FogField(_CLEAR, (0.0, 0.0, 0.0)), droplets)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        for renderer, _ in self._drawn.values():
            renderer.close()

    def _scene(self, lit: bool) -> tuple[Renderer, NDArray[np.float64]]:
        """What draws the road with or without street lamps, and where these shine (n, 3) [m]."""
        if lit not in self._drawn:
            trees = np.random.default_rng(self._seed)
            scene = build_scene(straight_road(_FAR), self._signs, trees, street_lamps=lit)
            self._drawn[lit] = make_renderer("cpu", scene, illuminance=DARK), street_lamp_heads(scene)
        return self._drawn[lit]

    def radiances(self, scene: NightScene, visibilities: Sequence[float]) -> list[NDArray[np.float32]]:
        """Radiance at the camera in fog of each visibility [m], ``inf`` for clear air: (rows, cols, 3) [cd/m²]."""
        camera, lit = self.camera, scene.street_lamps
        renderer, heads = self._scene(lit)
        pose = CameraPose((scene.place, 0.0, camera.mount_height), heading=0.0)
        traffic = _traffic(scene)
        view = renderer.render(vehicle_batches(traffic, None), camera, pose, lamplight=True)
        if scene.pavement != 1.0 and view.lamp_response is not None:
            view.lamp_response[view.instance == _ROAD] *= np.float32(scene.pavement)
        mount = LampMount()
        others = light_sources(traffic, None, pose.position, mount.beams, heads if lit else None)
        streets = street_lighting(heads, DARK) if lit else None
        own = own_head_lamps(scene.own, camera.mount_height, SETBACK, mount)
        lights = Lights(own, _scaled(others, scene.strength), streets)
        out = []
        for visibility in visibilities:
            self._air.field = FogField(max(extinction_from_visibility(visibility), _CLEAR), (1e-5, 1e-5, 1e-5))
            out.append(self._air.radiance(view, camera, pose, lights))
        return out

    def photograph(self, radiance: NDArray[np.float32], exposure: float, rng: np.random.Generator) -> Pixels:
        """Take a picture of a radiance [cd/m²] at an exposure relative to the automatic one [-]."""
        saturation = saturation_for(metered_luminance(radiance, _AUTOMATIC.metering), _AUTOMATIC) / exposure
        sensor = Sensor(saturation, bits=self.camera.bits, black_level=self.camera.black_level)
        sensor = sensor_at(sensor, saturation, _AUTOMATIC)
        light = radiance if self._glare is None else self._glare.scatter(radiance, saturation)
        return expose(light, sensor, self.camera.response, rng)


def _traffic(scene: NightScene) -> TrafficState:
    standing = [
        (scene.place + one.distance, replace(one.vehicle, left=one.left, name=f"vehicle {number}"))
        for number, one in enumerate(scene.vehicles)
    ]
    state = staged_traffic(standing)
    position = state.position.copy()
    turned = np.array([one.oncoming for one in scene.vehicles], dtype=bool)
    # A vehicle's place is its front bumper's: of one that comes toward the camera, that of its nearer end.
    position[turned, 0] -= state.length[turned]
    lamps = np.array([int(one.lamps) for one in scene.vehicles], np.int32)
    return replace(state, position=position, heading=np.where(turned, np.pi, 0.0), lamps=lamps)


def _scaled(sources: LightSources, strength: float) -> LightSources:
    lobes = sources.lobes and replace(sources.lobes, scale=sources.lobes.scale * strength)
    return replace(sources, intensity=sources.intensity * strength, lobes=lobes)
