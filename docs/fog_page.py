"""Draw the pictures and curves of docs/explanation/fog.md: ``python docs/fog_page.py [NAME ...]`` (about a minute)."""

import argparse
import dataclasses
import math
from collections.abc import Callable

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from contact_sheet import HIGH, NIGHT, OTHERS, fog
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from page_tables import ROOT
from staging import LIT, PICTURES, Shot, Vehicle, network, photograph, scenario

from fogsim.atmosphere import Air, Droplets, airlight_from_illuminance, extinction, field_at
from fogsim.atmosphere.lamps.glow import glow, narasimhan_nayar, scattered_once
from fogsim.atmosphere.lamps.lamp_tables import lamp_table
from fogsim.atmosphere.lamps.phase_function import henyey_greenstein, phase_function
from fogsim.atmosphere.lamps.veil import FOLD_DISTANCE, INTERVALS, VeilRays, lit_air, ray_pieces, veil_along
from fogsim.atmosphere.visibility.night_visibility import (
    FogKind,
    high_beam_veil,
    target_visibility_level,
    visibility_distance,
)
from fogsim.atmosphere.visibility.visibility_level import threshold
from fogsim.lighting.beams import high_beam, low_beam, scaled_beam
from fogsim.render import make_renderer
from fogsim.scenario import build
from fogsim.units import extinction_from_visibility
from fogsim.values import CameraPose, FogField, Lamp, Mesh, Scene, Surface
from fogsim.values.eye import veiling_luminance

SIZE = (480, 360)
ILLUMINANCE = 10_000.0
TARGETS = (10.0, 20.0, 35.0, 50.0, 75.0, 100.0, 150.0, 200.0)
"""Distances of the black targets [m]."""

COLOURS = ("#1f5f8b", "#c8553d", "#5a8f53", "#8a6fa8", "#8a8a8a")


def show(axes: Axes, image: NDArray[np.uint8], title: str) -> None:
    """A picture without axes."""
    axes.imshow(image)
    axes.set_title(title)
    axes.axis("off")


def ticks(axes: Axes, places: tuple[float, ...]) -> None:
    """Plain numbers on a logarithmic axis."""
    axes.set_xticks(places, [f"{place:g}" for place in places])
    axes.xaxis.set_minor_formatter("")


def panels(widths: tuple[float, ...]) -> tuple[Figure, list[Axes]]:
    """A figure with panels side by side."""
    figure, axes = plt.subplots(
        1, len(widths), figsize=(12, 3.6), layout="constrained", gridspec_kw={"width_ratios": widths}
    )
    return figure, list(axes)


def black_targets() -> Scene:
    """A grassy plain and black squares above it, as large to the eye as each other, each at its distance."""
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    angles = np.radians(np.linspace(22.0, -22.0, len(TARGETS)))
    squares = [
        np.column_stack((np.full(4, d), d * math.tan(a) + 0.035 * d * corners[:, 0], 1.38 + 0.035 * d * corners[:, 1]))
        for d, a in zip(TARGETS, angles, strict=True)
    ]
    plain = np.column_stack((900.0 * corners + (880.0, 0.0), np.zeros(4)))
    n = len(TARGETS)
    positions = np.concatenate([plain, *squares]).astype(np.float32)
    normals = np.repeat(np.float32([[0, 0, 1], [-1, 0, 0]]), (4, 4 * n), axis=0)
    surface = np.repeat(np.array([Surface.TERRAIN, Surface.MATT], np.int32), (4, 4 * n))
    reflectance = np.repeat(np.float32([[0.06, 0.09, 0.03], [0, 0, 0]]), (4, 4 * n), axis=0)
    faces = np.concatenate([np.array([[0, 1, 2], [0, 2, 3]]) + 4 * i for i in range(n + 1)]).astype(np.uint32)
    instance = np.repeat(np.arange(1, n + 2, dtype=np.int32), 4)
    ground = Mesh(positions, normals, reflectance, surface, np.zeros((4 * n + 4, 4), np.float32), instance, faces)
    return Scene(ground=ground, shapes={}, scenery=())


