"""Train a small network to read the visibility in frames, and compare it with joint_road on cameras that it never saw.

    pip install 'fogsim[rl,onnx]' onnxscript
    python examples/train_onnx_estimator.py --minutes 3 --out network.onnx
    fogsim estimate drive.mp4 --camera camera.yaml --method onnx:network.onnx

The first run draws 184 short drives into --frames, about five minutes on one core; later ones read them. Of the drives
with the training camera, 72 train the network, 24 calibrate its intervals, and 24 test it; that camera on other roads
and three other cameras have 16 drives each. Fogs, light, traffic and seeds differ in all. Results are printed as a
table of Markdown.
"""

import argparse
import json
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import onnx
import torch
from numpy.typing import NDArray

import fogsim
from fogsim.dataset import read_png
from fogsim.estimators import conformal_factor, make
from fogsim.values import Camera, Observation

ROWS, COLUMNS = 48, 64
"""Size of the network's input [px]."""

ROADS, OTHER_ROADS = ("motorway_fog_bank", "graded_motorway"), ("ramp_merge", "stopped_queue_behind_curve")
OWN = "its own"
DRIVEN = {
    OWN: (ROADS, ()),
    "its own, other roads": (OTHER_ROADS, ()),
    "a truck's": (ROADS, ("camera.mount_height_m=2.6", "camera.pitch_deg=5", "camera.field_of_view_deg=70")),
    "a narrow one": (ROADS, ("camera.mount_height_m=1.2", "camera.pitch_deg=0.5", "camera.field_of_view_deg=35")),
    "a linear one": (ROADS, ("camera.response=linear", "camera.exposure.target_percent=45")),
}
"""Roads and settings of each camera; the first trains the network."""

OWN_DRIVES, OTHER_DRIVES, FRAMES = 120, 16, 8
TRAINING, CALIBRATION = slice(0, 72), slice(72, 96)
LEVELS = (30.0, 50.0, 100.0, 200.0, 500.0)
"""Ends of the levels of visibility whose errors are printed [m]."""

RENAMED = {"focal_length_px": "focal_length", "principal_point_px": "principal_point", "mount_height_m": "mount_height"}
RENAMED |= {"pitch_rad": "pitch", "roll_rad": "roll"}


@dataclass
class Drive:
    """Frames of a drive, the camera that its vehicle assumes, and the true extinction of each [1/m]."""

    images: list[NDArray[np.uint8]]
    camera: Camera
    extinction: NDArray[np.float64]


def drives(camera: str, count: int, folder: Path, first_seed: int) -> list[Drive]:
    """Draw drives with a camera, each in its own fog, or read those that were drawn before."""
    found, (roads, changed) = [], DRIVEN[camera]
    for seed in range(first_seed, first_seed + count):
        rng = np.random.default_rng(seed)
        visibility = math.exp(rng.uniform(math.log(LEVELS[0]), math.log(LEVELS[-1])))
        settings = [f"fog.visibility_m={visibility:.1f}", f"light.illuminance_lx={rng.uniform(2e3, 3e4):.0f}"]
        settings += ["camera.width=320", "camera.height=240", "clocks.camera_period_s=1", "clocks.decision_period_s=1"]
        settings += ["estimators=[scatterometer]", *changed]  # an estimator that costs nothing
        out = folder / f"{seed:06d}"
        fogsim.write_dataset(fogsim.load_scenario(roads[seed % 2], settings), out, FRAMES, seed=seed)
        records = json.loads((out / "annotations.json").read_text(encoding="utf-8"))["images"]
        assumed = {RENAMED.get(key, key): value for key, value in records[0]["camera"]["told"].items()}
        images = [read_png(out / record["file_name"]) for record in records]
        found.append(Drive(images, Camera(**assumed), np.array([record["extinction_per_m"] for record in records])))
        print(f"\r{camera}: {len(found)} of {count} drives", end="", flush=True)
    print()
    return found


def inputs(chosen: Sequence[Drive]) -> torch.Tensor:
    """Frames as FogSim gives them to a network: averaged over areas, 0 … 1, channels first."""
    full = (image.astype(np.float32) / 255.0 for drive in chosen for image in drive.images)
    scaled = [cv2.resize(image, (COLUMNS, ROWS), interpolation=cv2.INTER_AREA) for image in full]
    return torch.from_numpy(np.stack(scaled).transpose(0, 3, 1, 2).copy())


def truths(chosen: Sequence[Drive]) -> NDArray[np.float64]:
    """True ln k of all frames."""
    return np.log(np.concatenate([drive.extinction for drive in chosen]))


