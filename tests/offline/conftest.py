"""A drive through fog of a known visibility, drawn by FogSim, as files that a dash camera could have left."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from early_motorway import EARLY
from numpy.typing import NDArray
from PIL import Image

import fogsim
from fogsim.recorders.video import Encoder, encoder_command
from fogsim.values import Camera
from tests.helpers.camera_files import camera_yaml

VISIBILITY = 120.0


@dataclass(frozen=True)
class Drive:
    """Frames of one drive, ten a second."""

    folder: Path
    frames: tuple[NDArray[np.uint8], ...]
    camera: Camera
    speed: float

    @property
    def camera_yaml(self) -> str:
        one, size = self.camera, (self.camera.width, self.camera.height)
        place, pitch = one.principal_point, math.degrees(one.pitch)
        return camera_yaml(size, one.focal_length, place, one.mount_height, pitch, one.response.value)


@pytest.fixture(scope="session")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Drive:
    """``images/000.png`` …, ``drive.mp4`` and ``camera.yaml`` in a folder that no test may change."""
    folder = tmp_path_factory.mktemp("drive")
    scenario = fogsim.load_scenario("motorway_fog_bank", [EARLY, f"fog.visibility_m={VISIBILITY}", "duration_s=0.7"])
    observations = [step.observation for step in fogsim.run(scenario, seed=1)]
    seen = [one.frame for one in observations]
    frames, camera = tuple(frame.image for frame in seen), seen[0].camera
    (folder / "images").mkdir()
    for index, frame in enumerate(frames):
        Image.fromarray(frame).save(folder / "images" / f"{index:03d}.png")
    encoder = Encoder(encoder_command(folder / "drive.mp4", 0.1, (camera.width, camera.height)))
    for frame in frames:
        encoder.write(frame.tobytes())
    encoder.finish()
    speed = float(np.mean([one.speed for one in observations]))
    made = Drive(folder, frames, camera, speed)
    (folder / "camera.yaml").write_text(made.camera_yaml, encoding="utf-8")
    return made
