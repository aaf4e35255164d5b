"""Belaroussi & Gruyer (2015), section 5: visibility from the distances at which signs of the map are first detected."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fogsim.calibration.sign_calibration import (
    PoseNoise,
    SignDrive,
    cropped,
    measure_operating_range,
    observed,
    sign_beside,
)
from fogsim.estimators.signs.belaroussi2015 import Belaroussi2015
from fogsim.estimators.signs.operating_range import OperatingRange
from fogsim.estimators.signs.regions import PoseDeviation
from fogsim.estimators.signs.watch import SignWatch, Watched
from fogsim.reproduce.result import Cell, PaperCell, Reproduction, Rows, Watch, chosen_tables, figure_image, unwatched
from fogsim.values import Camera, Observation, Response

_MARKS = ("o", "s", "^", "D")


def _picture(
    records: Sequence[Mapping[str, Cell]],
    ranges: Sequence[tuple[str, OperatingRange]],
    published: Mapping[float, float | None],
) -> NDArray[np.uint8]:
    """Draw operating ranges by camera on the left, estimates and the paper's on the right: (rows, cols, 3) uint8."""
    figure = Figure(figsize=(12.0, 5.0), dpi=100, layout="constrained")
    left, right = figure.subplots(1, 2)
    _draw_ranges(left, ranges)
    _draw_estimates(right, records, [name for name, _ in ranges], published)
    return figure_image(figure)


def _draw_ranges(axes: Axes, ranges: Sequence[tuple[str, OperatingRange]]) -> None:
    for number, (name, measured) in enumerate(ranges):
        colour, mark = f"C{number}", _MARKS[number % len(_MARKS)]
        axes.errorbar(
            measured.first_detection, measured.visibility, xerr=measured.deviation, fmt=mark, color=colour, label=name
        )
        axes.plot(measured.operating_range, measured.visibility, mark, mfc="none", color=colour)
        low, high = measured.reach
        if low < high:
            distances = np.linspace(low, high, 100).tolist()
            found = [measured.visibility_at(distance) for distance in distances]
            axes.plot(distances, [np.nan if one is None else one[0] for one in found], color=colour)
        reach = np.linspace(min(measured.operating_range), max(measured.operating_range), 100)
        axes.plot(reach, np.polyval(measured.cubic, reach), ":", color=colour)
    axes.set(xlabel="distance of first detection (open: of 80 % detection) [m]", ylabel="V_met [m]", ylim=(0.0, 700.0))
    axes.set_title("Operating range; dotted: cubic through 80 %", fontsize=10)
    axes.legend(title="focal length", loc="upper left")


def _draw_estimates(
    axes: Axes, records: Sequence[Mapping[str, Cell]], names: Sequence[str], published: Mapping[float, float | None]
) -> None:
    truth = list(published)
    axes.plot(truth, truth, color="0.6", lw=1)
    known = [(v, value) for v, value in published.items() if value is not None]
    axes.plot(*zip(*known, strict=True), "x", color="black", ms=9, label="the paper's text")
    for number, name in enumerate(names):
        mine = [record for record in records if record["camera"] == name]
        for key, fill, label in (("ours_m", f"C{number}", "ours"), ("cubic_m", "none", "cubic")):
            points = [(record["visibility_m"], record[key]) for record in mine if record[key] is not None]
            if points:
                mark = _MARKS[number % len(_MARKS)]
                axes.plot(*zip(*points, strict=True), mark, color=f"C{number}", mfc=fill, label=f"{name}, {label}")
    axes.set(xlabel="true V_met [m]", ylabel="estimated V_met [m]", ylim=(0.0, 600.0))
    axes.legend(loc="upper left", fontsize=8)


_KINDS = ("speed_limit", "pedestrian_crossing", "stop")
"""Kinds of the paper's signs, in turn."""

_DIAMETER = 0.9
"""Size of their faces [m]."""

STEP, _IMAGES = 5.0, 504
"""Way between two images [m], and how many there are in each fog."""

_APART, _FIRST = 100.0, 600.0
"""Way between two signs, and to the first of them [m]; not given in the paper."""

REACH = 560.0
"""How far ahead the map is read [m]."""

PUBLISHED = {100.0: 72.0, 150.0: 172.0, 200.0: 218.0, 250.0: 245.0, 300.0: 285.0, 400.0: None}
"""Visibilities of the six fogs, and what the paper's section 5.2 says was estimated [m]; it prints none for 400 m."""