def koschmieder() -> Figure:
    """Black targets by day: picture, contrast and radiance as they are in the frame."""
    figure, (left, middle, right) = panels((1.1, 1, 1))
    described = scenario((fog("100"),), "cpu", (640, 480))
    config = described.run_config()
    camera = dataclasses.replace(config.camera.on(), pitch=0.0)
    camera = dataclasses.replace(camera, principal_point=(camera.principal_point[0], 0.5 * camera.height))
    pose = CameraPose((0.0, 0.0, 1.38), 0.0)
    renderer = make_renderer("cpu", black_targets(), ILLUMINANCE)
    view = renderer.render((), camera, pose)
    renderer.close()
    airlight = airlight_from_illuminance(ILLUMINANCE)
    seen = [view.instance == 2 + i for i in range(len(TARGETS))]
    distances = [float(view.distance[one].mean()) for one in seen]
    line = np.linspace(1.0, 220.0, 200)
    for visibility, colour in zip((50.0, 100.0, 200.0), COLOURS, strict=False):
        k = extinction_from_visibility(visibility)
        radiance = Air(FogField(k, airlight)).radiance(view, camera, pose)
        measured = np.array([float(radiance[one][:, 1].mean()) for one in seen])
        contrast = 1.0 - measured / airlight[1]
        middle.plot(line, np.exp(-k * line), color=colour, label=f"V_met {visibility:g} m")
        middle.plot(distances, contrast, "o", color=colour, ms=4)
        right.plot(line, airlight[1] * (1 - np.exp(-k * line)), color=colour)
        right.plot(distances, measured, "o", color=colour, ms=4)
        if visibility == 100.0:
            image = config.camera.make_sensor(config.periods.camera_period).take(radiance, np.random.default_rng(1))
            show(left, image[150:330], "black targets at 10 … 200 m, V_met 100 m")
    middle.axhline(0.05, color="black", lw=0.8, ls=":")
    middle.set(yscale="log", xlabel="distance [m]", ylabel="contrast of black targets", ylim=(1e-3, 1.1))
    middle.legend()
    right.axhline(airlight[1], color="black", lw=0.8, ls=":")
    right.set(xlabel="distance [m]", ylabel="their radiance [cd/m²]", ylim=(0, 3300))
    return figure


BANK = "fog={outside_visibility_m: 800, banks: [{start_m: 470, end_m: 700, edge_m: 60, visibility_m: 30}]}"
LAYER = "fog={visibility_m: 25, top_m: 2.5, top_edge_m: 2, scale_height_m: 1.5}"
PATCHES = (
    "fog={visibility_m: 70, patches: {correlation_length_m: 25, correlation_height_m: 10, strength: 0.9, seed: 3}}"
)
LIFTING = (
    "fog={visibility_m: 80, base_edge_m: 2, changes: [{at_s: 0, density: 1.0, base_m: -5},"
    " {at_s: 600, density: 1.0, base_m: 12}]}"
)


def field_of(setting: str) -> FogField:
    """Fog along the motorway."""
    return build.world_config(scenario((setting,), "cpu", SIZE)).fog.along(network("motorway").route)


