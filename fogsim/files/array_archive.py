"""Reading untrusted archives of numpy arrays (``.npz``)."""

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError, shown
from fogsim.files.readers import read_bytes

MOST_UNPACKED = 2**28
"""Largest archive, unpacked [bytes]."""


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Arrays of an archive by name; pickled objects and more than `MOST_UNPACKED` bytes raise InputError."""
    file = io.BytesIO(read_bytes(path))
    try:
        with zipfile.ZipFile(file) as archive:
            is_small = sum(one.file_size for one in archive.infolist()) <= MOST_UNPACKED
        with np.load(file, allow_pickle=False) as arrays:
            found = {name: np.asarray(arrays[name]) for name in arrays.files if is_small}
    except Exception as error:  # numpy, zipfile and zlib each have errors of their own for damage
        reason = f"{type(error).__name__}: {error}"
        raise InputError(f"{path}: expected an archive of arrays (.npz), got {shown(reason)}") from error
    if not is_small:
        raise InputError(f"{path}: cannot be read: larger than {MOST_UNPACKED} bytes, unpacked")
    return found
