"""What the ego's camera looks at: the scene of a run, the renderer that draws it, and the air and lamps in it."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import Air, TunnelLight, side_light
from fogsim.camera import CAR, CameraConfig, averaged, middle_samples, supersampled
from fogsim.errors import InputError
from fogsim.lighting import LampMount, own_head_lamps
from fogsim.render import LIMITED, Renderer, RenderError, make_renderer
from fogsim.render.bonnet import Bonnet, with_bonnet
from fogsim.scene import (
    Corridor,
    ScenePlan,
    light_sources,
    road_beams,
    street_lamp_heads,
    street_lighting,
    surroundings,
    traffic_batches,
)
from fogsim.simulation.ego.near_scene import FEW_LANES, NearScene
from fogsim.simulation.run_config import NO_RENDERER, RunConfig, WorldConfig
from fogsim.units import DAY_ILLUMINANCE
from fogsim.values import (
    Batch,
    Camera,
    CameraPose,
    FogField,
    HeadLamp,
    Lamp,
    Lights,
    RoadNetwork,
    Scene,
    SignMap,
    TrafficState,
    View,
)
from fogsim.values.fog import EVEN_LIGHT
from fogsim.values.obstruction import tunnels_of
from fogsim.values.scene import Instance

DARKEST_SKY = 1e-4
"""Illuminance below which no sky under street lamps is taken to be [lx]: that of an overcast night without a moon.

Surfaces reflect street lamps' light as they reflect the sky's, so the sky must give some.
"""

_BEHIND_BUMPER = 0.15
"""Distance of the bonnet's front edge behind the bumper [m]."""

_LEEWAY = 600.0
"""How far the ego may leave its route before the scene is built again around it [m], in a network that is larger."""

_UNLIT = Lights.none()

_USUAL = (Lamp.LOW_BEAM, Lamp.LOW_BEAM | Lamp.FRONT_FOG, Lamp.LOW_BEAM | Lamp.HIGH_BEAM)


class Surrounding(NamedTuple):
    """What is around a camera, in the coordinates of its scene."""

    scene: Scene  # What stands still
    vehicles: Sequence[Batch]  # Every vehicle but the camera's own, persons and traffic lights
    camera: Camera  # The pinhole
    pose: CameraPose  # Where it is
    lights: Lights  # Lit lamps, by night only
    illuminance: float  # Horizontal illuminance of the daylight [lx]


class EgoView(Protocol):
    """What the ego's camera gets."""

    signs: SignMap  # The signs
    fog: FogField  # The fog at the start of a run

    def enter_fog(self, fog: FogField) -> None:
        """Look through another fog; see `ViewRenderer.enter_fog`."""

    def render(
        self,
        state: TrafficState,
        ego: int | None,
        pose: CameraPose,
        time: float,
        camera: Camera | None = None,
        illuminance: float | None = None,
    ) -> tuple[View, NDArray[np.float32] | None]:
        """Draw; see `ViewRenderer.render`. No radiance where there is nothing to be seen."""

    def surrounding(self, state: TrafficState, ego: int, pose: CameraPose) -> Surrounding:
        """What is drawn; see `ViewRenderer.surrounding`."""

    def close(self) -> None:
        """Free what draws; closing twice is allowed."""


class _NoView:
    """A view without a scene, for runs that need no camera: its pictures are black.

    Parameters
    ----------
    world, camera, network, signs, body
        See `ViewRenderer`.

    Attributes
    ----------
    signs, fog
        See `ViewRenderer`.
    """

    def __init__(self, world: WorldConfig, camera: CameraConfig, network: RoadNetwork, signs: SignMap, _: str) -> None:
        self.signs = signs
        self.fog: FogField = world.fog.along(network.route, network.structures)
        size = (camera.camera.height, camera.camera.width)
        empty = np.full(size, np.inf, np.float32), np.zeros(size, np.int32)
        self._view = View(np.zeros((*size, 3), np.float32), *empty)

    def enter_fog(self, fog: FogField) -> None:
        """Look through another fog; see `ViewRenderer.enter_fog`."""
        self.fog = fog

    def render(self, *_: object) -> tuple[View, None]:
        """Draw nothing; see `ViewRenderer.render`."""
        return self._view, None

    def surrounding(self, *_: object) -> Surrounding:
        """Refuse; see `ViewRenderer.surrounding`."""
        raise InputError("renderer: none builds no scene that could be shown; choose another renderer")

    def close(self) -> None:
        """Do nothing: there is nothing to be freed."""


def prepare_lamplight(config: RunConfig) -> None:
    """Compute once a process what every `ViewRenderer` by lamplight needs, whatever its road, before it is needed."""
    camera, setback = config.camera.on(), config.camera.mount().setback
    mount, air = LampMount(), Air(FogField(0.0, airlight=(0.0, 0.0, 0.0)), config.world.fog.droplets)
    lamps = [own_head_lamps(lit, camera.mount_height, setback, mount) for lit in _USUAL]
    air.prepare(supersampled(camera, config.camera.samples), lamps)