def fields() -> Figure:
    """Uneven fog: a picture of each kind and its extinction coefficient."""
    figure, axes = plt.subplots(2, 4, figsize=(12, 5.2), layout="constrained")
    shots = (
        ("bank that begins 70 m ahead", BANK, 0.0),
        ("ground fog 2.5 m deep", LAYER, 0.0),
        ("patches", PATCHES, 0.0),
        ("lifted fog, after 600 s", LIFTING, 600.0),
    )
    for place, (title, setting, time) in zip(axes[0], shots, strict=True):
        show(place, photograph(Shot(title, (setting,), vehicles=OTHERS, time=time), size=SIZE).image, title)
    route = network("motorway").route
    towards = (route[1] - route[0]) / np.linalg.norm(route[1] - route[0])
    station = np.linspace(400.0, 800.0, 300)
    along = route[0] + station[:, None] * towards + (0.0, 0.0, 1.4)
    axes[1, 0].plot(station - 400.0, extinction(field_of(BANK), along), color=COLOURS[0])
    axes[1, 0].set(xlabel="distance ahead [m]", ylabel="k [1/m]")
    height = np.linspace(0.0, 6.0, 200)
    above = route[0] + 400.0 * towards + height[:, None] * (0.0, 0.0, 1.0)
    axes[1, 1].plot(extinction(field_of(LAYER), above), height, color=COLOURS[0])
    axes[1, 1].set(xlabel="k [1/m]", ylabel="height [m]")
    across = np.array([-towards[1], towards[0], 0.0])
    grid = route[0] + (400.0 + np.linspace(0, 200, 160))[:, None] * towards
    plane = grid[None] + np.linspace(-50, 50, 80)[:, None, None] * across + (0.0, 0.0, 1.4)
    values = extinction(field_of(PATCHES), plane.reshape(-1, 3)).reshape(80, 160)
    shown = axes[1, 2].imshow(values, extent=(0, 200, -50, 50), origin="lower", cmap="bone", aspect="auto")
    axes[1, 2].set(xlabel="distance ahead [m]", ylabel="to the left [m]")
    figure.colorbar(shown, ax=axes[1, 2], label="k [1/m]", location="top", aspect=30)
    lifting, high = field_of(LIFTING), np.linspace(0.0, 20.0, 200)
    over = route[0] + 400.0 * towards + high[:, None] * (0.0, 0.0, 1.0)
    for time, colour in zip((0.0, 200.0, 400.0, 600.0), COLOURS, strict=False):
        axes[1, 3].plot(extinction(field_at(lifting, time), over), high, color=colour, label=f"{time:g} s")
    axes[1, 3].set(xlabel="k [1/m]", ylabel="height [m]")
    axes[1, 3].legend()
    return figure


def forward_scatter() -> Figure:
    """The blur by day: a truck without and with it, and a row across the truck's edge."""
    figure, (first, second, curve) = panels((1, 1, 1.1))
    for place, weight, colour in ((first, 0.0, COLOURS[0]), (second, 0.3, COLOURS[1])):
        setting = f"fog={{visibility_m: 60, forward_scatter: {weight}}}"
        taken = photograph(Shot("", (setting,), vehicles=(Vehicle("truck", 22.0),)), size=(640, 480))
        show(place, taken.image[150:240, 230:360], f"forward_scatter: {weight:g}")
        row = taken.radiance[190:200, 230:360, 1].mean(axis=0)
        curve.plot(np.arange(230, 360), row, color=colour, label=f"weight {weight:g}")
    curve.set(xlabel="column [px]", ylabel="radiance across the truck [cd/m²]")
    curve.legend()
    return figure


def veil_toward_target(beam_name: str, droplets: Droplets, visibilities: NDArray[np.float64]) -> NDArray[np.float64]:
    """Veil between the eye and a point on the road 40 m ahead [cd/m²]."""
    angle = math.radians(2.02)
    ray = VeilRays((1, 1), np.array([[math.cos(angle), 0.0, -math.sin(angle)]], np.float32), *ray_pieces())
    table = lamp_table({"high": high_beam, "low": low_beam}[beam_name]())
    air = lit_air(ray, [((1.8, side, -0.85), table) for side in (0.6, -0.6)], droplets)
    node = 40.0 / (40.0 + FOLD_DISTANCE) * INTERVALS
    extinctions = [np.full((1, 1), extinction_from_visibility(v), np.float32) for v in visibilities]
    return np.array([np.interp(node, np.arange(INTERVALS + 1), veil_along(air, k, k)[0]) for k in extinctions])


