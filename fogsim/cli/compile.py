"""``fogsim compile``: compile kernels before the first run, in parallel processes."""

import dataclasses
import logging
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from itertools import islice
from typing import TYPE_CHECKING, Any

from fogsim.cli.printing import stderr, stdout
from fogsim.errors import FogSimError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from fogsim.estimators import Estimator
    from fogsim.values import Camera, Estimate

_SIZES = ((160, 120), (640, 480))
"""Sizes of images for the estimators, which choose algorithms by size [px]."""

_FEW = "estimators=[{method: negru2013, parameters: {as_published: true}}]"
"""Settings that need few kernels."""

_JOINT = "estimators=[joint_road]"
"""Estimator with kernels that the images below do not use, for other roads and fogs."""

_DRIVES: dict[str, tuple[str, tuple[tuple[str, ...], ...]]] = {
    "drives by day": (
        "motorway_fog_bank",
        (("end_when=lead.position > 5 km",), ("fog={visibility_m: 100, airlight: photons}",)),
    ),
    "drives by night": (
        "night_motorway_fog",
        ((), ("street_lamps=true", "fog.patches={correlation_length_m: 20}", "camera.lens_glare=0.05")),
    ),
    "drives in patches of fog": (
        "motorway_fog_bank",
        (("camera.samples=2", "fog.patches={correlation_length_m: 20}", "fog.forward_scatter=0.1", _JOINT),),
    ),
    "drives out of a tunnel": ("tunnel_exit_into_fog", ((_JOINT,),)),
    "drives on a clear day": ("clear_day", ((_JOINT,),)),
    "drives in a city": ("city_fog", ((),)),
    "drives in shallow fog": ("ground_fog_under_clear_sky", ((_JOINT,),)),
    "drives below lifted fog": ("lifted_fog", ((_JOINT,),)),
    "drives with a camera that fails": ("camera_blackout", ((_JOINT,),)),
}
"""Scenario, and settings of its consecutive drives, since other settings use other kernels."""

_FRAMES = 10
"""Frames of each drive."""

_SHADE = 0.4
"""Share of the light that a shadow on the road leaves in one of those images [-]."""

_SKY = 1e6
"""Distance of the sky in those images [m]."""

_EVEN, BANK = (120.0, _SKY), (600.0, 60.0)
"""Visibility in those images, and where a bank of fog begins [m]."""


def compile_command() -> None:
    """Compile the kernels of a first run in advance, and cache them on disk."""
    with stderr.status("compiling for this processor, about a minute"):
        for ready in compile_kernels():
            stdout.print(f"compiled: {ready}")


def compile_kernels() -> Iterator[str]:
    """Compile and cache the kernels of drives by day and by night; yield a description of each finished part."""
    try:
        yield from _compiled()
    except BrokenProcessPool as error:
        raise FogSimError(
            "a process that compiles died, as when memory runs out; the same command compiles what is missing"
        ) from error


def _compiled() -> Iterator[str]:
    from fogsim.core.jit import processors
    from fogsim.study.pool import worker_pool

    with worker_pool(min(2, processors()), __name__) as pool:
        # Estimators share hardly any kernels with rendering; the other drives share many with the first.
        first, *others = _DRIVES
        pending: dict[Future[None], str] = {
            pool.submit(_quietly, _drive, *_DRIVES[first]): first,
            pool.submit(_quietly, _estimate_visibility): "estimators",
            pool.submit(_quietly, _detect_signs): "signs",
            pool.submit(_quietly, _find_lamps): "lamps",
            pool.submit(_quietly, read_own_beams): "methods of the night",
            pool.submit(_quietly, _light_a_road): "head lamps on the road",
            pool.submit(_quietly, _cross_a_footway): "footways",
            pool.submit(_quietly, _restore_contrast): "contrast restoration",
        }
        while pending:
            for done in wait(pending, return_when=FIRST_COMPLETED).done:
                done.result()
                ready = pending.pop(done)
                if ready == first:
                    pending |= {pool.submit(_quietly, _drive, *_DRIVES[name]): name for name in others}
                yield ready


def _quietly(work: Callable[..., None], *arguments: Any) -> None:
    """Do work in a process that does not announce its own compilation."""
    logging.getLogger("fogsim").setLevel(logging.ERROR)
    work(*arguments)


def _drive(scenario: str, drives: Sequence[Sequence[str]]) -> None:
    """Render the first frames of a scenario with each of the settings, all vehicles in one junction for its metrics."""
    from fogsim.metrics import RunMetrics
    from fogsim.scenario import load_scenario
    from fogsim.simulation.loop import run

    for overrides in drives:
        metrics = RunMetrics()
        for step in islice(run(load_scenario(scenario, ["expect={}", _FEW, *overrides]), seed=1), _FRAMES):
            lane = (":junction_0_0",) * len(step.traffic.lane)
            metrics.update(dataclasses.replace(step, traffic=dataclasses.replace(step.traffic, lane=lane, course=lane)))
        metrics.summary()


