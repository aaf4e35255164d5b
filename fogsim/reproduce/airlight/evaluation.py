"""Daytime methods in Koschmieder's fog and in that of photons: what they read, by albedo, visibility and camera."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fogsim.atmosphere import Droplets, fogged_radiance
from fogsim.calibration.staged_road import StagedVehicle, foggy_radiance, road_renderer
from fogsim.camera import Sensor, expose
from fogsim.estimators import make
from fogsim.render import Renderer
from fogsim.reproduce.huang2015_chase import drawn
from fogsim.reproduce.result import (
    Cell,
    Reproduction,
    Rows,
    Steps,
    TitledTable,
    Watch,
    chosen_tables,
    figure_image,
    unwatched,
)
from fogsim.reproduce.road_sweeps import CAMERA, SPEED, drive
from fogsim.units import LUMINANCE_WEIGHTS, extinction_from_visibility
from fogsim.values import Camera, CameraPose, Estimate, FogField, Frame, LeadMeasurement, Observation, View
from fogsim.values.fog import AIRLIGHT_SHARE, airlight_share

ELEVATIONS = (-10.0, -5.0, -2.0, 0.0, 2.0, 5.0, 10.0, 30.0)
"""Of the lines of sight [degrees]."""

ALBEDOS = (0.0, 0.05, 0.1, 0.2, 0.4, 0.8, 1.0)


@dataclass(frozen=True, slots=True)
class Condition:
    """Albedo of the land (None for Koschmieder's fog), and V_met, heights of the layer and of the eye [m]."""

    name: str
    albedo: float | None = 0.1
    visibility: float = 100.0
    top: float = 250.0
    eye: float = 1.3
    droplets: Droplets = Droplets.MODERATE_RADIATION


_USUAL = Condition("V_met 100 m, layer 250 m, eye 1.3 m, small droplets")
_CONDITIONS = (
    _USUAL,
    replace(_USUAL, name="V_met 30 m", visibility=30.0),
    replace(_USUAL, name="V_met 400 m", visibility=400.0),
    replace(_USUAL, name="V_met 2000 m", visibility=2000.0),
    replace(_USUAL, name="layer 20 m", top=20.0),
    replace(_USUAL, name="layer 1000 m", top=1000.0),
    replace(_USUAL, name="eye 2.5 m", eye=2.5),
    replace(_USUAL, name="eye 6 m", eye=6.0),
    replace(_USUAL, name="large droplets (heavy advection fog)", droplets=Droplets.HEAVY_ADVECTION),
)
"""What is varied over land of albedo 0.1, one thing at a time."""


def _airlight(condition: Condition, elevation: float, distance: float | None = None) -> float:
    """Airlight up to the road, or to a distance [m], over the path's loss, in E / π, by elevation [degrees]."""
    slope = math.sin(math.radians(elevation))
    if distance is None:
        distance = condition.eye / -slope if slope < 0 else (condition.top - condition.eye) / max(slope, 1e-6)
    level = (AIRLIGHT_SHARE if condition.albedo is None else airlight_share(condition.albedo),) * 3
    extinction = extinction_from_visibility(condition.visibility)
    field = FogField(extinction, level, top=condition.top, ground_albedo=condition.albedo)
    ray = np.zeros((3, 3))
    ray[:, 2] = math.cos(math.radians(elevation)), 0.0, slope
    black = View(np.zeros((1, 1, 3), np.float32), np.full((1, 1), distance, np.float32), np.zeros((1, 1), np.int32))
    seen = fogged_radiance(black, field, (0.0, 0.0, condition.eye), ray, condition.droplets)
    return float(seen[0, 0, 1]) / -math.expm1(-extinction * distance)


def _conditions() -> tuple[list[Mapping[str, Cell]], tuple[TitledTable, TitledTable]]:
    """Airlight by albedo, and by what else there may be."""
    lands = [replace(_USUAL, name=f"albedo {albedo:g}", albedo=albedo) for albedo in ALBEDOS]
    records: list[Mapping[str, Cell]] = []
    tables = []
    for title, kinds in (
        (f"Airlight over E/π by elevation: {_USUAL.name}", lands),
        ("The same over land of albedo 0.1, with one thing changed", list(_CONDITIONS)),
    ):
        rows = [("", *(f"{elevation:g}°" for elevation in ELEVATIONS))]
        for kind in kinds:
            found = [_airlight(kind, elevation) for elevation in ELEVATIONS]
            rows.append((kind.name, *(f"{one:.3f}" for one in found)))
            records += [
                {"paper": "airlight", "condition": kind.name, "elevation_deg": elevation, "airlight": one}
                for elevation, one in zip(ELEVATIONS, found, strict=True)
            ]
        tables.append(TitledTable(title, tuple(rows)))
    return records, (tables[0], tables[1])


Records = Sequence[Mapping[str, Cell]]

_ROAD = 0.1
"""Albedo of the road [-]."""

_COLOURS = {0.05: "C3", 0.1: "C1", 0.2: "C2", 0.4: "C0", 0.8: "C4"}


def _picture(records: Records) -> NDArray[np.uint8]:
    """Draw the airlight by elevation, a dark road's luminance by distance, and estimates with a car's camera."""
    methods = list(dict.fromkeys(str(one["method"]) for one in records))
    figure = Figure(figsize=(15.0, 8.4), dpi=90, layout="constrained")
    axes = figure.subplots(2, math.ceil((len(methods) + 2) / 2)).ravel()
    _draw_airlight(axes[0])
    _draw_road(axes[1])
    lowest = min(float(str(one["mount_height_m"])) for one in records)
    for method, one in zip(methods, axes[2:], strict=False):
        here = [r for r in records if r["method"] == method and r["mount_height_m"] == lowest]
        _draw_method(one, method, here)
    for one in axes[2 + len(methods) :]:
        one.set_axis_off()
    return figure_image(figure)


def _draw_airlight(axes: Axes) -> None:
    up = np.concatenate((-np.geomspace(15.0, 0.5, 40), [0.0], np.geomspace(0.5, 30.0, 40)))
    for albedo, colour in _COLOURS.items():
        over = Condition("", albedo)
        axes.plot(up, [_airlight(over, one) for one in up.tolist()], colour, label=f"ρ {albedo:g}")
    axes.axhline(AIRLIGHT_SHARE, color="0.5", ls="--", label="Koschmieder, ρ 0.1")
    axes.axvline(0.0, color="0.8", lw=1)
    axes.set(xlabel="elevation [°]", ylabel="airlight / (1 − T), over E/π", title="Airlight up to road or sky")
    axes.legend(fontsize=7, loc="lower right")


def _draw_road(axes: Axes) -> None:
    far = np.geomspace(5.0, 300.0, 60)
    for albedo, colour in ((None, "0.5"), (0.1, "C1"), (0.8, "C4")):
        over = Condition("", albedo)
        through = np.exp(-extinction_from_visibility(over.visibility) * far)
        down = -np.degrees(np.arcsin(over.eye / far))
        light = [_airlight(over, one, reach) for one, reach in zip(down.tolist(), far.tolist(), strict=True)]
        seen = 1.0 - (np.array(light) * (1.0 - through) + _ROAD * through) / _airlight(over, 0.0)
        name = "Koschmieder" if albedo is None else f"land of albedo {albedo:g}"
        axes.semilogy(far, seen, color=colour, ls="--" if albedo is None else "-", label=name)
    axes.axhline(0.05, color="0.8", lw=1)
    axes.set(
        xlabel="distance [m]",
        ylim=(0.005, 1.0),
        ylabel="contrast of the road to the horizon",
        title="Road, V_met 100 m",
    )
    axes.legend(fontsize=8)


def _draw_method(axes: Axes, method: str, records: Records) -> None:
    for albedo in (None, *_COLOURS):
        here = [one for one in records if one["ground_albedo"] == albedo and one["read_m"] is not None]
        true = [float(str(one["visibility_m"])) for one in here]
        ratio = [float(str(one["read_m"])) / float(str(one["visibility_m"])) for one in here]
        name = "Koschmieder" if albedo is None else f"ρ {albedo:g}"
        colour = "0.5" if albedo is None else _COLOURS[albedo]
        axes.plot(true, ratio, "o--" if albedo is None else "o-", color=colour, ms=4, label=name)
    axes.axhline(1.0, color="0.8", lw=1)
    axes.set(
        xscale="log",
        yscale="log",
        ylim=(0.5, 6.0),
        xlabel="true V_met [m]",
        ylabel="read over true V_met",
        title=method,
    )
    axes.set_xticks([50, 100, 200, 400], ["50", "100", "200", "400"])
    axes.set_yticks([0.5, 1, 2, 4], ["0.5", "1", "2", "4"])
    axes.minorticks_off()
    axes.legend(fontsize=7)


_PUBLISHED = ("negru2013", "zhu2015", "huang2015_rough")
EVEN_AIRLIGHT = "joint_road, even airlight"
"""The joint fit as it would be without airlight that darkens toward the road."""

ROAD_METHODS = (*_PUBLISHED, EVEN_AIRLIGHT, "joint_road")
CHASE_METHODS = ("lead_contrast",)

_FRAMES, _PERIOD = 10, 1.0
"""Frames of a drive alone, whose last estimate counts, and the time between [s]."""

_EXPOSED, _BRIGHTEST = 0.65, 95.0
"""Share of saturation at which the camera holds a percentile of the picture's luminance, as FogSim's does."""

_PAINTS = (0.03, 0.6)
"""Reflectances of vehicles that are followed [-]."""

_FIRST_RANGE, _LAST_RANGE, _RANGE_STEP = 12.0, 100.0, 1.0
"""Ranges of the vehicle that is followed as it drives away [m]; in dense fog up to 0.9 V_met."""

_AWAY = 5.0
"""By how much it is faster [m/s]."""

_RANGE_DEVIATION = 0.25
"""Noise of its range, from the camera to its rear [m]."""

_NOTES = (
    "Fog of 250 m, CIE overcast sky, flat Lambertian land of one albedo; small droplets (moderate radiation fog). The "
    "drawn road is the same in all: its own albedo is about 0.1.",
    "Koschmieder: the airlight is that of a white surface, 0.94 E/π, everywhere. Photons: about (0.34 + 0.66 ρ) E/π "
    "level, brighter upward, less toward the road (docs/explanation/airlight.md).",
    "Transmission along every line of sight is the same in both; extinction coefficients are equal.",
    "Exposure: 95 % of the picture's pixels below 0.65 of saturation, in both.",
)


@dataclass(frozen=True, slots=True)
class Case:
    """One fog; albedo of the land, None for Koschmieder's fog, and visibility [m]."""

    albedo: float | None
    visibility: float
    droplets: Droplets = Droplets.MODERATE_RADIATION


@dataclass(frozen=True, slots=True)
class Plan:
    """What is run: albedos (None for Koschmieder's fog), visibilities [m], camera heights [m], drives a camera."""

    albedos: tuple[float | None, ...] = (None, 0.05, 0.1, 0.2, 0.4, 0.8)
    visibilities: tuple[float, ...] = (50.0, 100.0, 200.0, 400.0)
    heights: tuple[float, ...] = (1.3, 2.5)
    drives: int = 4

    @property
    def cases(self) -> tuple[Case, ...]:
        """Every fog."""
        return tuple(Case(albedo, visibility) for albedo in self.albedos for visibility in self.visibilities)


def reproduce(
    plan: Plan | None = None, *, quick: bool = False, table: str | None = None, watch: Watch = unwatched
) -> Reproduction:
    """Let every daytime method read frames of both fogs; there are no tables to choose from."""
    chosen_tables((), table)
    plan = plan or (Plan(drives=1) if quick else Plan())
    steps = Steps(len(plan.heights) * 2 * plan.drives, watch)
    records: list[Mapping[str, Cell]] = []
    with road_renderer() as renderer:
        for height in plan.heights:
            camera = replace(CAMERA, mount_height=height)
            found: dict[tuple[Case, str], list[Estimate]] = {}
            for followed, number in itertools.product((drive_alone, follow), range(plan.drives)):
                for case, method, estimate in followed(renderer, camera, plan.cases, number):
                    found.setdefault((case, method), []).append(estimate)
                steps.advance()
            records += [_record(height, case, method, estimates) for (case, method), estimates in found.items()]
    tables = tuple(
        TitledTable(
            f"V_met as read [m] (share of drives with one), camera {height:g} m high",
            _rows(records, plan, height),
        )
        for height in plan.heights
    )
    sweeps, by_elevation = _conditions()
    shown = (*by_elevation, *tables)
    return Reproduction("airlight", tuple(records), tables[0].rows, _NOTES, _picture(records), shown, tuple(sweeps))


def drive_alone(
    renderer: Renderer, camera: Camera, cases: Sequence[Case], number: int, methods: Sequence[str] = ROAD_METHODS
) -> Iterator[tuple[Case, str, Estimate]]:
    """Drive along the road alone: the fog, each method, and its estimate at the end."""
    rng = np.random.default_rng([21, number])
    moments = list(drive(renderer, camera, _FRAMES, lead=False, rng=rng, period=_PERIOD))
    for case in cases:
        frames = [
            Observation(Frame(_PERIOD * number, _image(one.view, one.pose, camera, case, rng), camera), SPEED)
            for number, one in enumerate(moments)
        ]
        for method in methods:
            estimator = (
                make("joint_road", camera, even_airlight=True) if method == EVEN_AIRLIGHT else make(method, camera)
            )
            yield case, method, [estimator.update(frame) for frame in frames][-1]


def follow(
    renderer: Renderer, camera: Camera, cases: Sequence[Case], number: int
) -> Iterator[tuple[Case, str, Estimate]]:
    """Follow a vehicle that drives away: the fog, each method, and its estimate at the end."""
    rng = np.random.default_rng([22, number])
    estimators = {case: make(CHASE_METHODS[0], camera, setback=0.0) for case in cases}
    last: dict[Case, Estimate] = {}
    vehicle = StagedVehicle(paint=(float(rng.uniform(*_PAINTS)),) * 3)
    for ahead in np.arange(_FIRST_RANGE, _LAST_RANGE, _RANGE_STEP).tolist():
        time = (ahead - _FIRST_RANGE) / _AWAY
        scene = drawn(renderer, camera, vehicle, ahead, time * SPEED)
        lead = LeadMeasurement(ahead + _RANGE_DEVIATION * float(rng.normal()), _AWAY)
        for case, estimator in estimators.items():
            if ahead <= 0.9 * case.visibility:
                frame = Frame(time, _image(scene.view, scene.pose, camera, case, rng), camera)
                last[case] = estimator.update(Observation(frame, SPEED, lead))
    for case, estimate in last.items():
        yield case, CHASE_METHODS[0], estimate


def _image(view: View, pose: CameraPose, camera: Camera, case: Case, rng: np.random.Generator) -> NDArray[np.uint8]:
    k = extinction_from_visibility(case.visibility)
    radiance = foggy_radiance(view, pose, camera, k, case.albedo, case.droplets)
    red, green, blue = (share * radiance[..., i].astype(float) for i, share in enumerate(LUMINANCE_WEIGHTS))
    sensor = Sensor(saturation_luminance=float(np.percentile(red + green + blue, _BRIGHTEST)) / _EXPOSED)
    return expose(radiance, sensor, camera.response, rng).astype(np.uint8)


def _record(height: float, case: Case, method: str, estimates: Sequence[Estimate]) -> dict[str, Cell]:
    valid = [one for one in estimates if one.valid and one.extinction > 0.0]
    read = float(np.median([one.visibility for one in valid])) if valid else None
    held = [one.visibility_interval[0] <= case.visibility <= one.visibility_interval[1] for one in valid]
    return {
        "paper": "airlight",
        "fog": "koschmieder" if case.albedo is None else "photons",
        "ground_albedo": case.albedo,
        "mount_height_m": height,
        "visibility_m": case.visibility,
        "method": method,
        "told_share": len(valid) / len(estimates),
        "read_m": read,
        "bias_pct": None if read is None else 100.0 * (read / case.visibility - 1.0),
        "interval_coverage": float(np.mean(held)) if held else None,
    }


def _rows(records: Sequence[Mapping[str, Cell]], plan: Plan, height: float) -> Rows:
    rows = [("method", "fog", *(f"{visibility:.0f} m" for visibility in plan.visibilities))]
    for method in (*ROAD_METHODS, *CHASE_METHODS):
        for albedo in plan.albedos:
            here = [
                one
                for one in records
                if (one["method"], one["ground_albedo"], one["mount_height_m"]) == (method, albedo, height)
            ]
            fog = "Koschmieder" if albedo is None else f"photons, ρ {albedo:g}"
            rows.append((method, fog, *(_cell(one) for one in here)))
    return tuple(rows)


def _cell(record: Mapping[str, Cell]) -> str:
    read, share = record["read_m"], float(record["told_share"] or 0.0)
    suffix = "" if share == 1.0 else f" ({100.0 * share:.0f} %)"
    return "—" if read is None else f"{read:.0f}{suffix}"