def veil() -> Figure:
    """Veil of the own lamps: pictures of both beams, and level over visibility in both kinds of fog."""
    figure, axes = panels((1, 1, 1.1, 1.1))
    for place, name, lamps in ((axes[0], "low", LIT), (axes[1], "high", HIGH)):
        taken = photograph(Shot("", (NIGHT, fog("100")), lamps=lamps), size=SIZE)
        show(place, taken.image, f"{name} beam, V_met 100 m")
    rows, visibilities = photons("monte_carlo_veil.csv"), np.geomspace(30, 500, 40)
    kinds = ((Droplets.MODERATE_RADIATION, FogKind.RADIATION), (Droplets.HEAVY_ADVECTION, FogKind.ADVECTION))
    for place, (droplets, kind) in zip(axes[2:], kinds, strict=True):
        for name, colour in (("high", COLOURS[1]), ("low", COLOURS[0])):
            place.plot(
                visibilities, veil_toward_target(name, droplets, visibilities), color=colour, label=f"{name} beam"
            )
            some = rows[(rows["fog"] == droplets) & (rows["beam"] == name) & (rows["up"] == -2.02)]
            place.plot(some["visibility"], some["single"], ":", color=colour)
            sure = some[some["all_error"] < 0.2 * some["all"]]
            place.errorbar(sure["visibility"], sure["all"], sure["all_error"], fmt="o", color=colour, ms=4)
        by_paper = [high_beam_veil(v, kind) for v in visibilities]
        place.plot(visibilities, by_paper, "--", color="black", lw=1, label="gallen2014 eq. 9")
        place.set(
            xscale="log", yscale="log", xlabel="V_met [m]", ylabel="veil [cd/m²]", title=droplets.replace("_", " ")
        )
        ticks(place, (30, 50, 100, 200, 500))
    axes[2].legend()
    return figure


def photons(name: str) -> NDArray[np.void]:
    """A table that `benchmarks/monte_carlo.py` wrote."""
    text = (ROOT / "tests" / "data" / name).read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    return np.genfromtxt(lines, delimiter=",", names=True, dtype=None, encoding="utf-8")


def draw_halos(axes: Axes) -> None:
    """Glow over angle at three optical depths."""
    rows, angle = photons("monte_carlo_halo.csv"), np.geomspace(0.5, 80.0, 60)
    for depth, colour in ((0.3, "C2"), (1.5, "C0"), (4.0, "C3")):
        some = rows[(rows["fog"] == "heavy_radiation") & (rows["optical_depth"] == depth) & (rows["angle"] < 80)]
        axes.plot(angle, glow(depth, np.radians(angle), Droplets.HEAVY_RADIATION), colour, label=f"T = {depth:g}")
        axes.plot(some["angle"], some["all"], "o", color=colour, ms=4)
        once = scattered_once(depth, np.radians(angle), phase_function(Droplets.HEAVY_RADIATION))
        axes.plot(angle, once, ":", color=colour)
    series = 3 / (4 * math.pi) * narasimhan_nayar(4.0, np.radians(angle))
    axes.plot(angle, series, "--", color="C3", label="Narasimhan & Nayar, T = 4")
    axes.set(xscale="log", yscale="log", xlabel="angle from the lamp [°]", ylabel="L R² / I", title="heavy radiation")
    axes.legend(fontsize=8)


def halos() -> Figure:
    """Glow about lamps: a picture, and profiles against photons."""
    figure, (first, second, curve) = panels((1, 1, 1.1))
    rear = Vehicle("car", 30.0, lamps=LIT | Lamp.REAR_FOG)
    coming = tuple(Vehicle("car", 50.0 + 50.0 * n, 11.5, oncoming=True) for n in range(3))
    for place, visibility in ((first, "300"), (second, "75")):
        shot = Shot("", (NIGHT, fog(visibility)), vehicles=(rear, *coming))
        show(place, photograph(shot, size=SIZE).image, f"rear fog lamp, oncoming cars, V_met {visibility} m")
    draw_halos(curve)
    return figure


def droplets() -> Figure:
    """Phase functions of the four fogs, and what two of them make of the same beam."""
    figure, (first, second, curve) = panels((1, 1, 1.3))
    for place, name in ((first, "moderate_radiation"), (second, "heavy_advection")):
        settings = (NIGHT, fog("100"), f"fog.droplets={name}", "camera.saturation_luminance_cdpm2=6")
        show(
            place, photograph(Shot("", settings, lamps=HIGH), size=SIZE).image, f"{name.replace('_', ' ')}, V_met 100 m"
        )
    angle = np.radians(np.linspace(0.0, 180.0, 1500))
    for one, colour in zip(Droplets, COLOURS, strict=False):
        curve.plot(np.degrees(angle), phase_function(one)(angle), color=colour, lw=1.2, label=one.replace("_", " "))
    curve.plot(np.degrees(angle), henyey_greenstein(angle, 0.85), "--", color="black", lw=1, label="HG, g = 0.85")
    curve.set(yscale="log", xlabel="scattering angle [°]", ylabel="phase function [1/sr]", ylim=(1e-3, 3e3))
    curve.set_xticks(range(0, 181, 30))
    curve.legend()
    return figure