def _estimate_visibility() -> None:
    """Run every daytime method, also as published, on images of a foggy road with a vehicle ahead that leaves."""
    import numpy as np

    from fogsim.core.parameters import accepted_parameters
    from fogsim.estimators import ESTIMATORS
    from fogsim.estimators.lead_contrast import fit_decay
    from fogsim.fusion import FUSIONS
    from fogsim.vision.uneven.uneven_kernels import denser_part, path_depths

    estimates: list[list[Estimate]] = []
    for size in _SIZES:
        camera = _camera(size)
        for factory in ESTIMATORS.values():
            published = [{"as_published": True}] if "as_published" in accepted_parameters(factory) else []
            for parameters in ({}, *published):
                estimates.append(_read(factory(camera=camera, **parameters), camera))
                _read(factory(camera=camera, **parameters), camera, BANK)
    for fusion in FUSIONS:
        fuse_estimates(fusion, {}, estimates)
    follow_a_bend(size)
    # Cases that need more than these images: a vehicle ahead that leaves far enough, and fog that varies for certain.
    fit_decay(np.array([20.0, 40.0, 60.0]), np.array([0.5, 0.3, 0.2]), np.full(3, 0.01), 0.02, 0.01)
    solved = (np.array([10.0, 100.0]), np.full(5, math.log(0.03)), np.eye(5))
    path_depths(*solved, np.array([20.0, 40.0]), 50.0)
    denser_part(*solved, 50.0)


def read_foggy_road(
    method: str, parameters: Mapping[str, Any], size: Sequence[int], fog: tuple[float, float] = _EVEN
) -> "list[Estimate]":
    """Estimates of a method from synthetic images of a foggy road by day, of a width and height [px]."""
    from fogsim.estimators import ESTIMATORS

    camera = _camera(size)
    return _read(ESTIMATORS[method](camera=camera, **parameters), camera, fog)


def fuse_estimates(fusion: str, parameters: Mapping[str, Any], estimates: "Sequence[Sequence[Estimate]]") -> None:
    """Pass each method's estimates to a fusion, image by image."""
    from fogsim.fusion import DatedFusion, make

    chosen = DatedFusion(make(fusion, **parameters))
    for number, instant in enumerate(zip(*estimates, strict=True)):
        chosen.update_at(instant, 0.1 * number, 10.0 * number)


def _restore_contrast() -> None:
    """Restore images of a foggy road with 8 and 16 bits, also with tone mapping."""
    import numpy as np

    from fogsim.vision.restoration import METHODS, restore_contrast

    camera = _camera(_SIZES[0])
    image = _foggy_road(camera, 25.0)
    for seen in (image, image.astype(np.uint16) * 257):
        for method in METHODS:
            restore_contrast(seen, camera, 0.03, method=method, tone_map=True)


def follow_a_bend(size: Sequence[int]) -> None:
    """Lay strips along a road with curves and sags, unlike that of the images, of a width and height [px]."""
    import numpy as np

    from fogsim.vision.lines.horizon import Horizon
    from fogsim.vision.lines.road_course import unseen_course
    from fogsim.vision.lines.road_course_kernels import PIECES
    from fogsim.vision.strips.course_geometry import course_geometry
    from fogsim.vision.strips.strip_geometry import strip_geometry

    camera, curved = _camera(size), np.full(PIECES, 1e-4)
    course = dataclasses.replace(unseen_course(camera, Horizon(camera.horizon_row, 0.3)), sag=curved, bend=curved)
    course_geometry(strip_geometry(camera, 1.0), camera, course)


def _camera(size: Sequence[int]) -> "Camera":
    from fogsim.values import Camera

    width, height = size
    return Camera(width, height, 0.9 * width, (width / 2, height / 2), 1.4, pitch=0.03)


def _read(estimator: "Estimator", camera: "Camera", fog: tuple[float, float] = _EVEN) -> "list[Estimate]":
    """Run a method on images in colour, the first with shadows, and, finally, in grey."""
    import numpy as np

    from fogsim.values import Frame, LeadMeasurement, Observation

    estimates = []
    for index in range(4):
        distance = 25.0 + 5.0 * index
        image = _foggy_road(camera, distance, fog, 1.0 if index else _SHADE)
        frame = Frame(0.1 * index, image if index < 3 else np.ascontiguousarray(image[:, :, 0]), camera)
        estimates.append(estimator.update(Observation(frame, 20.0, LeadMeasurement(distance, 5.0), ())))
    return estimates


def read_own_beams() -> None:
    """Run night methods on images of a lit road, in colour and in grey."""
    import numpy as np

    from fogsim.estimators import make
    from fogsim.values import Camera, Lamp, Observation

    camera = Camera(160, 120, 144.0, (80.0, 60.0), 1.4, pitch=0.03)
    lit = np.repeat(np.linspace(10, 120, 120).astype(np.uint8)[:, None], 160, axis=1)
    estimator = make("night_road", camera)
    for image in (np.repeat(lit[:, :, None], 3, axis=2), lit):
        estimator.update(Observation(image, lamps=Lamp.LOW_BEAM))


