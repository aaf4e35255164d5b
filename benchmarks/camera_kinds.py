"""How daytime methods read fog through cameras and light that their models do not assume.

Photographs of roads (`photograph_pictures.py`, other numbers than `photograph_roads.py` uses) get exact even fog of
V_met 60, 120 and 250 m in their light, or none, under an overcast sky but for the kind with shadows. Then a camera of
one kind takes them: tone curves that are not sRGB,
local tone mapping, sharpening and JPEG, overexposure, dirt and reflections on the windscreen, vignetting, a bonnet; or
the scene is of one kind: bright or wet roads, skies that darken toward the horizon as real ones do
(docs/explanation/airlight.md). Views that are no lane are clear. Methods are given a response of sRGB and a pitch that
is off by 0.1° (standard deviation).

Of the frames in fog: `valid`, `median/p95` of |V_est − V| / V [%], `hold` (90 % intervals that contain the truth) and
`wrong` (more than 1.5 times off with an interval that excludes the truth). `false` counts clear frames whose answer has
an upper end: below 1000 m, in views that are no lane anywhere. No constant is chosen on the frames of pool 1.
"""

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from harness import parse_options, progress, publish
from numpy.typing import NDArray
from photograph_pictures import photograph

from fogsim.estimators import make
from fogsim.offline.camera_file import Calibration
from fogsim.offline.rectification import RoadPlane
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, Estimate, Observation

Floats = NDArray[np.float64]
Pixels = NDArray[np.uint8]
Random = np.random.Generator

VISIBILITIES = (60.0, 120.0, 250.0, math.inf)
POOL, FIRST = 1, 500
WRONG, CLEAR = 1.5, 1000.0


@dataclass(frozen=True)
class View:
    """Geometry of a photograph: slant range of the ground (inf above it) [m], elevation of rays [rad], the camera."""

    distance: Floats
    elevation: Floats
    camera: Camera


Change = Callable[[Floats, View, Random], Floats]


def unchanged(light: Floats, _view: View, _rng: Random) -> Floats:
    """Leave light as it is."""
    return light


@dataclass(frozen=True)
class Kind:
    """What is unusual: the scene before the fog is laid, the light that enters, the tone curve, the file."""

    scene: Change = unchanged
    enters: Change = unchanged
    curve: Callable[[Floats, Random], Floats] = lambda light, _rng: srgb(light)
    file: Callable[[Pixels, Random], Pixels] = lambda pixels, _rng: pixels
    exposure: tuple[float, float] = (0.5, 0.85)
    lane: bool = True
    sunny: bool = False


def srgb(light: Floats) -> Floats:
    """Pixel values, 0 … 1, of IEC 61966-2-1."""
    share = np.clip(light, 0.0, 1.0)
    return np.where(share <= 0.0031308, 12.92 * share, 1.055 * np.maximum(share, 1e-9) ** (1 / 2.4) - 0.055)


def film(light: Floats, rng: Random) -> Floats:
    """Toe and shoulder: x (a x + b) / (x (c x + d) + e), as filmic curves are commonly fitted."""
    x = np.clip(light, 0.0, None) * float(rng.uniform(0.8, 1.4))
    bent: Floats = x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)
    return srgb(bent)


def vivid(light: Floats, rng: Random) -> Floats:
    """An s-curve laid on sRGB's values."""
    share, strength = srgb(light), float(rng.uniform(0.3, 0.7))
    return share + strength * (share * share * (3.0 - 2.0 * share) - share)


def dashcam(light: Floats, rng: Random) -> Floats:
    """A knee: the brightest part is compressed."""
    share, knee = srgb(light), float(rng.uniform(0.6, 0.75))
    over = np.maximum(share - knee, 0.0)
    return np.minimum(share, knee) + over / (1.0 + over / (1.0 - knee)) * 1.2


def locally_mapped(pixels: Pixels, rng: Random) -> Pixels:
    """Contrast-limited adaptive equalisation of lightness, as WDR cameras do."""
    lab = np.asarray(cv2.cvtColor(pixels, cv2.COLOR_RGB2LAB), np.uint8)
    equal = cv2.createCLAHE(float(rng.uniform(1.5, 3.0)), (8, 8)).apply(lab[..., 0])
    lab[..., 0] = np.rint(0.5 * equal + 0.5 * lab[..., 0])
    return np.asarray(cv2.cvtColor(lab, cv2.COLOR_LAB2RGB), np.uint8)