class ViewRenderer:
    """The world as the camera on an ego sees it.

    Parameters
    ----------
    world : WorldConfig
        Fog, light, and what is drawn.
    camera : CameraConfig
        The camera.
    network : RoadNetwork
        The roads.
    signs : SignMap
        The signs.
    body : str
        Body kind of the ego.

    Attributes
    ----------
    signs : SignMap
        The signs.
    fog : FogField
        The fog at the start of a run.

    Raises
    ------
    MissingDependencyError
        If the renderer does not work here.
    """

    def __init__(
        self, world: WorldConfig, camera: CameraConfig, network: RoadNetwork, signs: SignMap, body: str = CAR
    ) -> None:
        self.signs = signs
        self._network, self._body = network, body
        self._mount = LampMount()
        self._tunnels = tunnels_of(network.structures)
        self._renderer: Renderer | None = None
        self._unlit_renderer: Renderer | None = None
        self._is_closed = False
        self._look_by(world, camera)
        if self._by_lamplight:
            # In a run frames would wait for lamps that are lit for the first time; a change waits for those in use.
            self._air.prepare(self._drawn_camera, [self._own_lamps(lit) for lit in _USUAL])
        self._plan_scene_along(network.route)

    def change(self, world: WorldConfig, camera: CameraConfig) -> None:
        """Look by another camera, in other fog and light, at the same scene: what stands and who draws it stay."""
        self._look_by(world, camera)
        self._light_scene()
        if self._renderer is not None:
            self._renderer.set_daylight(self._sky, self._sides)

    def _look_by(self, world: WorldConfig, camera: CameraConfig) -> None:
        self.fog: FogField = world.fog.along(self._network.route, self._network.structures)
        self._camera, self._samples = camera.on(self._body), camera.samples
        self._drawn_camera = supersampled(self._camera, self._samples)
        self._setback = camera.mount(self._body).setback
        self._head_lamps: dict[int, tuple[HeadLamp, ...]] = {}
        has_bonnet = camera.has_bonnet and self._body == CAR
        self._bonnet = Bonnet(self._setback - _BEHIND_BUMPER) if has_bonnet else None
        self._world, self._daylight = world, world.illuminance
        # Lamps that were lit in the picture only from a moment on would be a jump in it.
        self._by_lamplight = min(world.darkest, self._daylight) < DAY_ILLUMINANCE
        self._air = Air(self.fog, world.fog.droplets)
        photons = self.fog.ground_albedo is not None
        self._sides = side_light(self.fog, world.fog.droplets) if photons else EVEN_LIGHT

    def _plan_scene_along(self, line: NDArray[np.float64]) -> None:
        """Find out what there is in the scene along a line (n, 3) [m]."""
        world, around = self._world, surroundings(self._network, self.signs, line)
        rng = np.random.default_rng(world.scenery_seed)
        plan = ScenePlan(
            around.network, around.signs, rng, street_lamps=world.has_street_lamps, pavement=world.pavement
        )
        self._origin, self._shifted = around.origin, bool(np.any(around.origin))
        self._known = None if around.whole else Corridor(line, _LEEWAY)
        # Other renderers may draw what is farther away.
        self._near_scene = NearScene(plan, FEW_LANES if world.renderer in LIMITED else plan.lanes)
        self._street_lamps = street_lamp_heads(self._near_scene.scene) + around.origin
        self._light_scene()
        self._free_renderer()
        if self._near_scene.is_whole:
            self._make_renderer()

    def _light_scene(self) -> None:
        """Find out by what light the scene is drawn."""
        self._streets = None
        self._sky = self._sky_of(self._daylight)
        if len(self._street_lamps) and self._by_lamplight:
            self._streets = street_lighting(self._street_lamps, self._sky)
        self._tunnel_light = TunnelLight(self._tunnels, self._sky)

    def _sky_of(self, illuminance: float) -> float:
        """Illuminance of the sky in which the scene is drawn [lx]."""
        return max(illuminance, DARKEST_SKY) if self._by_lamplight or self._tunnels else illuminance

    def _set_daylight(self, illuminance: float) -> None:
        if illuminance == self._daylight:
            return
        self._daylight = illuminance
        self._sky = self._tunnel_light.sky_illuminance = self._sky_of(illuminance)
        self._streets = self._streets and replace(self._streets, sky_illuminance=self._sky)
        if self._renderer is not None:
            self._renderer.set_daylight(self._sky, self._sides)

    def _make_renderer(self) -> Renderer:
        self._free_renderer()
        self._renderer = make_renderer(self._world.renderer, self._near_scene.scene, self._sky)
        self._renderer.set_daylight(self._sky, self._sides)
        return self._renderer

    def _free_renderer(self) -> None:
        for renderer in (self._renderer, self._unlit_renderer):
            if renderer is not None:
                renderer.close()
        self._renderer = self._unlit_renderer = None

    def enter_fog(self, fog: FogField) -> None:
        """Look through another fog from now on."""
        self.fog = self._air.field = fog

    def render(
        self,
        state: TrafficState,
        ego: int | None,
        pose: CameraPose,
        time: float,
        camera: Camera | None = None,
        illuminance: float | None = None,
    ) -> tuple[View, NDArray[np.float32]]:
        """Draw what is there, and what of it reaches the camera through the air (`time` [s], `illuminance` [lx])."""
        self._set_daylight(self._world.illuminance if illuminance is None else illuminance)
        self._go_to(np.array(pose.position) if ego is None else state.position[ego])
        drawn = self._drawn_camera
        if camera is not None and camera != self._camera:
            drawn = supersampled(camera, self._samples)
        lights = self._lights(state, ego, pose)
        near, viewpoint = self._from_origin(state, pose)
        renderer = self._renderer_for(drawn, viewpoint)
        vehicles = traffic_batches(near, ego)
        by_sky = self._with_bonnet(
            renderer.render(vehicles, drawn, viewpoint, lamplight=bool(lights.own)), drawn, ego, self._sky
        )
        view = by_sky
        if self._tunnel_light.is_seen_by(pose):
            own = self._with_bonnet(self._unlit().render(vehicles, drawn, viewpoint), drawn, ego, DARKEST_SKY)
            view = self._tunnel_light.on(by_sky, own.radiance, drawn, pose)
        radiance = self._air.radiance(view, drawn, pose, lights, time, by_sky)
        return middle_samples(view, self._samples), averaged(radiance, self._samples)

    def _with_bonnet(self, view: View, camera: Camera, ego: int | None, illuminance: float) -> View:
        """A drawn view with the ego's bonnet, if it has one, under a sky [lx]."""
        if self._bonnet is None or ego is None:
            return view
        return with_bonnet(view, camera, self._bonnet, Instance.FIRST_VEHICLE + ego, illuminance)

    def surrounding(self, state: TrafficState, ego: int, pose: CameraPose) -> Surrounding:
        """Describe what `render` draws."""
        self._go_to(state.position[ego])
        near, seen_from = self._from_origin(state, pose)
        lights = self._lights(state, ego, pose)
        places = lights.others.position - self._origin
        streets = lights.streets and replace(lights.streets, position=lights.streets.position - self._origin)
        lights = replace(lights, others=replace(lights.others, position=places), streets=streets)
        return Surrounding(
            self._near_scene.whole(), traffic_batches(near, ego), self._camera, seen_from, lights, self._sky
        )

    def _go_to(self, place: NDArray[np.float64]) -> None:
        """See to it that the scene is planned around a place."""
        if self._is_closed:
            raise RenderError("this view renderer is closed; make a new one")
        if self._known is not None and not self._known.contains(place[None, :])[0]:
            self._plan_scene_along(place[None, :])

    def _renderer_for(self, camera: Camera, viewpoint: CameraPose) -> Renderer:
        """The renderer of a scene that has what a camera sees from a viewpoint."""
        has_grown = self._near_scene.reach(camera, viewpoint)
        return self._make_renderer() if has_grown or self._renderer is None else self._renderer

    def _unlit(self) -> Renderer:
        """A renderer of the same scene without the sky's light, which shows what shines by itself."""
        if self._unlit_renderer is None:
            self._unlit_renderer = make_renderer(self._world.renderer, self._near_scene.scene, DARKEST_SKY)
        return self._unlit_renderer

    def _from_origin(self, state: TrafficState, pose: CameraPose) -> tuple[TrafficState, CameraPose]:
        """The traffic and the camera in the coordinates of the scene."""
        if not self._shifted:
            return state, pose
        x, y, z = (np.array(pose.position) - self._origin).tolist()
        signals, persons = state.signals, state.persons
        moved = replace(
            state,
            position=state.position - self._origin,
            pieces=replace(state.pieces, position=state.pieces.position - self._origin),
            signals=replace(signals, position=signals.position - self._origin),
            persons=replace(persons, position=persons.position - self._origin),
        )
        return moved, replace(pose, position=(x, y, z))

    def _lights(self, state: TrafficState, ego: int | None, pose: CameraPose) -> Lights:
        if not self._by_lamplight:
            return _UNLIT
        return Lights(
            own=() if ego is None else self._own_lamps(int(state.lamps[ego])),
            others=light_sources(state, ego, pose.position, self._mount.beams, self._street_lamps),
            streets=self._streets,
            beams=road_beams(state, ego, pose.position, self._mount.beams, self._sky),
        )

    def _own_lamps(self, lit: int) -> tuple[HeadLamp, ...]:
        if lit not in self._head_lamps:
            self._head_lamps[lit] = own_head_lamps(Lamp(lit), self._camera.mount_height, self._setback, self._mount)
        return self._head_lamps[lit]

    def close(self) -> None:
        """Free the renderer; closing twice is allowed."""
        self._free_renderer()
        self._is_closed = True


MakeView = Callable[[WorldConfig, CameraConfig, RoadNetwork, SignMap, str], EgoView]
"""Makes what draws a world for a camera on a body kind."""


def view_of_world(world: WorldConfig, camera: CameraConfig, network: RoadNetwork, signs: SignMap, body: str) -> EgoView:
    """What draws a world, or nothing if no renderer is to."""
    kind = _NoView if world.renderer == NO_RENDERER else ViewRenderer
    return kind(world, camera, network, signs, body)