def _detect_signs() -> None:
    """Search for a sign in images in grey, in colour, with more bits, and of light."""
    import numpy as np

    from fogsim.vision.symmetry.detection import SearchRegion, detect_signs

    rows, cols = np.mgrid[:120, :160]
    picture = np.where(np.hypot(rows - 60, cols - 80) < 24.0, 90, 180).astype(np.uint8)
    for image in (
        picture,
        np.repeat(picture[:, :, None], 3, axis=2),
        picture.astype(np.uint16),
        picture.astype(np.float32),
    ):
        detect_signs(image, [SearchRegion(80.0, 60.0, 8.0, 8.0, 24.0)])


def _find_lamps() -> None:
    """Search for the halo of a lamp in images with 8 bits and with more."""
    import numpy as np

    from fogsim.estimators.night.halos import HaloWatch

    rows, cols = np.mgrid[:120, :160]
    level = 255.0 * np.exp(-np.maximum(np.hypot(rows - 60, cols - 80) - 4.0, 0.0) / 8.0)
    for image, bits in ((level.astype(np.uint8), 8), ((16.0 * level).astype(np.uint16), 12)):
        HaloWatch().look(image, bits)


def _light_a_road() -> None:
    """Light a wall in fog by another vehicle's head lamps, since such a vehicle may appear late in a drive."""
    import numpy as np

    from fogsim.atmosphere import Air
    from fogsim.lighting.beams import low_beam
    from fogsim.values import Camera, CameraPose, FogField, Lights, LightSources, View
    from fogsim.values.light import RoadBeams

    camera = Camera(160, 120, 144.0, (80.0, 60.0), 1.4, pitch=0.03)
    far = np.full((120, 160), 30.0, np.float32), np.zeros((120, 160), np.int32)
    place, one = np.array([[20.0, 0.0, 0.65]]), np.ones(1)
    beams = RoadBeams(place, 0.0 * one, 0.0 * one, 0.65 * one, (low_beam(),), np.zeros(1, np.int64), one, 0.1)
    air = Air(FogField(0.03, airlight=(0.0, 0.0, 0.0)))
    view = View(np.full((120, 160, 3), 0.01, np.float32), *far)
    air.radiance(view, camera, CameraPose((0.0, 0.0, 1.4), 0.0), Lights((), LightSources.none(), beams=beams))


def _cross_a_footway() -> None:
    """Check for vehicles that drive over a footway, which most roads do not have."""
    import numpy as np

    from fogsim.scene.junctions import walkable
    from fogsim.values.road import Lane, LaneKind, LaneMarking, PavedArea

    corners = np.array([[-2.0, -2.0, 0.0], [2.0, -2.0, 0.0], [2.0, 2.0, 0.0], [-2.0, 2.0, 0.0]])
    along = np.array([[-50.0, 0.0, 0.0], [50.0, 0.0, 0.0]])
    lane = Lane("", "", along, 3.5, 14.0, LaneMarking.NONE, LaneMarking.NONE, outermost=True)
    walkable([PavedArea("", corners, LaneKind.FOOTWAY)], [lane])


def _foggy_road(
    camera: "Camera", lead: float, fog: tuple[float, float] = _EVEN, shade: float = 1.0
) -> "NDArray[np.uint8]":
    """Image of a straight road in fog with lane marks and a dark vehicle ahead: (rows, cols, 3) uint8.

    `fog` is its visibility and where a bank begins, five times as dense [m]; `shade` is what shadows leave of the light
    [-].
    """
    import numpy as np

    from fogsim.units import extinction_from_visibility

    rows, cols = np.mgrid[: camera.height, : camera.width].astype(np.float64)
    below = rows - camera.horizon_row
    ahead = np.where(below > 0.5, camera.row_distance / np.maximum(below, 0.5), _SKY)
    aside = np.where(
        below > 0.5, (cols - camera.principal_point[0]) * camera.mount_height / np.maximum(below, 0.5), 0.0
    )
    marks = (np.abs(np.abs(aside) - 1.75) < 0.08) & ((ahead % 12.0 < 4.0) | (aside < 0.0))
    grain = np.random.default_rng(0).normal(0.0, 1.0, rows.shape)
    surface = np.where(marks, 150.0, np.where(np.abs(aside) < 6.0, 60.0, 45.0))
    surface = np.where((ahead + 3.0 * aside) % 24.0 < 9.0, shade * surface, surface)
    size = camera.focal_length / lead
    foot = camera.horizon_row + camera.mount_height * size
    vehicle = (np.abs(cols - camera.principal_point[0]) < 0.9 * size) & (rows < foot) & (rows > foot - 1.4 * size)
    surface, ahead = np.where(vehicle, 20.0, surface), np.where(vehicle, lead, ahead)
    visibility, bank = fog
    path = ahead + 4.0 * np.maximum(ahead - bank, 0.0)
    light = 200.0 + (surface - 200.0) * np.exp(-extinction_from_visibility(visibility) * path)
    grey = np.clip(light + grain, 0.0, 255.0).round().astype(np.uint8)
    return np.repeat(grey[:, :, None], 3, axis=2)