def draw_sight(axes: Axes) -> None:
    """Distance at which the target is seen, over visibility."""
    visibilities = np.geomspace(30, 1500, 50)
    high, low = high_beam(), scaled_beam(low_beam(), 0.30)
    for kind, style in ((FogKind.RADIATION, "-"), (FogKind.ADVECTION, "--")):
        by_high = [visibility_distance(high, v, kind) for v in visibilities]
        axes.plot(visibilities, by_high, f"C1{style}", label=f"high, {kind}")
        by_low = [visibility_distance(low, v, kind, veil_share=0.10) for v in visibilities]
        axes.plot(visibilities, by_low, f"C0{style}", label=f"low × 0.3, {kind}")
    axes.axhline(visibility_distance(low, math.inf), color="C0", lw=0.8, ls=":", label="low, clear air")
    axes.set(xscale="log", xlabel="V_met [m]", ylabel="distance where VL = 7 [m]")
    axes.legend(fontsize=8)


def visibility_level() -> Figure:
    """Adrian's threshold, the visibility level of the target over distance, and where it reaches 7."""
    figure, (first, second, third) = panels((1, 1, 1.1))
    minutes = np.geomspace(1.0, 60.0, 100)
    table = np.genfromtxt(ROOT / "tests" / "data" / "adrian1989.csv", delimiter=",", names=True, skip_header=3)
    for luminance, colour in zip((0.01, 0.1, 1.0), COLOURS, strict=False):
        angle = np.radians(minutes / 60.0)
        first.plot(minutes, threshold(luminance, angle), color=colour, label=f"{luminance:g} cd/m²")
        first.plot(minutes, threshold(luminance, angle, darker=True), "--", color=colour)
        some = table[table["background"] == luminance]
        first.plot(some["minutes"], some["brighter"], "o", color=colour, ms=5)
        first.plot(some["minutes"], some["darker"], "s", color=colour, ms=5)
    first.set(xscale="log", yscale="log", xlabel="angular size [′]", ylabel="ΔL_th [cd/m²]")
    ticks(first, (1, 2, 5, 10, 20, 60))
    first.legend(title="adapted to")
    distance = np.linspace(15.0, 80.0, 300)
    low = scaled_beam(low_beam(), 0.30)
    for visibility, style in ((math.inf, "-"), (300.0, "--"), (100.0, ":")):
        for name, beam, share, colour in (("high", high_beam(), 1.0, COLOURS[1]), ("low", low, 0.1, COLOURS[0])):
            added = share * high_beam_veil(visibility, FogKind.RADIATION)
            level = target_visibility_level(beam, distance, visibility=visibility, veil=added)
            known = "clear" if math.isinf(visibility) else f"V_met {visibility:g} m"
            second.plot(distance, np.abs(level), style, color=colour, label=f"{name}, {known}")
    second.axhline(7.0, color="black", lw=0.8)
    second.set(yscale="log", ylim=(0.3, 300), xlabel="distance of the target [m]", ylabel="visibility level |VL|")
    second.legend()
    draw_sight(third)
    ticks(third, (30, 100, 300, 1000))
    return figure


