"""SUMO inside this process: the libsumo library, imported on first use."""

import contextlib
import gc
import io
import locale
import os
import sys
import tempfile
import threading
import warnings
import weakref
from collections.abc import Iterator, Sequence
from types import ModuleType
from typing import ClassVar

from fogsim.core.files.standard_streams import open_standard_streams
from fogsim.errors import MissingDependencyError, SimulationError, SimulationRunningError
from fogsim.traffic.sumo.claims import LoadMark
from fogsim.traffic.sumo.link import Api, translated_errors
from fogsim.traffic.sumo.load_errors import located
from fogsim.traffic.sumo.output_folder import OutputFolder

_BEGINNING = threading.Lock()


def load_libsumo() -> ModuleType:
    """Import libsumo without the lines that it prints on the way."""
    try:
        # libsumo prints a remark about other packages' versions to stdout, which may carry JSON of ours.
        with contextlib.redirect_stdout(io.StringIO()):
            import libsumo  # noqa: PLC0415 - importing fogsim must not load SUMO
    except ImportError as error:
        raise MissingDependencyError(
            f"libsumo cannot be loaded ({error}); install it with: pip install libsumo, "
            "and on Debian/Ubuntu: sudo apt-get install libgl1 libxrender1 libatomic1"
        ) from error
    module: ModuleType = libsumo
    return module


def _refuse_commas() -> None:
    if (point := locale.localeconv()["decimal_point"]) != ".":
        raise SimulationError(
            f"SUMO cannot read numbers such as 0.5 where a process has set a locale that writes 0{point}5, as "
            "locale.setlocale(locale.LC_ALL, '') and some user interfaces do: call "
            "locale.setlocale(locale.LC_NUMERIC, 'C') after them"
        )


class LibsumoLink:
    """SUMO inside this process, through libsumo; one at a time."""

    remote = False
    shared = False
    _begun: "ClassVar[tuple[weakref.ref[LibsumoLink], LoadMark] | None]" = None
    """The link that began a simulation last, and a mark in that simulation; None after its end."""

    def __init__(self, outputs: OutputFolder | None = None) -> None:
        self._outputs = outputs
        self._sumo: ModuleType | None = None
        self._arguments: Sequence[str] = ()

    def begin(self, arguments: Sequence[str]) -> Api:
        """Start SUMO here, or load it again; see `SumoLink.begin`."""
        # Of threads that begin together, each would find none running, and the last one's would replace the others'.
        with _BEGINNING:
            return self._begin(arguments)

    def _begin(self, arguments: Sequence[str]) -> Api:
        _refuse_commas()
        sumo = load_libsumo()
        if sumo.isLoaded() and self._sumo is None:
            self._make_room(sumo)
        if self._outputs is not None:
            arguments = [*arguments, *self._outputs.open()]
        self._arguments = arguments
        with _captured_stderr() as words:
            try:
                if self._sumo is None:
                    sumo.start(["sumo", *arguments])
                else:
                    sumo.load(list(arguments))
            except sumo.TraCIException as error:
                failure = error
            else:
                failure = None
        self._sumo = sumo
        lines = [line.strip() for line in words if line.strip()]
        if failure is None:
            LibsumoLink._begun = weakref.ref(self), LoadMark(sumo, "link")
            self._check_outputs()
            errors = [line for line in lines if line.startswith("Error")]
            if errors:
                warnings.warn(located("SUMO goes on after an error", " ".join(errors), arguments), stacklevel=2)
            return sumo
        self.end()
        # What ends SUMO is either there, or in libsumo's error alone.
        if all(line.startswith("Warning") for line in lines):
            lines.insert(0, str(failure))
        message = located("SUMO cannot load the scenario", " ".join(lines), arguments)
        if self._outputs is not None:
            message = self._outputs.shorten(message)
        raise SimulationError(message)

    def _make_room(self, sumo: ModuleType) -> None:
        """Close the simulation of a link that was dropped without `end`, as by a notebook's cell; refuse others."""
        link, mark = LibsumoLink._begun or (None, None)
        if link is not None and link() is not None:
            gc.collect()
        if link is None or link() is not None or mark is None or not mark.is_there():
            raise SimulationRunningError(
                "another SUMO simulation runs in this process, and libsumo can hold only one: close the other one "
                "first, or run this one in its own process (gymnasium's AsyncVectorEnv does that for "
                "environments)"
            )
        sumo.close()

    def _check_outputs(self) -> None:
        if self._outputs is None:
            return
        self._outputs.report_lost()
        twice = self._outputs.twice()
        if twice:
            self.end()
            raise SimulationError(
                f"SUMO would write several outputs into one file: {', '.join(twice)}. All go into one folder, so give "
                "those that lie in different ones different names"
            )

    def step(self) -> None:
        """Move the simulation by one step; see `SumoLink.step`."""
        if self._sumo is None:
            return
        try:
            self._sumo.simulationStep()
        except self._sumo.FatalTraCIError as error:
            if not self._sumo.isLoaded():
                raise
            # SUMO reads vehicles while it runs, and finds mistakes in them only then.
            raise SimulationError(located("SUMO cannot go on", str(error), self._arguments)) from error

    def end(self) -> None:
        """End the simulation; see `SumoLink.end`."""
        if self._sumo is not None and self._sumo.isLoaded():
            self._sumo.close()
        if self._sumo is not None:
            self._sumo = LibsumoLink._begun = None
        if self._outputs is not None:
            self._outputs.close()

    def warnings(self) -> Sequence[str]:
        """What SUMO has warned of until its `end`; see `SumoLink.warnings`."""
        return () if self._outputs is None else self._outputs.warnings

    def translated_errors(self) -> contextlib.AbstractContextManager[None]:
        """Turn what libsumo refuses into an error of ours; see `SumoLink.translated_errors`."""
        return translated_errors(self._sumo or load_libsumo(), "in this process")


@contextlib.contextmanager
def _captured_stderr() -> Iterator[list[str]]:
    """Collect what native code writes to the process's stderr; the list is filled on leaving."""
    lines: list[str] = []
    open_standard_streams()
    sys.stderr.flush()
    saved = os.dup(2)
    with tempfile.TemporaryFile() as file:
        os.dup2(file.fileno(), 2)
        try:
            yield lines
        finally:
            os.dup2(saved, 2)
            os.close(saved)
            file.seek(0)
            lines += file.read().decode(errors="replace").splitlines()
