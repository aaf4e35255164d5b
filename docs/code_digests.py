"""Which files the figures of a script depend on, with digests that comments and docstrings do not change.

They are the modules of this repository that a script imports, directly or not, also within functions; the data files
next to them; and the shipped scenarios that they name. Less than that runs, since modules import what they may need:
where digests have changed, figures may have moved; where none has, they have not. Scripts in docs/ count only
where a measurement names them, and their imports are not followed, since these write tables of many kinds.
"""

import ast
import hashlib
import json
import os
import re
from collections.abc import Iterable, Iterator
from functools import cached_property
from pathlib import Path

SOURCES = (
    ("fogsim", "fogsim"),
    ("envs/fogsim_envs", "fogsim_envs"),
    *((folder, "") for folder in ("benchmarks", "tests/pictures", "tests/data", "tools")),
)
"""Folders in which imports are searched, each with the name of its package, if it is one."""

DATA = {".csv", ".frag", ".json", ".npz", ".sumocfg", ".vert", ".xml", ".yaml"}
"""Suffixes of the data files that results depend on."""


class Checkout:
    """Imports and digests of a checkout's files; its .cache/ keeps them, since parsing all takes seconds."""

    def __init__(self, root: Path, without: tuple[str, ...] = ()) -> None:
        """With `without`, folders that never count."""
        self.root, self._memory, self._without = root, root / ".cache" / "digests.json", without
        known = self._memory.read_text(encoding="utf-8") if self._memory.exists() else "{}"
        self._known: dict[str, tuple[str, list[str]]] = json.loads(known)
        self._read: dict[str, tuple[str, list[str]] | None] = {}
        self._next: dict[str, list[str]] = {}
        self._remembered = len(self._known)

    def files(self, entries: Iterable[str]) -> dict[str, str]:
        """Digests of the files that scripts, data and folders depend on, by path; missing entries are left out."""
        to_do, found = [path for entry in entries for path in self._expanded(entry)], {}
        while to_do:
            path = to_do.pop()
            if path not in found and not path.startswith(self._without) and (look := self._look(path)) is not None:
                found[path] = look[0]
                to_do += self.next_files(path)
        self._remember()
        return dict(sorted(found.items()))

    def next_files(self, path: str) -> list[str]:
        """Files that a file imports or names, and the data next to it."""
        if path not in self._next:
            look = self._look(path)
            names = look[1] if look and not path.startswith("docs/") else ()
            self._next[path] = [*self._beside(path), *(one for name in names for one in self._named(name, path))]
        return self._next[path]

    def changed(self, files: dict[str, str]) -> list[str]:
        """The files whose digests have changed, or that are gone."""
        counting = {path: digest for path, digest in files.items() if not path.startswith(self._without)}
        paths = [path for path, digest in counting.items() if (self._look(path) or ("",))[0] != digest]
        self._remember()
        return paths

    def _expanded(self, entry: str) -> Iterator[str]:
        path = self.root / entry
        inside = sorted(one for one in path.rglob("*") if one.suffix in DATA) if path.is_dir() else [path]
        yield from (one.relative_to(self.root).as_posix() for one in inside if one.is_file())

    def _beside(self, path: str) -> Iterator[str]:
        """Data in the folder of a package's module, and in subfolders that are not packages."""
        folder = (self.root / path).parent
        if path.endswith(".py") and (folder / "__init__.py").exists():
            for one in folder.iterdir():
                if (one.is_dir() and not (one / "__init__.py").exists()) or one.suffix in DATA:
                    yield from self._expanded(one.relative_to(self.root).as_posix())

    def _named(self, name: str, by: str) -> Iterator[str]:
        """Files of a module, of its parent packages, or of a shipped scenario, which `fogsim` itself does not name."""
        if name in self._scenarios and (not by.startswith("fogsim/") or by.startswith("fogsim/reproduce/")):
            yield from self._expanded(name.replace(".", "/"))
        parts = self._lazy.get(name, name).split(".")
        names = [".".join(parts[:count]) for count in range(1, len(parts) + 1)]
        yield from (self._modules[one] for one in names if one in self._modules)

    @cached_property
    def _modules(self) -> dict[str, str]:
        """Files by the names of their modules."""
        found = {}
        for folder, name in SOURCES:
            for file in sorted((self.root / folder).glob("**/*.py" if name else "*.py")):
                inside = file.relative_to(self.root / folder).with_suffix("").parts
                parts = (*name.split(), *(part for part in inside if part != "__init__"))
                found[".".join(parts)] = file.relative_to(self.root).as_posix()
        return found

    @cached_property
    def _scenarios(self) -> set[str]:
        return {f"scenarios.{file.parent.name}" for file in self.root.glob("scenarios/*/scenario.yaml")}

    @cached_property
    def _lazy(self) -> dict[str, str]:
        """Modules of the names that `fogsim` imports on first use."""
        file = self.root / "fogsim" / "__init__.py"
        nodes = ast.walk(ast.parse(file.read_text(encoding="utf-8"))) if file.exists() else ()
        found = [node for node in nodes if isinstance(node, ast.ImportFrom)]
        return {f"fogsim.{one.name}": f"{node.module}.{one.name}" for node in found for one in node.names}

    def _look(self, path: str) -> tuple[str, list[str]] | None:
        if path not in self._read:
            file = self.root / path
            self._read[path] = self._parsed(path, file.read_bytes()) if file.is_file() else None
        return self._read[path]

    def _parsed(self, path: str, content: bytes) -> tuple[str, list[str]]:
        raw = hashlib.sha256(content).hexdigest()[:16]
        if path.endswith(".yaml"):
            return raw[:8], [
                f"scenarios.{name}" for name in re.findall(r"^scenario: *(\w+)", content.decode(), re.MULTILINE)
            ]
        if not path.endswith(".py"):
            return raw[:8], []
        if raw not in self._known:
            tree = ast.parse(content)
            names = [] if path == "fogsim/__init__.py" else sorted(set(imported(tree)))
            self._known[raw] = (hashlib.sha256(flat(tree).encode()).hexdigest()[:8], names)
        return self._known[raw]

    def _remember(self) -> None:
        if len(self._known) > self._remembered:
            self._memory.parent.mkdir(parents=True, exist_ok=True)
            # Another process may read it meanwhile.
            written = self._memory.with_suffix(f".{os.getpid()}")
            written.write_text(json.dumps(self._known), encoding="utf-8")
            written.replace(self._memory)
            self._remembered = len(self._known)


