"""What a method of the road makes of what its paper leaves open, camera, wear and noise, and of its own repairs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fogsim.camera import Sensor
from fogsim.estimators import make
from fogsim.estimators.repairs import Repair
from fogsim.render import Renderer
from fogsim.reproduce.result import Cell, Rows, Steps, TitledTable
from fogsim.reproduce.zhu2015_drive import SENSOR, drive, observed
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, Estimate, Observation, Response

CAMERA = Camera(640, 480, 577.0, (319.5, 239.5), mount_height=1.38, pitch=0.035, response=Response.SRGB)
"""That of `zhu2015`'s evaluation, 58° wide: λ = 797 px·m."""

VISIBILITIES = (50.0, 100.0, 200.0, 400.0)
"""Of every drive [m]."""

DRIVES, _FRAMES = 6, 3
"""Drives of each setting, and their frames; the last one's estimate counts."""

GROWTHS = (0.5, 1.0, 2.0, 4.0, 6.0, 8.0, 12.0, 20.0, 40.0)
"""G_max of region growing as published [grey levels]."""

Form = Mapping[str, object]
"""Options of an estimator."""


@dataclass(frozen=True, slots=True)
class Setting:
    """A camera, how much the road's albedo changes along the way [-], and a sensor.

    The true pitch is off the assumed one by 0.1° and sways by 0.05°.
    """

    name: str
    camera: Camera = CAMERA
    wear: float = 0.03
    sensor: Sensor = SENSOR


_NOISY = replace(SENSOR, full_well=SENSOR.full_well / 16.0, read_noise=4.0 * SENSOR.read_noise)
"""Four times the noise."""

SETTINGS = (
    Setting("58°, 1.38 m, wear 3 %"),
    Setting("f = 288 px (96°)", replace(CAMERA, focal_length=288.0)),
    Setting("f = 1154 px (31°)", replace(CAMERA, focal_length=1154.0, pitch=0.02)),
    Setting("mounted 2.5 m high", replace(CAMERA, mount_height=2.5)),
    Setting("linear response", replace(CAMERA, response=Response.LINEAR)),
    Setting("no wear", wear=0.0),
    Setting("wear 10 %", wear=0.1),
    Setting("noise × 4", sensor=_NOISY),
)
"""What is varied, one thing at a time."""


@dataclass(frozen=True, slots=True)
class Driven:
    """Observations of one drive in one fog."""

    visibility: float
    observations: tuple[Observation, ...]


def driven(
    renderer: Renderer, setting: Setting, visibilities: Sequence[float], drives: int, steps: Steps
) -> list[Driven]:
    """Observations of drives along the road alone, in every fog; visibilities in [m]."""
    found = []
    for number in range(drives):
        rng = np.random.default_rng([2013, number])
        moments = list(drive(renderer, setting.camera, _FRAMES, lead=False, rng=rng, wear=setting.wear))
        for visibility in visibilities:
            seen = tuple(observed(moment, setting.camera, visibility, rng, setting.sensor) for moment in moments)
            found.append(Driven(visibility, seen))
        steps.advance()
    return found


def _last_estimate(method: str, camera: Camera, form: Form, one: Driven) -> Estimate:
    """Estimate of a form of a method after the last frame of a drive."""
    estimator = make(method, camera, **form)
    found = [estimator.update(observation) for observation in one.observations]
    return found[-1]


def _without_each(kind: type[Repair]) -> dict[str, Form]:
    """Forms of a method with all repairs, and with all but each."""
    forms: dict[str, Form] = {"all repairs": {}}
    for left_out in kind:
        forms[f"without {left_out.value}"] = {"repairs": [one.value for one in kind if one is not left_out]}
    return forms


def steps_of(drives: int = DRIVES) -> int:
    """Steps that `swept` takes, by drives of each setting."""
    return len(SETTINGS) * drives


def over_growths(name: str, form: Form) -> dict[str, Form]:
    """A form of a method whose region grows with each of `GROWTHS`."""
    return {f"{name}, G_max {growth:g}": {**form, "growth": growth} for growth in GROWTHS}


def swept(
    method: str,
    kind: type[Repair],
    renderer: Renderer,
    steps: Steps,
    drives: int = DRIVES,
    left_open: Mapping[str, Form] | None = None,
) -> tuple[list[dict[str, Cell]], tuple[TitledTable, ...]]:
    """Errors of a method, as published and corrected, over settings, with each repair off, and over what is left open.

    `left_open` has forms with other values of what the paper leaves open, by name; they run in the first setting. A
    record for each setting, form and visibility has the share of drives where fog is found, median error and bias.
    """
    both: dict[str, Form] = {"published": {"as_published": True}, "corrected": {}}
    left_open = left_open or {}
    records: list[dict[str, Cell]] = []
    for setting in SETTINGS:
        seen = driven(renderer, setting, VISIBILITIES, drives, steps)
        forms = both | ({**_without_each(kind), **left_open} if setting is SETTINGS[0] else {})
        for name, form in forms.items():
            for visibility in VISIBILITIES:
                here = [one for one in seen if one.visibility == visibility]
                estimates = [_last_estimate(method, setting.camera, form, one) for one in here]
                records.append(_record(method, setting, name, visibility, estimates))
    shown = {
        "Sweeps of {}": [(setting.name, name) for setting in SETTINGS for name in both],
        "Repairs of {}, each switched off": [(SETTINGS[0].name, name) for name in ("published", *_without_each(kind))],
        "What the paper of {} leaves open": [(SETTINGS[0].name, name) for name in left_open],
    }
    figures = "|error| of V_met, median [%], and share of drives where fog is found, by V_met"
    return records, tuple(
        TitledTable(f"{title.format(method)}: {figures}", _rows(records, wanted))
        for title, wanted in shown.items()
        if wanted
    )


def _record(
    method: str, setting: Setting, form: str, visibility: float, estimates: Sequence[Estimate]
) -> dict[str, Cell]:
    extinctions = [one.extinction for one in estimates if one.valid and one.extinction > 0.0]
    apart = extinction_from_visibility(visibility) / np.array(extinctions) - 1.0
    return {
        "paper": method,
        "table": "sweep",
        "setting": setting.name,
        "form": form,
        "visibility_m": visibility,
        "told_share": len(extinctions) / len(estimates),
        "median_error_pct": 100.0 * float(np.median(np.abs(apart))) if extinctions else None,
        "bias_pct": 100.0 * float(np.median(apart)) if extinctions else None,
    }


def _rows(records: Sequence[Mapping[str, Cell]], wanted: Sequence[tuple[str, str]]) -> Rows:
    rows = [("setting", "form", *(f"{visibility:.0f} m" for visibility in VISIBILITIES))]
    for setting, form in wanted:
        here = [one for one in records if (one["setting"], one["form"]) == (setting, form)]
        rows.append((setting, form, *(_cell(one) for one in here)))
    return tuple(rows)


def _cell(record: Mapping[str, Cell]) -> str:
    error, share = record["median_error_pct"], record["told_share"]
    return "—" if error is None else f"{error:.1f} ({100.0 * float(share or 0.0):.0f} %)"
