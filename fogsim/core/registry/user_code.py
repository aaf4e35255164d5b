"""Users' methods: a class in a module next to the scenario, or an entry point of an installed package."""

import ast
import contextlib
import functools
import hashlib
import importlib
import importlib.util
import inspect
import os
import re
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping
from importlib import metadata
from pathlib import Path
from types import ModuleType
from typing import Any

from fogsim.errors import InputError, shown, suggest

MayImport = Callable[[Path], bool]
"""Decides before an import whether a Python file next to a scenario may be imported, and so run."""

_NAME = re.compile(r"(?P<module>[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*):(?P<object>[A-Za-z_]\w*)\Z")


def import_anything(_: Path) -> bool:
    """Allow every import, as for Python programs that load a scenario."""
    return True


def import_nothing(_: Path) -> bool:
    """Allow no import."""
    return False


def is_class_name(name: object) -> bool:
    """Whether a name is a class in a module, ``module:Class``."""
    return isinstance(name, str) and _NAME.match(name) is not None


def module_file(name: str, folder: Path | None) -> Path:
    """File of the module in ``module:Class`` in the scenario's folder (None for the working directory).

    Neither the standard library nor installed packages are searched: a scenario file must not run their functions.
    """
    module = _match(name)["module"]
    home = (folder or Path.cwd()).resolve()
    base = home.joinpath(*module.split("."))
    files = base.with_name(f"{base.name}.py"), base / "__init__.py"
    found = next((file for file in files if file.is_file()), None)
    if found is None:
        raise InputError(
            f"{name}: there is no {module.replace('.', '/')}.py in {home}; the module of module:Class lies next to the "
            "scenario, and an installed package announces its methods as entry points"
        )
    return found


def check_source(name: str, folder: Path | None) -> None:
    """Raise InputError unless the module of ``module:Class`` defines the class; the module is not run."""
    file = module_file(name, folder)
    try:
        body = ast.parse(file.read_bytes(), str(file)).body
    except (SyntaxError, ValueError, RecursionError, MemoryError, OSError) as error:
        line = getattr(error, "lineno", None)
        raise InputError(f"{name}: {file}{f':{line}' if line else ''}: not valid Python: {error}") from error
    names = [name for statement in body for name in _names_bound(statement)]
    if _match(name)["object"] not in names and "*" not in names:
        raise _no_class(name, file, names)


def _names_bound(statement: ast.stmt) -> Iterator[str]:
    """Names that a statement of a module binds, `*` for those of another module."""
    if isinstance(statement, ast.ClassDef | ast.FunctionDef):
        yield statement.name
    elif isinstance(statement, ast.Import | ast.ImportFrom):
        yield from (one.asname or one.name for one in statement.names)
    else:
        yield from (one.id for one in ast.walk(statement) if isinstance(one, ast.Name))
        yield from (one.name for one in ast.walk(statement) if isinstance(one, ast.ClassDef))


def import_class(name: str, folder: Path | None = None) -> type:
    """Import the class ``module:Class`` from a module in a folder, None for the working directory."""
    file = module_file(name, folder)
    home = (folder or Path.cwd()).resolve()
    module, wanted = _module(name, file, home), _match(name)["object"]
    if not hasattr(module, wanted):
        raise _no_class(name, file, [key for key, value in vars(module).items() if inspect.isclass(value)])
    found = getattr(module, wanted)
    if not inspect.isclass(found):
        raise InputError(f"{name}: expected a class, got {shown(found)}")
    defined_in = getattr(sys.modules.get(found.__module__), "__file__", None)
    if defined_in is None or not Path(defined_in).resolve().is_relative_to(home):
        raise InputError(f"{name}: expected a class defined in {home}, got one of {found.__module__}")
    return found


def _match(name: str) -> re.Match[str]:
    match = _NAME.match(name)
    if match is None:
        raise InputError(f"expected module:Class, got {shown(name)}")
    return match


def _no_class(name: str, file: Path, known: list[str]) -> InputError:
    wanted, public = _match(name)["object"], [one for one in known if not one.startswith("_")]
    return InputError(f"{name}: there is no {wanted} in {file}; {suggest(wanted, public)}")


def _module(name: str, file: Path, home: Path) -> ModuleType:
    try:
        with working_directory_kept():
            return _imported(_match(name)["module"], file, home)
    except KeyboardInterrupt:
        raise
    except InputError:
        raise
    except BaseException as error:  # a module may end the program as it is imported
        raise InputError(f"{name}: its import fails: {described(error, file)}") from error


