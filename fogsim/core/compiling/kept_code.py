"""numba's files of compiled kernels, with a checksum: a damaged file counts as missing."""

import contextlib
import io
import pickle
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from numba.core import caching

from fogsim.core.files.cache_entries import read_entry, write_entry


class KeptCode(caching.IndexDataCacheFile):  # type: ignore[misc] # numba is untyped
    """Index and data files of one kernel, as numba writes them, each followed by its checksum."""

    @classmethod
    def take_over(cls, cache: caching.Cache) -> None:
        """Let a cache read and write these files in place of numba's own."""
        locator = cache._impl.locator
        cache._cache_file = cls(cache.cache_path, cache._impl.filename_base, locator.get_source_stamp())

    def save(self, key: Any, data: Any) -> None:
        """Keep a kernel; where it cannot be written, as on a full disk, the next process compiles again."""
        with contextlib.suppress(OSError):
            super().save(key, data)

    def _load_index(self) -> Any:
        if read_entry(Path(self._index_path)) is None:
            return {}
        try:
            return super()._load_index()
        except Exception:  # noqa: BLE001 - an older version's index names classes that are gone or have changed
            return {}

    def _load_data(self, name: str) -> Any:
        content = read_entry(Path(self._data_path(name)))
        try:
            return pickle.loads(content or b"")  # noqa: S301 - in the user's own cache, or part of the installation
        except Exception as error:
            # numba takes this for a file that has been removed.
            raise OSError(f"{name} is missing, damaged or of an older version") from error

    @contextlib.contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[io.BytesIO]:
        content = io.BytesIO()
        yield content
        write_entry(Path(filepath), content.getvalue())
