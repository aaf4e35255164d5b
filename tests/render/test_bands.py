"""Pictures of which two threads draw a part each."""

import threading
from typing import Any

import numpy as np
import pytest

from fogsim.atmosphere.fog.koschmieder import fogged_radiance
from fogsim.camera.exposure import Sensor, expose
from fogsim.core import jit
from fogsim.core.jit import Bands
from fogsim.render import make_renderer
from fogsim.scene import vehicle_batches
from fogsim.values import Camera, FogBank, FogField, Response, View


def test_pictures_do_not_depend_on_the_bands(place: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    vehicles, size = vehicle_batches(place.traffic, None), Camera(400, 300, 360.0, (200.0, 150.0), 1.38, roll=0.02)
    monkeypatch.setattr(jit, "processors", lambda: 1)
    whole = make_renderer("cpu", place.scene, 9e3).render(vehicles, size, place.pose, lamplight=True)
    monkeypatch.setattr(jit, "processors", lambda: 2)
    for middle in (0.2, 0.47, 0.83):
        monkeypatch.setattr(Bands, "__init__", lambda self, middle=middle: setattr(self, "middle", middle))
        renderer = make_renderer("cpu", place.scene, 9e3)
        banded = renderer.render(vehicles, size, place.pose, lamplight=True)
        for name in ("radiance", "distance", "instance", "lamp_response"):
            assert np.array_equal(getattr(whole, name), getattr(banded, name)), (name, middle)


def test_every_row_is_worked_on_once_and_a_slower_band_has_fewer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jit, "processors", lambda: 2)
    bands, before = Bands(), threading.active_count()
    for _ in range(20):
        rows = np.zeros(500, np.int64)

        def count(band: int, top: int, bottom: int, rows: np.ndarray = rows) -> None:
            rows[top:bottom] += 1 + band

        bands.work(count, 500, 500)
        assert set(rows.tolist()) == {1, 2}
    assert threading.active_count() == before

    def slow_below(band: int, top: int, bottom: int) -> None:
        if band == 1:
            sum(i * i for i in range(20_000))

    bands = Bands()
    for _ in range(5):
        bands.work(slow_below, 1000, 1000)
    assert bands.middle > 0.6


def test_small_pictures_and_single_processors_have_one_band(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[int, int, int]] = []
    for processors, side in ((2, 100), (1, 1000)):
        monkeypatch.setattr(jit, "processors", lambda count=processors: count)
        Bands().work(lambda *band: seen.append(band), side, side)
    assert seen == [(0, 0, 100), (0, 0, 1000)]


@pytest.mark.parametrize("failing", [0, 1])
def test_failures_of_either_band_are_raised(failing: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jit, "processors", lambda: 2)

    def fail(band: int, top: int, bottom: int) -> None:
        if band == failing:
            raise ValueError(f"band {band}")

    with pytest.raises(ValueError, match=f"band {failing}"):
        Bands().work(fail, 1000, 1000)


def test_neither_fog_nor_noise_depends_on_the_bands(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(1)
    shape = (300, 400)
    view = View(rng.random((*shape, 3), np.float32), 300 * rng.random(shape, np.float32), np.zeros(shape, np.int32))
    bank = FogBank((0.0, 0.0), (1.0, 0.0), 30.0, 90.0, 20.0, 0.01)
    field = FogField(0.02, (0.5, 0.5, 0.5), top=9.0, banks=(bank,))
    rays = np.array([[0, 0, 1.0], [-0.01, 0, 2], [0, -0.01, 1.5]])
    pictures = []
    for processors in (1, 2):
        monkeypatch.setattr(jit, "processors", lambda count=processors: count)
        light = fogged_radiance(view, field, (0.0, 0.0, 1.4), rays)
        pictures.append((light, expose(light, Sensor(1.2), Response.SRGB, np.random.default_rng(2))))
    for one, two in zip(*pictures, strict=True):
        assert np.array_equal(one, two)