def flat(tree: ast.AST) -> str:
    """A syntax tree as text, the same from every version of Python, without docstrings and empty fields."""
    parts, to_do = [], [tree]
    while to_do:
        node = to_do.pop()
        if not isinstance(node, ast.AST):
            parts.append(repr(node))
            continue
        parts.append(type(node).__name__)
        for field, value in ast.iter_fields(node):
            values = [one for one in value if not _unread(one)] if isinstance(value, list) else [value]
            if (value is None and field != "value") or values == []:
                continue
            parts.append(field)
            to_do += values
    return " ".join(parts)


def _unread(node: object) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def imported(tree: ast.AST) -> Iterator[str]:
    """Names of modules that code imports or names in strings, ``fogsim.NAME``, and words that may name a scenario."""
    to_do = [tree]
    while to_do:
        node = to_do.pop()
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            continue
        if isinstance(node, ast.Import):
            yield from (one.name for one in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield from (f"{node.module}.{one.name}" for one in node.names)
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "fogsim":
            yield f"fogsim.{node.attr}"
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            if re.fullmatch(r"fogsim(_envs)?\.[\w.]+(:\w+)?", node.value):
                yield node.value.partition(":")[0]
            elif re.fullmatch(r"\w+", node.value):
                yield f"scenarios.{node.value}"
        to_do += ast.iter_child_nodes(node)
