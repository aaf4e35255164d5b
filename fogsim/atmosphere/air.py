"""The air between a scene and a camera: what fog and lamplight make of a drawn view."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.koschmieder import daytime_luminance, transmittance
from fogsim.atmosphere.fog.medium import field_at
from fogsim.atmosphere.lamps.halos import Halos
from fogsim.atmosphere.lamps.lamplight import OwnLamplight
from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.atmosphere.lamps.road_glow import RoadGlow, glow_of_beams
from fogsim.atmosphere.surfaces.road_beams import TrafficLight
from fogsim.atmosphere.surfaces.streetlight import StreetLight
from fogsim.values import Camera, CameraPose, FogField, HeadLamp, Lights, View
from fogsim.values.light import joined_sources

_UNLIT = Lights.none()


class Air:
    """The fog of a scenario, as a camera looks through it.

    The luminance at the camera is L = (L₀ (1 + E_street / E_sky) + R E_own) T + S: the drawn luminance L₀, to which
    surfaces add of street lamps' light what they return of the sky's, and what they return of the own lamps' light
    (their response R times the illuminance E_own that reaches them), attenuated by T = e^(−τ), and the light S that the
    fog scatters into the line of sight (airlight by day, the lamps' veil and halos at night).

    Parameters
    ----------
    field : FogField
        The fog.
    droplets : Droplets
        Sizes of its droplets, which set how light is scattered.

    Attributes
    ----------
    field : FogField
        The fog; another one from when it is set.
    """

    def __init__(self, field: FogField, droplets: Droplets = Droplets.MODERATE_RADIATION) -> None:
        self.field, self._droplets = field, droplets
        self._own, self._halos, self._streets = OwnLamplight(droplets), Halos(droplets), StreetLight()
        self._traffic = TrafficLight()
        self._road = RoadGlow()

    def prepare(self, camera: Camera, lamps: Sequence[tuple[HeadLamp, ...]]) -> None:
        """Compute beforehand what depends on lamps alone, which else takes the time of many frames when first lit.

        Parameters
        ----------
        camera : Camera
            The camera that will look.
        lamps : sequence of tuple of HeadLamp
            Sets of own lamps that may be lit.

        Raises
        ------
        InputError
            If the beam of a lamp has holes.
        """
        self._halos.prepare(camera)
        for lit in lamps:
            self._own.prepare(camera, lit)

    def radiance(
        self,
        view: View,
        camera: Camera,
        pose: CameraPose,
        lights: Lights = _UNLIT,
        time: float = 0.0,
        by_sky: View | None = None,
    ) -> NDArray[np.float32]:
        """Luminance that reaches a camera.

        Parameters
        ----------
        view : View
            The scene without air: linear luminance per channel [cd/m²] and distance along the ray [m].
        camera : Camera
            Its true calibration.
        pose : CameraPose
            Where it is.
        lights : Lights
            Lit lamps.
        time : float
            Time since the run began [s], for fog that drifts or changes.
        by_sky : View or None
            The scene in the sky's light everywhere, where `view` is lit otherwise, as in tunnels.

        Returns
        -------
        (rows, cols, 3) float32
            Linear luminance per channel at the camera [cd/m²].

        Raises
        ------
        InputError
            If the beam of a lit lamp has holes.
        """
        field = field_at(self.field, time)
        by_sky, lit = by_sky or view, view
        with_lamps = []
        if lights.streets is not None:
            with_lamps.append(self._streets.on(by_sky, camera, pose, field, lights.streets))
        if lights.beams is not None:
            with_lamps.append(self._traffic.on(by_sky, camera, pose, field, lights.beams))
        for one in with_lamps:
            # Each adds to the sky's light alone.
            lit = one if lit is by_sky else replace(lit, radiance=lit.radiance + (one.radiance - by_sky.radiance))
        radiance = daytime_luminance(lit, field, camera, pose, self._droplets)
        if lights.own:
            self._own.add(radiance, view, camera, pose, field, lights.own)
        shining, has_fog = [lights.others], field.extinction > 0 or bool(field.banks)
        if lights.own and has_fog:
            shining.append(self._road.sources(lights.own, camera, pose, field))
        if lights.beams is not None and has_fog:
            shining.append(glow_of_beams(lights.beams, pose, field))
        if any(len(one.intensity) for one in shining):
            self._halos.add(radiance, view, camera, pose, field, joined_sources(shining))
        return radiance

    def transmittance(self, view: View, camera: Camera, pose: CameraPose, time: float = 0.0) -> NDArray[np.float32]:
        """Transmittance T = e^(−τ) up to what each pixel shows.

        Parameters
        ----------
        view, camera, pose, time
            As in `radiance`.

        Returns
        -------
        (rows, cols) float32
            0 … 1; for the sky, that of the whole path to the fog's end.
        """
        return transmittance(view, field_at(self.field, time), camera, pose)