class Network(torch.nn.Module):
    """Three convolutions and a linear layer that knows the rows: a frame to ln k and its standard deviation."""

    def __init__(self) -> None:
        super().__init__()
        self.layers = torch.nn.Sequential(
            torch.nn.Conv2d(3, 16, 3, 2, 1), torch.nn.ReLU(),
            torch.nn.Conv2d(16, 32, 3, 2, 1), torch.nn.ReLU(),
            torch.nn.Conv2d(32, 32, 3, 2, 1), torch.nn.ReLU(),
            torch.nn.Flatten(), torch.nn.Linear(32 * (ROWS // 8) * (COLUMNS // 8), 2),
        )  # fmt: skip

    def forward(self, frame: torch.Tensor) -> torch.Tensor:
        """(n, 3, H, W) in 0 … 1 to (n, 2)."""
        found = self.layers(frame - 0.5)
        deviation = 0.02 + torch.nn.functional.softplus(found[:, 1:] - 2.0)
        return torch.cat([found[:, :1] - 3.5, deviation], dim=1)


def train(frames: torch.Tensor, truth: NDArray[np.float64], minutes: float) -> Network:
    """Fit a network by its likelihood, on frames mirrored and of other exposures, until the time is up."""
    network, target = Network(), torch.from_numpy(truth).float()
    optimiser = torch.optim.AdamW(network.parameters(), lr=1e-3, weight_decay=1e-2)
    begin, epochs = time.monotonic(), 0
    while (elapsed := (time.monotonic() - begin) / (60.0 * minutes)) < 1.0:
        optimiser.param_groups[0]["lr"] = 1e-3 * (1.0 - elapsed)
        for batch in torch.randperm(len(frames)).split(64):
            seen = frames[batch] * torch.empty(len(batch), 1, 1, 1).uniform_(0.8, 1.2)
            seen = torch.where(torch.rand(len(batch), 1, 1, 1) < 0.5, seen.flip(3), seen).clamp(0.0, 1.0)
            mean, deviation = network(seen).unbind(1)
            loss = (0.5 * ((target[batch] - mean) / deviation) ** 2 + deviation.log()).mean()
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
        epochs += 1
    print(f"trained on {len(frames)} frames, {epochs} times each")
    return network.eval()


def save(network: Network, calibration: Sequence[Drive], out: Path) -> None:
    """Write the network with its calibration, in one file."""
    with torch.no_grad():
        answers = network(inputs(calibration)).double().numpy()
    factor = conformal_factor(answers[:, 0], answers[:, 1], truths(calibration))
    print(f"deviations times {factor:.2f}, so that 90 % intervals hold")
    example = (torch.zeros(1, 3, ROWS, COLUMNS),)
    torch.onnx.export(network, example, out, external_data=False, verbose=False)
    model = onnx.load(out)
    onnx.helper.set_model_props(model, {"fogsim.conformal": f"{factor:.4f}"})
    onnx.save(model, out)


def rows(camera: str, chosen: Sequence[Drive], methods: Sequence[str]) -> Iterator[str]:
    """Rows of the table: errors of each method with a camera."""
    true = math.log(20.0) / np.exp(truths(chosen))
    for method in methods:
        found = [make(method, drive.camera).update(Observation(image)) for drive in chosen for image in drive.images]
        valid = np.array([one.valid and one.extinction > 0.0 for one in found])
        value = np.array([one.visibility for one in found])
        low, high = np.array([one.visibility_interval for one in found]).T
        error, held = np.abs(value - true), (low <= true) & (true <= high)
        cells = [f"{100.0 * np.median(error[valid] / true[valid]):.0f} %"]
        for least, most in pairwise(LEVELS):
            counts = valid & (least <= true) & (true < most)
            mean = error[counts].mean() if counts.any() else math.inf
            cells.append("–" if mean == math.inf else f"{mean:.1f}" if mean < 10.0 else f"{mean:.0f}")
        name = "network" if method.startswith("onnx:") else f"`{method}`"
        yield f"| {camera} | {name} | {' | '.join(cells)} | {np.mean(held[valid]):.2f} | {valid.mean():.2f} |"


def main() -> None:
    """Draw, train, calibrate, save and compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=3.0, help="how long to train")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--frames", type=Path, default=Path("runs/network_frames"), help="folder of the data sets")
    parser.add_argument("--out", type=Path, default=Path("network.onnx"))
    asked = parser.parse_args()
    torch.set_num_threads(1)
    torch.manual_seed(asked.seed)
    found = {}
    for number, camera in enumerate(DRIVEN):
        count = OWN_DRIVES if camera == OWN else OTHER_DRIVES
        found[camera] = drives(camera, count, asked.frames, 10_000 * asked.seed + 1000 * number)
    own = found[OWN]
    network = train(inputs(own[TRAINING]), truths(own[TRAINING]), asked.minutes)
    save(network, own[CALIBRATION], asked.out)
    found[OWN] = own[CALIBRATION.stop :]
    levels = " | ".join(f"{low:.0f}–{high:.0f} m" for low, high in pairwise(LEVELS))
    print(f"| camera | method | median error | {levels} | intervals hold | valid |\n|{' --- |' * 9}")
    for camera, chosen in found.items():
        print(*rows(camera, chosen, (f"onnx:{asked.out}", "joint_road")), sep="\n")


if __name__ == "__main__":
    main()