_LARGEST_ERRORS: Mapping[str, tuple[float, tuple[float, ...]]] = {
    "dense fog": (28.0, (100.0, 150.0)),
    "moderate fog": (18.0, (200.0, 250.0)),
    "light fog": (25.0, (300.0, 400.0)),
}
"""Section 5.2's limits of the errors, and the fogs that they are of [m]."""

_TABLES = ("figure 4",)
"""Parts of the evaluation that can be run alone: that is all of it."""

_APPROACHES = 12
"""Drives of each calibration."""

_CALIBRATED = (60.0, 80.0, 110.0, 150.0, 200.0, 260.0, 330.0, 400.0, 500.0, 650.0)
"""Visibilities of the calibration [m], other ones than those of the evaluation but for one."""

_NOTES = (
    "The paper prints neither camera, sign size, spacing nor the coefficients of its curve. Ours: signs of"
    f" {_DIAMETER} m (speed limit, pedestrian crossing, stop) every {_APART:.0f} m, images of 1400x600 px every"
    f" {STEP:.0f} m, {_IMAGES} in each fog, and two cameras. The map errs by 0.5 m, the heading by 0.2°, the stated"
    " pitch by 0.1° (standard deviations).",
    "Calibration: drives of their own up to single signs (`fogsim calibrate signs`), with other numbers drawn. 'ours'"
    " is a monotone curve through the distances of first detection; it abstains where resolution and not fog sets them"
    " ('at least'). 'cubic' is the paper's polynomial of third degree through the distances of 80 % detection; no"
    " mark shows where it is flat.",
    "With 1400 px a sign of 0.9 m comes out at 209 m, three pixels in radius, in any fog from about 175 m on: the"
    " paper's range to 400 m needs a lens such as the second one, or larger signs.",
)


@dataclass(frozen=True, slots=True)
class Setup:
    """A camera of the evaluation, and its name in the table."""

    name: str
    camera: Camera


def _camera(focal_length: float) -> Camera:
    return Camera(1400, 600, focal_length, (699.5, 299.5), 1.4, pitch=0.01, response=Response.SRGB)


_SETUPS = (Setup("1400 px", _camera(1400.0)), Setup("3400 px", _camera(3400.0)))
"""53° across, as cameras behind windscreens, and 23°."""


_QUICK_APPROACHES = 4
"""Drives of each calibration of a quick evaluation; half of the images would leave an estimate to two signs."""