def sharpened(pixels: Pixels, rng: Random) -> Pixels:
    """Unsharp masking of 0.8 and JPEG of quality 50 to 95."""
    blurred = cv2.GaussianBlur(pixels, (0, 0), float(rng.uniform(0.8, 1.6)))
    sharp = cv2.addWeighted(pixels, 1.8, blurred, -0.8, 0.0)
    quality = [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(50, 96))]
    coded = cv2.imencode(".jpg", np.ascontiguousarray(sharp[..., ::-1]), quality)[1]
    decoded = np.asarray(cv2.imdecode(coded, cv2.IMREAD_COLOR), np.uint8)
    return np.ascontiguousarray(decoded[..., ::-1])


def bright_road(light: Floats, view: View, rng: Random) -> Floats:
    """Aged asphalt and concrete: ground of 0.45 to 0.7 of the airlight."""
    ground = np.isfinite(view.distance)
    return np.where(ground[..., None], light * float(rng.uniform(0.45, 0.7)) / np.median(light[ground]), light)


def wet_road(light: Floats, view: View, rng: Random) -> Floats:
    """A film of water: darker asphalt, and the sky of unit luminance mirrored by Fresnel's law (Schlick, n = 1.33)."""
    ground = np.isfinite(view.distance)
    mirrored = 0.02 + 0.98 * (1.0 - np.abs(np.sin(view.elevation))) ** 5
    wet = 0.6 * light + float(rng.uniform(0.4, 1.0)) * mirrored[..., None]
    return np.where(ground[..., None], wet, light)


def convex_sky(light: Floats, view: View, rng: Random) -> Floats:
    """Darker toward the horizon, by 1 to 3 % for each 1/120 rad below 0.16 rad."""
    drop = 1.0 - float(rng.uniform(0.01, 0.03))
    shape = drop ** (120.0 * np.clip(0.16 - view.elevation, 0.0, 0.16))
    above = np.isinf(view.distance)
    return np.where(above[..., None], light * (shape / drop ** (120.0 * 0.16))[..., None], light)


def bonnet(light: Floats, _view: View, rng: Random) -> Floats:
    """A dull bonnet across the lowest 8 to 18 % of the rows."""
    rows, columns = light.shape[:2]
    across = np.linspace(-1.0, 1.0, columns)
    top = rows * (1.0 - float(rng.uniform(0.08, 0.18)) + 0.04 * across**2)
    below = np.arange(rows)[:, None] - top[None, :]
    shade = float(rng.uniform(0.05, 0.35)) + 0.3 * np.exp(-np.clip(below, 0.0, None) / 8.0)
    return np.where((below > 0)[..., None], shade[..., None] * np.ones(3), light)


def vignetted(light: Floats, _view: View, rng: Random) -> Floats:
    """Darker away from the axis, by up to 0.5 in the corners."""
    rows, columns = light.shape[:2]
    y, x = np.mgrid[-1.0 : 1.0 : rows * 1j, -1.0 : 1.0 : columns * 1j]
    left: Floats = 1.0 - float(rng.uniform(0.2, 0.5)) * (x * x + y * y) / 2.0
    return light * left[..., None]


def reflected(light: Floats, _view: View, rng: Random) -> Floats:
    """The dashboard mirrored in the windscreen: a veil that grows downward."""
    veil = float(rng.uniform(0.02, 0.1)) * np.linspace(0.2, 1.0, light.shape[0])
    return light + veil[:, None, None]


def dirty(light: Floats, _view: View, rng: Random) -> Floats:
    """Blurred spots that take up to a third of the light, some of them on the horizon."""
    rows, columns = light.shape[:2]
    mask = np.zeros((rows, columns))
    for _ in range(int(rng.integers(20, 60))):
        place = int(rng.integers(columns)), int(rng.integers(rows))
        cv2.circle(mask, place, int(rng.integers(3, 25)), float(rng.uniform(0.05, 0.35)), -1)
    return light * (1.0 - cv2.GaussianBlur(mask, (0, 0), 6.0))[..., None]


def _no_lane(scene: Change) -> Kind:
    return Kind(scene, lane=False)


def arch(light: Floats, _view: View, rng: Random) -> Floats:
    """A pale building with an archway fills the view."""
    rows, columns = light.shape[:2]
    v, u = np.mgrid[0.0 : 1.0 : rows * 1j, -1.0 : 1.0 : columns * 1j]
    wall = 0.35 + 0.25 * (1.0 - v) + 0.02 * rng.standard_normal((rows, columns))
    opening = (np.abs(u) < float(rng.uniform(0.15, 0.35))) & (v > float(rng.uniform(0.3, 0.5)))
    out = np.where(v < 0.12, 0.9, np.where(opening, 0.8, wall))
    return np.where(v > 0.92, 0.1, out)[..., None] * np.ones(3)


def _across(view: View) -> Floats:
    """Tangent of the angle of each column from straight ahead."""
    camera = view.camera
    columns = (np.arange(camera.width) - camera.principal_point[0]) / camera.focal_length
    return columns[None, :] * np.ones((camera.height, 1))