def glare() -> Figure:
    """Disability glare: the veil in the eye, and what is left of the sight by own lamps."""
    figure, (first, second, third) = panels((1, 1.1, 1.1))
    coming = tuple(Vehicle("car", 30.0 + 60.0 * n, 11.5, HIGH, oncoming=True) for n in range(3))
    show(
        first,
        photograph(Shot("", (NIGHT, fog("300")), vehicles=coming), size=SIZE).image,
        "oncoming high beams, V_met 300 m",
    )
    angle = np.geomspace(1.0, 30.0, 60)
    for age, colour in zip((25.0, 50.0, 70.0), COLOURS, strict=False):
        second.plot(angle, veiling_luminance(1.0, np.radians(angle), age), color=colour, label=f"{age:g} years")
    second.plot(3.0, 1.1292, "o", color="black", ms=5)
    second.set(xscale="log", yscale="log", xlabel="angle from the source [°]", ylabel="veil in the eye [cd/m² per lx]")
    ticks(second, (1, 3, 10, 30))
    second.legend()
    apart = np.linspace(15.0, 200.0, 80)
    for visibility, style in ((math.inf, "-"), (300.0, "--"), (100.0, ":")):
        for candela, name, colour in ((500.0, "low", COLOURS[0]), (20_000.0, "high", COLOURS[1])):
            seen = [sight_against(candela, float(d), visibility) for d in apart]
            known = "clear" if math.isinf(visibility) else f"V_met {visibility:g} m"
            third.plot(apart, seen, style, color=colour, label=f"{name}, {known}")
    third.set(xlabel="distance of the oncoming car [m]", ylabel="distance where VL = 7 [m]", ylim=(0, 42))
    third.legend(ncols=3, title="oncoming beams", fontsize=6.5, title_fontsize=7, loc="upper center", columnspacing=1.0)
    return figure


def sight_against(candela: float, distance: float, visibility: float) -> float:
    """Sight by own low beams against a pair of lamps of an intensity [cd] each, 3.5 m aside [m]."""
    k = 0.0 if math.isinf(visibility) else extinction_from_visibility(visibility)
    light = 2.0 * candela / distance**2 * math.exp(-k * distance)
    veil_in_eye = float(veiling_luminance(light, math.atan2(3.5, distance)))
    return visibility_distance(scaled_beam(low_beam(), 0.30), visibility, veil_share=0.1, glare=veil_in_eye)


def twilight() -> Figure:
    """From day to night: pictures, and what the sky, the road and a lamp's glow send to the camera."""
    figure, axes = plt.subplots(
        1, 5, figsize=(12, 3.0), layout="constrained", gridspec_kw={"width_ratios": (1, 1, 1, 1, 1.4)}
    )
    lit = np.geomspace(0.01, 10_000.0, 13)
    vehicles = (Vehicle("car", 25.0),)
    for place, illuminance in zip(axes, (900.0, 30.0, 3.0, 0.05), strict=False):
        shot = Shot("", (f"light.illuminance_lx={illuminance}", fog("100")), vehicles=vehicles)
        show(place, photograph(shot, size=(320, 300)).image, f"{illuminance:g} lx")
    lights = [photograph(Shot("", (f"light.illuminance_lx={e}", fog("100"))), size=(160, 120)).radiance for e in lit]
    for (rows, name), colour in zip(
        ((slice(0, 8), "sky, 18° up"), (slice(85, 95), "road, 10 m ahead")), COLOURS, strict=False
    ):
        axes[4].plot(lit, [float(one[rows, 70:90, 1].mean()) for one in lights], "o-", ms=3, color=colour, label=name)
    axes[4].plot(lit, [airlight_from_illuminance(e)[1] for e in lit], ":", color="black", label="airlight")
    axes[4].set(xscale="log", yscale="log", xlabel="illuminance [lx]", ylabel="radiance [cd/m²]")
    axes[4].legend()
    return figure


FIGURES: dict[str, Callable[[], Figure]] = {
    "koschmieder": koschmieder,
    "fields": fields,
    "forward_scatter": forward_scatter,
    "veil": veil,
    "halos": halos,
    "droplets": droplets,
    "visibility_level": visibility_level,
    "glare": glare,
    "twilight": twilight,
}


def main() -> None:
    """Draw and save."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", nargs="*", help=f"which (default: all): {', '.join(FIGURES)}")
    mpl.rcParams.update(
        {"font.size": 9, "axes.titlesize": 9, "legend.fontsize": 7.5, "legend.frameon": False}
        | {"axes.spines.top": False, "axes.spines.right": False, "axes.prop_cycle": mpl.cycler(color=COLOURS)}
    )
    for name in parser.parse_args().name or FIGURES:
        figure = FIGURES[name]()
        figure.savefig(PICTURES / f"fog_{name}.png", dpi=100)
        plt.close(figure)


if __name__ == "__main__":
    main()
