"""Check docstrings and words: public names have all of numpydoc's sections that they need, internal ones stay short.

    python tools/check_docstrings.py

Public is what a package exports that docs/reference/python documents, with its bases and methods. What is registered
under a name may be described at length too. Everything else has one sentence with units, in at most `MOST_LINES` lines;
`LONGER` internal docstrings still have more, and that number may only fall. Docstrings and docs must not contain
`AVOIDED` words, which make text read like a translation; code and generated tables may.
"""

import ast
import importlib
import inspect
import pkgutil
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import fogsim
from fogsim.core.registry import Registry

ROOT = Path(__file__).resolve().parents[1]
MOST_LINES, LONGER = 4, 332
FOLDERS = ("fogsim", "envs", "tools", "benchmarks", "docs")
AVOIDED = re.compile(r"\b(told|tells?|anew|likewise|thereof|therein|as\s+of|of\s+which|nobody|everybody)\b", re.I)
CODE = re.compile(r"<!-- table:.*?<!-- end of|^```.*?^```|^    \S[^\n]*$|`[^`]*`", re.DOTALL | re.MULTILINE)
Place = tuple[Path, str]


def exported() -> set[Place]:
    """File and qualified name of every class and function of the documented packages."""
    pages = (ROOT / "docs/reference/python").glob("*.md")
    return {place for page in pages for thing in _documented(page) for place in _places(thing)}


def registered() -> set[Place]:
    """The same of everything that has a name in a registry."""
    modules = [module.name for module in pkgutil.walk_packages(fogsim.__path__, "fogsim.")]
    held = [vars(importlib.import_module(name)).values() for name in modules if name != "fogsim.__main__"]
    tables = [value for values in held for value in values if isinstance(value, Registry)]
    return {place for table in tables for entry in table.values() for place in _places(entry)}


def _documented(page: Path) -> Iterator[object]:
    for name in re.findall(r"^::: (\S+)", page.read_text(encoding="utf-8"), re.MULTILINE):
        try:
            thing: object = importlib.import_module(name)
        except ImportError:
            parent, _, own = name.rpartition(".")
            thing = getattr(importlib.import_module(parent), own)
        if isinstance(thing, ModuleType):
            names = getattr(thing, "__all__", [name for name in vars(thing) if not name.startswith("_")])
            yield from (getattr(thing, name) for name in names)
        else:
            yield thing


def _places(thing: object) -> Iterator[Place]:
    bare = inspect.unwrap(thing) if callable(thing) else thing
    for one in inspect.getmro(bare) if inspect.isclass(bare) else (bare,) if inspect.isfunction(bare) else ():
        if one.__module__.startswith("fogsim"):
            yield Path(inspect.getsourcefile(sys.modules[one.__module__]) or ""), one.__qualname__


def _documented_nodes(tree: ast.AST, above: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], ast.AST]]:
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            if ast.get_docstring(node):
                yield (*above, node.name), node
            yield from _documented_nodes(node, (*above, node.name))
        elif isinstance(node, ast.If | ast.Try):
            yield from _documented_nodes(node, above)


def _is_of(file: Path, names: tuple[str, ...], known: set[Place]) -> bool:
    hidden = any(name.startswith("_") for name in names[1:])
    return (file, ".".join(names)) in known or ((file, names[0]) in known and not hidden)


def _undescribed(node: ast.AST) -> list[str]:
    """Parameters of a public function that its docstring does not name."""
    if not isinstance(node, ast.FunctionDef) or node.name.startswith("_"):
        return []
    every = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
    names = [one.arg for one in every if one.arg not in {"self", "cls"} and not one.arg.startswith("_")]
    text = (ast.get_docstring(node) or "").partition("Parameters\n")[2]
    return [name for name in names if not re.search(rf"\b{name}\b", text)]


def avoided() -> Iterator[str]:
    """File and line of each avoided word."""
    for file, line, text in (*_pages(), *_docstrings()):
        for word in AVOIDED.finditer(text):
            at = line + text.count("\n", 0, word.start())
            yield f"{file.relative_to(ROOT)}:{at}: {word[0]!r} is to be avoided; rewrite the sentence"


def _pages() -> Iterator[tuple[Path, int, str]]:
    for page in (*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")):
        yield page, 1, CODE.sub(lambda code: "\n" * code[0].count("\n"), page.read_text(encoding="utf-8"))


def _docstrings() -> Iterator[tuple[Path, int, str]]:
    for file in (file for folder in FOLDERS for file in (ROOT / folder).rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            match node:
                case ast.Expr(value=ast.Constant(value=str(text))):
                    yield file, node.lineno, re.sub(r"`[^`\n]*`", "", text)


def main() -> None:
    """Print what is wrong, with exit code 1."""
    public, wrong, longer = exported(), [*avoided()], 0
    known = public | registered()
    for folder in ("fogsim", "envs/fogsim_envs"):
        for file in sorted((ROOT / folder).rglob("*.py")):
            for names, node in _documented_nodes(ast.parse(file.read_text(encoding="utf-8"))):
                where = f"{file.relative_to(ROOT)}: {'.'.join(names)}"
                if not _is_of(file, names, known):
                    text = node.body[0]  # type: ignore[attr-defined]  # classes and functions alone come here
                    longer += text.end_lineno - text.lineno >= MOST_LINES
                elif _is_of(file, names, public) and (missing := _undescribed(node)):
                    wrong.append(f"{where} is public and does not describe {', '.join(missing)}")
    if longer > LONGER:
        wrong.append(f"{longer} internal docstrings are longer than {MOST_LINES} lines; allowed are {LONGER}")
    sys.exit("\n".join(wrong) or None)


if __name__ == "__main__":
    main()