@functools.cache
def _imported(module: str, file: Path, home: Path) -> ModuleType:
    """A module of a folder; a single file gets a unique name, since other folders may have a file of the same name."""
    if file.parent != home:
        with _found_first(home):
            package = importlib.import_module(module)
        if Path(package.__file__ or "").resolve() != file.resolve():
            raise InputError(f"{module}: {file} cannot be imported: Python has {module} already, from another place")
        return package
    spec = importlib.util.spec_from_file_location(f"{module}_{hashlib.sha256(bytes(file)).hexdigest()[:8]}", file)
    if spec is None or spec.loader is None:
        raise ModuleNotFoundError(name=module)
    made = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = made
    with _found_first(home):
        spec.loader.exec_module(made)
    return made


@contextlib.contextmanager
def _found_first(folder: Path) -> Iterator[None]:
    """Let modules of a folder import one another."""
    sys.path.insert(0, str(folder))
    try:
        yield
    finally:
        sys.path.remove(str(folder))


@contextlib.contextmanager
def working_directory_kept() -> Iterator[None]:
    """Undo a change of the working directory by a user's code: relative paths of inputs and results start there."""
    before = None
    with contextlib.suppress(FileNotFoundError):
        before = Path.cwd()
    try:
        yield
    finally:
        if before is not None:
            # Not every working directory can be entered again by its name, as below a folder of another user.
            with contextlib.suppress(OSError):
                os.chdir(before)


def described(error: BaseException, file: Path | None, otherwise: str = "") -> str:
    """An error of a user's code in one line: its class, its text, and its place in their file or elsewhere."""
    text = " ".join(f"{type(error).__name__}: {error}".split())
    if isinstance(error, SyntaxError) and error.filename:
        return f"{text}, at {error.filename}:{error.lineno}"
    own = [frame for frame in traceback.extract_tb(error.__traceback__) if Path(frame.filename) == file]
    place = f"{own[-1].filename}:{own[-1].lineno}" if own else otherwise or file
    return f"{text}, at {place}" if place else text


def announced(group: str) -> Mapping[str, metadata.EntryPoint]:
    """Entry points of installed packages in a group such as "fogsim.advice", by name."""
    return _announced(group, tuple(sys.path))


@functools.cache
def _announced(group: str, _: tuple[str, ...]) -> Mapping[str, metadata.EntryPoint]:
    """Entry points of a group, read again after a change of the search path."""
    return {point.name: point for point in metadata.entry_points(group=group)}


def load_announced(point: metadata.EntryPoint) -> Any:
    """Import the object of an installed package's entry point."""
    try:
        with working_directory_kept():
            return point.load()
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise InputError(
            f"{point.name} of {point.value}: its import fails: {described(error, None, point.value)}"
        ) from error


def version_of(name: str, group: str, folder: Path | None = None) -> str | None:
    """Version of a user's method: of its package, or a digest of its sources; None for FogSim's methods."""
    if is_class_name(name):
        return digest_of(*source_files(name, folder))
    point = announced(group).get(name)
    return None if point is None or point.dist is None else f"{point.dist.name} {point.dist.version}"


def digest_of(*files: Path) -> str:
    """Version of files: a digest of their content."""
    return f"sha256:{hashlib.sha256(b''.join(file.read_bytes() for file in files)).hexdigest()[:16]}"


def source_files(name: str, folder: Path | None) -> list[Path]:
    """File of the module in ``module:Class``, then all files of the folder that it imports, directly or not."""
    home = (folder or Path.cwd()).resolve()
    sources = list(dict.fromkeys([module_file(name, folder), *_files_of(_match(name)["module"], home)]))
    for source in sources:  # grows on the way
        for level, imported in _imported_names(source, source.stat().st_mtime_ns):
            start = source.parents[level - 1] if 0 < level <= len(source.parents) else home
            sources += [one for one in _files_of(imported, start) if one not in sources]
    return sources


def _files_of(module: str, start: Path) -> list[Path]:
    """Files of a module and its packages in a folder; without any if it is not from there."""
    parts = module.split(".")
    bases = [start.joinpath(*parts[:number]) for number in range(1, len(parts) + 1)]
    return [
        file for base in bases for file in (base / "__init__.py", base.with_name(f"{base.name}.py")) if file.is_file()
    ]


@functools.lru_cache
def _imported_names(file: Path, _: int) -> tuple[tuple[int, str], ...]:
    """Level (0 for absolute) and name of each import in a file, read again after the file has changed."""
    try:
        nodes = [*ast.walk(ast.parse(file.read_bytes(), str(file)))]
    except (SyntaxError, ValueError, RecursionError, MemoryError, OSError):
        return ()
    plain = [(0, one.name) for node in nodes if isinstance(node, ast.Import) for one in node.names]
    # What is imported from a package may be a module of it.
    return (
        *plain,
        *(
            (node.level, ".".join(filter(None, (node.module, one.name))))
            for node in nodes
            if isinstance(node, ast.ImportFrom)
            for one in node.names
        ),
    )
