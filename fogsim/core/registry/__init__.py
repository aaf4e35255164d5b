"""A registry: one mapping from names to factories per type; docs, command line and schema read it."""

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

from fogsim.core.parameters import checked_parameters, parameter_mistakes, paths_in
from fogsim.core.registry.guard import guarded
from fogsim.core.registry.user_code import (
    MayImport,
    announced,
    check_source,
    digest_of,
    import_anything,
    import_class,
    is_class_name,
    load_announced,
    module_file,
    version_of,
)
from fogsim.errors import InputError, UnknownNameError, shown

T = TypeVar("T")


class Registry(Mapping[str, T]):
    """Named factories of one type; duplicates are refused, and unknown names raise an error that lists the known ones.

    It also finds users' classes: ``module:Class`` next to a scenario, and entry points of `group` in installed
    packages. They must have `methods` ("a|b" for either) and are guarded: they raise only `MethodError` and
    KeyboardInterrupt. And it makes methods of files: ``onnx:model.onnx`` next to a scenario is made by `files["onnx"]`,
    from its name, path and time limit. An entry "package.module:name" is imported on first use, and `prepared`.
    """

    def __init__(
        self,
        kind: str,
        entries: Mapping[str, T | str],
        group: str = "",
        methods: Sequence[str] = (),
        files: Mapping[str, Callable[[str, Path, float | None], T]] = MappingProxyType({}),
        prepared: Callable[[T], T] = lambda factory: factory,
    ) -> None:
        self.kind = kind
        self._entries = dict(entries)
        self._prepared = prepared
        self._group = group
        self._methods = tuple(methods)
        self.files = dict(files)

    def register(self, name: str, factory: T) -> None:
        """Add a factory; ValueError if the name is taken."""
        if name in self._entries:
            raise ValueError(f"{self.kind} {name!r} is registered already")
        self._entries[name] = factory

    def registered(self, name: str) -> Callable[[T], T]:
        """Class decorator that adds a factory under a new name: ``@ADVISERS.registered("cautious")``."""

        def add(factory: T) -> T:
            self.register(name, factory)
            return factory

        return add

    @property
    def known(self) -> list[str]:
        """Sorted names of all entries and of installed packages' entry points."""
        return sorted({*self._entries, *(announced(self._group) if self._group else ())})

    def find(self, name: str, folder: Path | None = None, time_limit: float | None = None) -> T:
        """The factory of a name, an entry point, ``module:Class`` or a file in `folder` (None: the working directory).

        `time_limit` bounds each call of a user's method [s]. Raises UnknownNameError, or InputError if the import fails
        or the class does not fit.
        """
        try:
            entry = self._entries[name]
        except (KeyError, TypeError):
            pass
        else:
            return self._imported(name, entry) if isinstance(entry, str) else entry
        if (file := self._file(name, folder)) is not None:
            return self.files[name.partition(":")[0]](name, file, time_limit)
        if self._group and is_class_name(name):
            return self._guarded(name, import_class(name, folder), time_limit)
        further = announced(self._group) if self._group else {}
        if name not in further:
            raise UnknownNameError(self.kind, name, self.known) from None
        return self._guarded(name, load_announced(further[name]), time_limit)

    def _imported(self, name: str, entry: str) -> T:
        module, _, own = entry.partition(":")
        factory: T = self._prepared(getattr(import_module(module), own))
        self._entries[name] = factory
        return factory

    def find_if_allowed(self, name: str, folder: Path | None, may_import: MayImport = import_anything) -> T | None:
        """As `find`, but None for a user's class whose file defines it and may not be imported."""
        is_own = name in self._entries or self._file(name, folder) is not None
        is_in_folder = bool(self._group) and not is_own and is_class_name(name)
        if is_in_folder and not may_import(module_file(name, folder)):
            check_source(name, folder)
            return None
        return self.find(name, folder)

    def version(self, name: str, folder: Path | None = None) -> str | None:
        """Version of a user's method, a digest for a file; None for FogSim's own and for registered ones."""
        if (file := self._file(name, folder)) is not None:
            return digest_of(file)
        return None if name in self._entries else version_of(name, self._group, folder)

    def _file(self, name: object, folder: Path | None) -> Path | None:
        """File that a method is made of; None for a method of another type."""
        kind, _, file = name.partition(":") if isinstance(name, str) else ("", "", "")
        return (folder or Path.cwd()) / file if file and kind in self.files else None

    def _guarded(self, name: str, cls: Any, time_limit: float | None) -> T:
        if not inspect.isclass(cls):
            raise InputError(f"{self.kind} {name!r}: expected a class, got {shown(cls)}")
        lacking = [wanted for wanted in self._methods if not any(_has_method(cls, one) for one in wanted.split("|"))]
        if lacking:
            needed = " and ".join(f"{wanted.replace('|', '() or ')}()" for wanted in lacking)
            raise InputError(f"{self.kind} {name!r} must have a method {needed}")
        methods = tuple(one for wanted in self._methods for one in wanted.split("|"))
        make: Callable[..., Any] = guarded
        try:
            factory: T = make(cls, f"{self.kind} {name!r}", methods, time_limit)
            inspect.signature(factory, eval_str=True)  # type: ignore[arg-type] # it is a class
        except Exception as error:  # of a metaclass, a decorator, or an annotation
            raise InputError(f"{self.kind} {name!r}: not a class that FogSim can use: {error}") from error
        return factory

    def __getitem__(self, name: str) -> T:
        return self.find(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)

    def __contains__(self, name: object) -> bool:
        if name in self._entries or self._file(name, None) is not None:
            return True
        return bool(self._group) and (is_class_name(name) or name in announced(self._group))


def _has_method(cls: type, name: str) -> bool:
    return callable(getattr(cls, name, None))


def parameters(factory: Callable[..., object]) -> dict[str, object]:
    """Names and defaults of a factory's optional parameters."""
    return {
        parameter.name: parameter.default
        for parameter in inspect.signature(factory).parameters.values()
        if parameter.default is not parameter.empty
    }


def make(registry: Registry[Callable[..., T]], name: str, *arguments: object, **options: object) -> T:
    """Call a registered factory; InputError if it has no such parameter or the value does not fit its annotation."""
    factory = registry[name]
    by_place = list(inspect.signature(factory).parameters)[: len(arguments)]
    mistakes = [f"{option}: {mistake}" for option, mistake in parameter_mistakes(factory, options, by_place)]
    if mistakes:
        raise InputError(f"{registry.kind} {name!r}: " + "; ".join(mistakes))
    return factory(*arguments, **options)


@checked_parameters
@dataclass(frozen=True, slots=True)
class MethodConfig:
    """A method of a registry, and its parameters.

    Parameters
    ----------
    name : str
        Name in the registry, of an entry point, ``module:Class``, or of a file in `folder`.
    parameters : mapping from str to object
        Keyword arguments of the method, in SI units; names of files are relative to `folder`.
    folder : Path
        Folder of the user's modules and files.
    time_limit : float or None
        Longest time that one call of a user's method may take [s].
    """

    name: str
    parameters: Mapping[str, Any] = field(default_factory=dict)
    folder: Path = Path()
    time_limit: float | None = None

    def make(self, registry: Registry[Callable[..., T]], *given: object) -> T:
        """Call the factory that a registry has under the name.

        Parameters
        ----------
        registry : Registry
            The registry.
        *given : object
            Arguments before the parameters.
        """
        factory = registry.find(self.name, self.folder, self.time_limit)
        paths = paths_in(factory, self.parameters, self.folder)
        return factory(*given, **{**self.parameters, **{name: str(path) for name, path in paths.items()}})