def reproduce(
    images: int = _IMAGES,
    setups: Sequence[Setup] = _SETUPS,
    approaches: int | None = None,
    *,
    fogs: Sequence[float] = _CALIBRATED,
    quick: bool = False,
    table: str | None = None,
    watch: Watch = unwatched,
) -> Reproduction:
    """Drive past signs in each fog; an image is a step, `approaches` and `fogs` [m] are the calibration's."""
    chosen_tables(_TABLES, table)
    approaches = approaches or (_QUICK_APPROACHES if quick else _APPROACHES)
    share, records, ranges = approaches + images // 10 + 1, list[dict[str, Cell]](), list[OperatingRange]()
    total = share * len(setups)
    for number, setup in enumerate(setups):

        def calibrating(done: int, _: int, before: int = number * share) -> None:
            watch(before + done, total)

        measured = measure_operating_range(
            setup.camera, _DIAMETER, fogs, approaches=approaches, seed=1, watch=calibrating
        )
        ranges.append(measured)
        found: list[dict[str, Cell]] = []
        for image, known in enumerate(_track(setup, measured, images)):
            found = known
            if image % 10 == 0:
                watch(number * share + approaches + image // 10, total)
        records += found
    watch(total, total)
    drawing = _picture(records, list(zip([setup.name for setup in setups], ranges, strict=True)), PUBLISHED)
    cells = tuple(cell for setup in setups for cell in paper_cells(setup.name, records))
    return Reproduction("belaroussi2015", tuple(records), _table(records), _NOTES, drawing, cells=cells)


def paper_cells(camera: str, records: Sequence[Mapping[str, Cell]]) -> Iterator[PaperCell]:
    """Final estimates, and largest errors by class of fog and of all, of one camera."""
    found = {record["visibility_m"]: record for record in records if record["camera"] == camera}
    forms = ("cubic_m", "ours_m")
    for visibility, printed in PUBLISHED.items():
        if printed is not None:
            published, corrected = (_metres(found[visibility][form]) for form in forms)
            row = f"f = {camera}, V_met {visibility:g} m"
            yield PaperCell("section 5.2", row, "estimate [m]", printed, published, corrected, truth=visibility)
    overall = max(error for error, _ in _LARGEST_ERRORS.values())
    for name, (largest, fogs) in {**_LARGEST_ERRORS, "all fogs": (overall, tuple(PUBLISHED))}.items():
        published, corrected = (_largest_error([found[visibility] for visibility in fogs], form) for form in forms)
        of_fogs = f"f = {camera}, {name}"
        yield PaperCell("section 5.2", of_fogs, "largest error [m]", largest, published, corrected, "at_most")


def _metres(cell: Cell) -> float | None:
    return None if cell is None else float(cell)


def _largest_error(records: Sequence[Mapping[str, Cell]], form: str) -> float | None:
    """Largest error of a form's estimates [m]; None if one is missing."""
    errors = [
        None if one[form] is None else abs(float(str(one[form])) - float(str(one["visibility_m"]))) for one in records
    ]
    return None if None in errors else max(error for error in errors if error is not None)


class _SharedWatch(SignWatch):
    """Looks once at each observation for all forms of the method, which look for signs in the same way."""

    _last: tuple[Observation, Watched] | None = None

    def look(self, observation: Observation) -> Watched:
        """Look, or remember what was seen."""
        if self._last is None or self._last[0] is not observation:
            self._last = observation, super().look(observation)
        return self._last[1]


def _track(setup: Setup, measured: OperatingRange, images: int) -> Iterator[list[dict[str, Cell]]]:
    """Drive the track in all fogs at once; after each image what is known so far."""
    rng = np.random.default_rng(20)
    places = tuple((STEP * np.arange(images)).tolist())
    wanted = np.arange(_FIRST, max(places[-1], _FIRST + 1.0), _APART).tolist()
    signs = tuple(sign_beside(f"s{i}", _KINDS[i % len(_KINDS)], x, _DIAMETER, rng) for i, x in enumerate(wanted))
    camera = cropped(setup.camera)
    drive = SignDrive(camera, signs, places, PoseNoise(), 200.0, REACH)
    watches = {v: _SharedWatch(camera, None, PoseDeviation()) for v in PUBLISHED}
    ours = {v: Belaroussi2015(camera).calibrated(measured, watches[v]) for v in PUBLISHED}
    cubic = {v: Belaroussi2015(camera, as_published=True).calibrated(measured, watches[v]) for v in PUBLISHED}
    last: dict[float, dict[str, Cell]] = {v: {} for v in PUBLISHED}
    for image, seen in enumerate(observed(drive, tuple(PUBLISHED), rng)):
        for visibility, observation in seen.items():
            estimate, published = ours[visibility].update(observation), cubic[visibility].update(observation)
            least = estimate.diagnostics.get("visibility_at_least")
            last[visibility] = {
                "camera": setup.name,
                "visibility_m": visibility,
                "images": image + 1,
                "ours_m": round(estimate.visibility, 1) if estimate.valid else None,
                "ours_deviation_m": round(estimate.visibility * estimate.standard_deviation / estimate.extinction, 1)
                if estimate.valid
                else None,
                "at_least_m": None if least is None else round(float(str(least)), 1),
                "signs": int(str(estimate.diagnostics.get("signs", 0))),
                "cubic_m": round(published.visibility, 1) if published.valid else None,
            }
        yield list(last.values())


def _table(records: Sequence[Mapping[str, Cell]]) -> Rows:
    return (("camera", "V_met [m]", "cubic [m]", "ours [m]", "signs"), *map(_row, records))


def _row(record: Mapping[str, Cell]) -> tuple[str, ...]:
    cubic, ours, least = (_metres(record[key]) for key in ("cubic_m", "ours_m", "at_least_m"))
    if ours is not None:
        estimate = f"{ours:.0f} ± {_metres(record['ours_deviation_m']):.0f}"
    else:
        estimate = "—" if least is None else f"at least {least:.0f}"
    first = "—" if cubic is None else f"{cubic:.0f}"
    return (str(record["camera"]), f"{_metres(record['visibility_m']):.0f}", first, estimate, str(record["signs"]))
