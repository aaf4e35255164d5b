"""Write the shapes of vehicles that FogSim draws, from the models in ``tools/vehicle_bodies``.

    python tools/make_bodies.py

The file is written only where anything in it changes. It takes a few seconds, and trimesh.
"""

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vehicle_bodies import MODELS, body_meshes
from vehicle_bodies.lamp_patches import lamp_patches

FILE = Path(__file__).resolve().parents[1] / "fogsim" / "scene" / "data" / "bodies.npz"


def pack_bodies() -> dict[str, NDArray[np.generic]]:
    """Arrays of the file: all shapes' one after another, and how many rows belong to each."""
    shapes = body_meshes()
    lamps = [lamp_patches(shapes[name]) for name in MODELS]
    patches = [patch for own in lamps for patch in own]
    return {
        "names": np.array(list(shapes)),
        "vertices": np.array([len(shape.positions) for shape in shapes.values()], np.int32),
        "triangles": np.array([len(shape.faces) for shape in shapes.values()], np.int32),
        "positions": np.concatenate([shape.positions for shape in shapes.values()]),
        "normals": np.concatenate([shape.normals for shape in shapes.values()]),
        "reflectance": np.concatenate([shape.reflectance for shape in shapes.values()]),
        "surface": np.concatenate([shape.surface for shape in shapes.values()]).astype(np.uint8),
        "faces": np.concatenate([shape.faces for shape in shapes.values()]).astype(np.uint16),
        "size": np.array([model.size for model in MODELS.values()]),
        "lamps": np.array([len(own) for own in lamps], np.int32),
        "lamp_surface": np.array([patch.surface for patch in patches], np.uint8),
        "lamp_front": np.array([patch.front for patch in patches]),
        "lamp_centre": np.array([patch.centre for patch in patches]),
        "lamp_area": np.array([patch.area for patch in patches]),
    }


def main() -> int:
    """Write the file."""
    packed = pack_bodies()
    if FILE.exists():
        with np.load(FILE) as file:
            if file.files == list(packed) and all(np.array_equal(file[name], packed[name]) for name in packed):
                return 0
    np.savez_compressed(FILE, allow_pickle=False, **packed)
    return 0


if __name__ == "__main__":
    sys.exit(main())
