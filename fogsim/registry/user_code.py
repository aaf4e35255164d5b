"""Methods of users' own: an object of a module of theirs, or one that an installed package announces."""

import contextlib
import functools
import hashlib
import importlib
import importlib.util
import re
import sys
import traceback
from collections.abc import Iterator, Mapping
from importlib import metadata
from pathlib import Path
from types import ModuleType
from typing import Any

from fogsim.errors import InputError, suggest

_NAME = re.compile(r"(?P<module>[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*):(?P<object>[A-Za-z_]\w*)\Z")


def is_object_name(name: object) -> bool:
    """Tell whether a name is one of an object in a module: ``module:Object``.

    Parameters
    ----------
    name : object
        What a user has given.
    """
    return isinstance(name, str) and _NAME.match(name) is not None


def import_object(name: str, folder: Path | None = None) -> Any:
    """Import an object of a user's module.

    Parameters
    ----------
    name : str
        ``module:Object``; the module lies in the folder, or is one that Python finds.
    folder : Path or None
        Where the scenario lies that names it; None for the working directory.

    Raises
    ------
    InputError
        If there is no such module or object, or its import fails; the message says where.
    """
    match = _NAME.match(name)
    if match is None:
        raise InputError(f"expected module:Object, got {name!r}")
    module = _module(match["module"], (folder or Path.cwd()).resolve())
    if not hasattr(module, match["object"]):
        own = {key: value for key, value in vars(module).items() if callable(value) and not key.startswith("_")}
        public = [key for key, value in own.items() if getattr(value, "__module__", None) == module.__name__]
        raise InputError(
            f"{name}: there is no {match['object']} in {module.__file__}; {suggest(match['object'], public)}"
        )
    return getattr(module, match["object"])


def _module(name: str, folder: Path) -> ModuleType:
    package = folder / name.partition(".")[0]
    beside = package.with_suffix(".py").is_file() or (package / "__init__.py").is_file()
    try:
        return _module_beside(name, folder) if beside else importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name != name:
            raise InputError(f"{name}: its import fails: {error}, at {_place(error)}") from error
        raise InputError(
            f"{name}: there is no such module, neither in {folder} nor where Python looks (PYTHONPATH)"
        ) from error
    except Exception as error:
        raise InputError(f"{name}: its import fails: {type(error).__name__}: {error}, at {_place(error)}") from error


@functools.cache
def _module_beside(name: str, folder: Path) -> ModuleType:
    """A module in a folder, under a name of its own: another folder may have one that is called the same."""
    if "." in name or (folder / name / "__init__.py").is_file():
        with _found_first(folder):
            return importlib.import_module(name)
    file = folder / f"{name}.py"
    spec = importlib.util.spec_from_file_location(f"{name}_{hashlib.sha256(bytes(file)).hexdigest()[:8]}", file)
    if spec is None or spec.loader is None:
        raise ModuleNotFoundError(name=name)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    with _found_first(folder):
        spec.loader.exec_module(module)
    return module


@contextlib.contextmanager
def _found_first(folder: Path) -> Iterator[None]:
    """Let modules of a folder find one another while they are imported."""
    sys.path.insert(0, str(folder))
    try:
        yield
    finally:
        sys.path.remove(str(folder))


def _place(error: BaseException) -> str:
    """File and line of the user's where an error arose."""
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if "importlib" not in frame.filename]
    if isinstance(error, SyntaxError):
        return f"{error.filename}:{error.lineno}"
    return f"{frames[-1].filename}:{frames[-1].lineno}" if frames else "its first line"


def announced(group: str) -> Mapping[str, metadata.EntryPoint]:
    """What installed packages announce under a group of entry points, by name.

    Parameters
    ----------
    group : str
        The group, such as "fogsim.advice".
    """
    return _announced(group, tuple(sys.path))


@functools.cache
def _announced(group: str, _: tuple[str, ...]) -> Mapping[str, metadata.EntryPoint]:
    """What is announced, read anew when packages are looked for elsewhere."""
    return {point.name: point for point in metadata.entry_points(group=group)}


def load_announced(point: metadata.EntryPoint) -> Any:
    """Import what an installed package announces.

    Parameters
    ----------
    point : EntryPoint
        Of `announced`.

    Raises
    ------
    InputError
        If its import fails.
    """
    try:
        return point.load()
    except Exception as error:
        told = f"{type(error).__name__}: {error}, at {_place(error)}"
        raise InputError(f"{point.name} of {point.value}: its import fails: {told}") from error


def version_of(name: str, group: str, folder: Path | None = None) -> str | None:
    """Version of a method that is not FogSim's: of its package, or a digest of the file that it stands in.

    Parameters
    ----------
    name : str
        ``module:Object``, or a name that an installed package announces.
    group : str
        Group of entry points of its kind.
    folder : Path or None
        As of `import_object`.

    Returns
    -------
    str or None
        None if the method is neither, and so FogSim's own.
    """
    if is_object_name(name):
        module = sys.modules.get(import_object(name, folder).__module__)
        file = getattr(module, "__file__", None)
        return None if file is None else f"sha256:{hashlib.sha256(Path(file).read_bytes()).hexdigest()[:16]}"
    point = announced(group).get(name)
    return None if point is None or point.dist is None else f"{point.dist.name} {point.dist.version}"