def _standing(light: Floats, view: View, what: tuple[float, float, float, float], shade: Floats) -> Floats:
    """Put a wall before a view: its depth, left and right side and height [m], and its shade (rows, cols)."""
    depth, left, right, height = what
    up = depth * np.tan(view.elevation) + view.camera.mount_height
    side = depth * _across(view)
    wall = (up > 0.0) & (up < height) & (side > left) & (side < right)
    return np.where(wall[..., None], shade[..., None], light)


def tower(light: Floats, view: View, rng: Random) -> Floats:
    """A tower stands at the end of a pale square."""
    ground = np.isfinite(view.distance)
    paved = float(rng.uniform(0.2, 0.5)) * (1.0 + 0.05 * rng.standard_normal(view.distance.shape))
    square = np.where(ground[..., None], paved[..., None], light)
    depth, half = float(rng.uniform(15.0, 60.0)), float(rng.uniform(3.0, 8.0))
    storeys = 1.0 + 0.15 * np.sign(np.sin(view.elevation * depth * float(rng.uniform(1.0, 3.0))))
    shade = float(rng.uniform(0.15, 0.7)) * storeys
    return _standing(square, view, (depth, -half, half, float(rng.uniform(15.0, 60.0))), shade)


def junction(light: Floats, view: View, rng: Random) -> Floats:
    """The road ends at another one, behind which a pavement, a fence or hedge, and houses stand."""
    near = float(rng.uniform(8.0, 15.0))
    far = near + float(rng.uniform(6.0, 12.0))
    depth = np.where(np.isfinite(view.distance), view.distance, np.inf)
    shades = float(rng.uniform(0.1, 0.25)), float(rng.uniform(0.25, 0.6))
    crossing, pavement = (depth > near) & (depth < far), (depth >= far) & (depth < far + 3.0)
    out = np.where(crossing[..., None], shades[0], np.where(pavement[..., None], shades[1], light))
    side = 2.0 * float(rng.uniform(-8.0, 2.0))
    for left in side + 14.0 * np.arange(-3, 3):
        house = float(rng.uniform(0.15, 0.8)) * np.ones(depth.shape)
        out = _standing(out, view, (far + 9.0, left, left + 12.0, float(rng.uniform(5.0, 12.0))), house)
    hedge = float(rng.uniform(0.03, 0.7)) * (1.0 + 0.1 * rng.standard_normal(depth.shape))
    return _standing(out, view, (far + 3.0, -60.0, 60.0, float(rng.uniform(0.8, 2.0))), hedge)


def street(light: Floats, view: View, rng: Random) -> Floats:
    """Houses on both sides of a street to where it bends, and one across its end."""
    far = float(rng.uniform(60.0, 150.0))
    out = _standing(light, view, (far, -60.0, 60.0, 14.0), float(rng.uniform(0.1, 0.6)) * np.ones(light.shape[:2]))
    for side in (-1.0, 1.0):
        across = side * _across(view)
        depth = float(rng.uniform(5.0, 9.0)) / np.maximum(across, 1e-6)
        up = depth * np.tan(view.elevation) + view.camera.mount_height
        house = (across > 0.0) & (depth < far) & (up > 0.0) & (up < float(rng.uniform(8.0, 16.0)))
        shade = float(rng.uniform(0.1, 0.6)) * (1.0 + 0.2 * np.sign(np.sin(depth)))
        out = np.where(house[..., None], shade[..., None], out)
    return out


def turned_away(light: Floats, view: View, rng: Random) -> Floats:
    """Fields across the road: bands of grass, hedge and field, brighter far away."""
    depth = np.where(np.isfinite(view.distance), view.distance, 0.0)
    edges, shades = (6.0, 12.0, 35.0, 60.0, 140.0), rng.uniform(0.03, 0.4, 6)
    shade = np.sort(shades)[np.digitize(depth, edges)] * (1.0 + 0.1 * rng.standard_normal(depth.shape))
    return np.where(np.isfinite(view.distance)[..., None], shade[..., None], light)


KINDS = {
    "plain": Kind(),
    "gamma 2.4": Kind(curve=lambda light, _rng: np.clip(light, 0.0, 1.0) ** (1 / 2.4)),
    "dash-cam knee": Kind(curve=dashcam),
    "film": Kind(curve=film),
    "vivid": Kind(curve=vivid),
    "local tone mapping": Kind(file=locally_mapped),
    "sharpened JPEG": Kind(file=sharpened),
    "overexposed": Kind(exposure=(1.1, 2.0)),
    "vignetting": Kind(enters=vignetted),
    "reflections": Kind(enters=reflected),
    "dirt": Kind(enters=dirty),
    "bonnet": Kind(enters=bonnet),
    "bright road": Kind(scene=bright_road),
    "wet road": Kind(scene=wet_road),
    "convex sky": Kind(enters=convex_sky),
    "arch": _no_lane(arch),
    "sun and shadows": Kind(sunny=True),
    "turned away": _no_lane(turned_away),
    "tower": _no_lane(tower),
    "junction": _no_lane(junction),
    "street": _no_lane(street),
}


