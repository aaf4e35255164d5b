"""Time that the air takes: least and median milliseconds of one call of `Air.radiance` on a flat road.

``fog`` is even fog of 100 m, a bank, or a bank of ground fog; ``lamps`` says whether low beams are lit; ``changing``
whether the extinction is another one in every frame, so that whatever depends on it is set up again. The longest call
(ms_max) shows hitches; the first call of each case, which compiles, is not counted.

    python benchmarks/air.py [--json] [--repeat 40]
"""

import argparse
import dataclasses
import json
import statistics
import time

import numpy as np

from fogsim.atmosphere import Air
from fogsim.lighting import own_head_lamps
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, CameraPose, FogBank, FogChange, FogField, Lamp, Lights, LightSources, View
from fogsim.values.pinhole import ray_from_pixel

POSE = CameraPose((0.0, 0.0, 1.38), 0.0)
AIRLIGHT = (3000.0, 3000.0, 3000.0)
BANK = FogBank((0.0, 0.0), (1.0, 0.0), 60.0, 400.0, 50.0, extinction_from_visibility(60.0))
EVEN = FogField(extinction_from_visibility(100.0), AIRLIGHT)
FIELDS = {
    "even": EVEN,
    "bank": dataclasses.replace(EVEN, extinction=extinction_from_visibility(1000.0), banks=(BANK,)),
    "bank of ground fog": dataclasses.replace(EVEN, extinction=0.003, banks=(BANK,), scale_height=8.0),
}


def flat_road(camera: Camera) -> View:
    """A grey road under a grey sky."""
    v, u = np.mgrid[0 : camera.height, 0 : camera.width]
    rays = np.stack((u, v, np.ones_like(u)), axis=-1) @ ray_from_pixel(camera, POSE).T
    down = -rays[..., 2] / np.linalg.norm(rays, axis=-1)
    distance = np.where(down > 0, POSE.position[2] / np.maximum(down, 1e-9), np.inf).astype(np.float32)
    grey = np.full((*distance.shape, 3), 300.0, np.float32)
    response = np.where(np.isfinite(distance), 0.0125, 0.0)[..., None].repeat(3, axis=-1).astype(np.float32)
    return View(grey, distance, np.zeros(distance.shape, np.int32), response)


def measure(width: int, height: int, fog: str, lit: bool, changing: bool, repeat: int) -> dict[str, object]:
    """One record."""
    camera = Camera(width, height, 0.9 * width, (width / 2, height / 2), 1.38, pitch=0.035)
    field = FIELDS[fog]
    if changing:  # base and top stay where they are
        field = dataclasses.replace(
            field, changes=(FogChange(0.0, 1.0, field.base, field.top), FogChange(100.0, 2.0, field.base, field.top))
        )
    own = own_head_lamps(Lamp.LOW_BEAM, camera.mount_height) if lit else ()
    air, view, lights, spent = Air(field), flat_road(camera), Lights(own, LightSources.none()), []
    for number in range(repeat + 1):
        started = time.perf_counter()
        air.radiance(view, camera, POSE, lights, time=float(number))
        spent.append(1e3 * (time.perf_counter() - started))
    kept = spent[1:]
    return {
        "fog": fog,
        "lamps": lit,
        "changing": changing,
        "width": width,
        "height": height,
        "ms_median": round(statistics.median(kept), 3),
        "ms_min": round(min(kept), 3),
        "ms_max": round(max(kept), 3),
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    parser.add_argument("--repeat", type=int, default=40, help="calls of each case")
    arguments = parser.parse_args()
    cases = [(fog, lit, changing) for fog in FIELDS for lit in (False, True) for changing in (False, True)]
    sizes = ((160, 120), (640, 480))
    records = [measure(*size, *case, arguments.repeat) for size in sizes for case in cases]
    if arguments.json:
        print(json.dumps(records, indent=2))
        return
    print("  ".join(f"{key:>18}" for key in records[0]))
    for record in records:
        print("  ".join(f"{value!s:>18}" for value in record.values()))


if __name__ == "__main__":
    main()