@dataclass(frozen=True)
class Frame:
    """A picture, the camera that is assumed, and the truth [m]."""

    image: Pixels
    camera: Camera
    visibility: float


def frames(kind: Kind, name: str, images: int, pool: int) -> Iterator[Frame]:
    """Every photograph of a kind in every fog."""
    numbers = (n for n in itertools.count(FIRST) if photograph(pool, n).is_sunny is kind.sunny)
    for number in itertools.islice(numbers, images):
        taken = photograph(pool, number)
        distance = RoadPlane(Calibration(taken.taken_by)).distance()
        rows = np.arange(taken.taken_by.height, dtype=float)[:, None] * np.ones(distance.shape)
        elevation = np.arctan((taken.taken_by.horizon_row - rows) / taken.taken_by.focal_length)
        view = View(distance, elevation, taken.taken_by)
        for visibility in VISIBILITIES if kind.lane else VISIBILITIES[-1:]:
            rng = np.random.default_rng([49 + POOL - pool, number, sum(name.encode())])
            light = kind.scene(taken.light, view, rng)
            sky = light[np.isinf(distance)]
            air = np.median(sky[np.argsort(sky.sum(axis=1))[-len(sky) // 5 :]], axis=0)
            clear = (
                np.exp(-extinction_from_visibility(visibility) * distance)[..., None] if visibility < math.inf else 1.0
            )
            seen = kind.enters(light * clear + air * (1.0 - clear), view, rng)
            exposed = seen * float(rng.uniform(*kind.exposure)) / float(np.quantile(seen, 0.98))
            noisy = 255.0 * kind.curve(exposed, rng) + rng.normal(0.0, float(rng.uniform(0.4, 2.0)), seen.shape)
            pixels = np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
            yield Frame(np.ascontiguousarray(kind.file(pixels, rng)), taken.told, visibility)


@dataclass(frozen=True)
class Found:
    """An estimate, the truth [m], and the upper end from which on an answer is right in clear air [m]."""

    estimate: Estimate
    truth: float
    most: float

    @property
    def is_false(self) -> bool:
        """Whether it is an answer with an upper end in clear air."""
        return self.truth > CLEAR and self.estimate.valid and self.estimate.visibility_interval[1] < self.most


def summary(found: list[Found]) -> dict[str, str]:
    """Figures of one kind, or of all."""
    fog = [(one.estimate, one.truth) for one in found if one.truth < math.inf]
    valid = [(one, truth) for one, truth in fog if one.valid]
    off = [abs(math.log(max(one.visibility, 1.0) / truth)) if one.extinction > 0 else math.inf for one, truth in valid]
    held = [one.visibility_interval[0] <= truth <= one.visibility_interval[1] for one, truth in valid]
    wrong = sum(far > math.log(WRONG) and not inside for far, inside in zip(off, held, strict=True))
    errors = [min(100.0 * abs(one.visibility / truth - 1.0), 999.0) for one, truth in valid]
    out = {"valid": f"{len(valid)}/{len(fog)}" if fog else "–", "median/p95, %": "–", "hold": "–", "wrong": "–"}
    if valid:
        out["median/p95, %"] = f"{np.median(errors):.0f}/{np.quantile(errors, 0.95):.0f}"
        out |= {"hold": f"{np.mean(held):.2f}", "wrong": str(wrong)}
    return {**out, "false": f"{sum(one.is_false for one in found)}/{len(found) - len(fog)}"}


def estimates(method: str, some: list[Frame], most: float) -> list[Found]:
    """What a method reads from single frames."""
    return [Found(make(method, one.camera).update(Observation(one.image)), one.visibility, most) for one in some]


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        docs=("explanation/estimators.md", "camera kinds"),
        pool=POOL,
        images=(4, "photographs of each kind"),
        methods=(["joint_road"], "estimators"),
        kinds=(list(KINDS), "which kinds", KINDS),
    )
    rows, whole = [], dict[str, list[Found]]()
    for name in progress(given.kinds, "kinds"):
        some = list(frames(KINDS[name], name, given.images, given.pool))
        most = CLEAR if KINDS[name].lane else math.inf
        for method in given.methods:
            found = estimates(method, some, most)
            whole.setdefault(method, []).extend(found)
            rows.append({"kind": name, "method": f"`{method}`", **summary(found)})
    rows += [{"kind": "all", "method": f"`{method}`", **summary(found)} for method, found in whole.items()]
    publish(given, rows)


if __name__ == "__main__":
    main()
