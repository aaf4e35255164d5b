"""YAML to plain data, with numbers as they are written, within limits of size, depth and count."""

import math
import re
from typing import Any

import yaml
from yaml.reader import ReaderError

from fogsim.errors import is_name, shown

KeyPath = tuple[str | int, ...]

MOST_BYTES = 1_000_000
"""Largest text that is read."""

MOST_NODES = 20_000
"""Maximum number of keys and values, with repetitions by aliases."""

DEEPEST = 40
"""Maximum depth of blocks and lists."""

_MOST_DIGITS = 300
"""Maximum length of a number."""

_MERGE = "tag:yaml.org,2002:merge"
_TEXT = "tag:yaml.org,2002:str"
_FLOAT = "tag:yaml.org,2002:float"


class PlainYamlError(Exception):
    """Text that is not YAML, or holds more than plain data; `line` counts from 1."""

    def __init__(self, problem: str, line: int | None = None) -> None:
        super().__init__(problem)
        self.problem, self.line = problem, line


class _Loader(yaml.SafeLoader):
    """Numbers of YAML 1.2: ``1e4`` is one, ``010`` is ten, and ``1:30`` and dates are text."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._depth = self._nodes = 0

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        event = self.peek_event()  # type: ignore[no-untyped-call]  # the stubs leave it untyped
        line = event.start_mark.line + 1
        if getattr(event, "tag", None) is not None:
            raise PlainYamlError(f"tags are not used here, got {shown(event.tag)}", line)
        self._depth, self._nodes = self._depth + 1, self._nodes + 1
        _check_limits(self._depth, self._nodes, line)
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node


def _whole_number(_: yaml.SafeLoader, node: yaml.ScalarNode) -> int | float:
    if len(node.value) > _MOST_DIGITS:
        raise PlainYamlError(f"a number has at most {_MOST_DIGITS} digits, got {shown(node.value)}", _line(node))
    return int(node.value)


# Those of YAML 1.1 would take precedence.
_Loader.yaml_implicit_resolvers = {}
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:bool", re.compile(r"(?i:yes|no|true|false|on|off)\Z"), list("yYnNtTfFoO")
)
_Loader.add_implicit_resolver("tag:yaml.org,2002:null", re.compile(r"(?:~|null|Null|NULL|)\Z"), ["~", "n", "N", ""])
_Loader.add_implicit_resolver(_MERGE, re.compile(r"<<\Z"), ["<"])
_Loader.add_implicit_resolver("tag:yaml.org,2002:int", re.compile(r"[-+]?[0-9]+(?:_[0-9]+)*\Z"), list("-+0123456789"))
_Loader.add_implicit_resolver(
    _FLOAT,
    re.compile(
        r"(?:[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))\Z"
    ),
    list("-+.0123456789"),
)
_Loader.add_constructor("tag:yaml.org,2002:int", _whole_number)


class Dumper(yaml.SafeDumper):
    """Quotes texts that this or the older version of YAML would read as something else, such as 08."""


Dumper.yaml_implicit_resolvers = {
    first: [*yaml.SafeDumper.yaml_implicit_resolvers.get(first, ()), *_Loader.yaml_implicit_resolvers.get(first, ())]
    for first in {*yaml.SafeDumper.yaml_implicit_resolvers, *_Loader.yaml_implicit_resolvers}
}


def parse_yaml(text: str) -> tuple[Any, dict[KeyPath, int]]:
    """Plain data of a YAML text, and the line of each key and list entry.

    All keys become text; only null, booleans, numbers, text, lists and mappings are allowed. Duplicate keys, tags, and
    texts beyond the limits raise PlainYamlError.
    """
    try:
        loader = _Loader(text)
        root = loader.get_single_node()
        lines: dict[KeyPath, int] = {}
        if root is None:
            return None, lines
        _Walk(lines).visit(root, (), 1)
        return loader.construct_document(root), lines
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        message = ", ".join(part for part in (error.context, error.problem) if part)
        raise PlainYamlError(message, None if mark is None else mark.line + 1) from error
    except ReaderError as error:
        line = 1 + text[: error.position].count("\n")
        raise PlainYamlError(f"the character {shown(text[error.position])} is not allowed", line) from error
    except (ValueError, OverflowError) as error:
        # PyYAML's own conversions.
        message = "a \\U escape is no character, or the version of %YAML is too long"
        raise PlainYamlError(message, loader.line + 1) from error


class _Walk:
    """Visit every node as often as aliases repeat it: record the lines of keys and convert all keys to text."""

    def __init__(self, lines: dict[KeyPath, int]) -> None:
        self._lines, self._nodes = lines, 0

    def visit(self, node: yaml.Node, at: KeyPath, depth: int) -> None:
        self._nodes += 1
        _check_limits(depth, self._nodes, _line(node))
        if isinstance(node, yaml.MappingNode):
            for key, value in node.value:
                self._note(key, at)
                self.visit(value, (*at, key.value), depth + 1)
        elif isinstance(node, yaml.SequenceNode):
            for index, value in enumerate(node.value):
                self._lines[(*at, index)] = _line(value)
                self.visit(value, (*at, index), depth + 1)
        elif node.tag == _FLOAT and not node.value.lower().endswith(("inf", "nan")) and math.isinf(float(node.value)):
            where = f"{dotted(at)}: " if at else ""
            raise PlainYamlError(f"{where}expected a finite number, or .inf, got {shown(node.value)}", _line(node))

    def _note(self, key: yaml.Node, at: KeyPath) -> None:
        if not isinstance(key, yaml.ScalarNode):
            raise PlainYamlError("a key must be text, got a list or a block", _line(key))
        if key.tag != _MERGE:
            key.tag = _TEXT
        here = (*at, key.value)
        if here in self._lines:
            message = f"{dotted(here)}: duplicate key, first on line {self._lines[here]}"
            raise PlainYamlError(message, _line(key))
        self._lines[here] = _line(key)


def _check_limits(depth: int, nodes: int, line: int) -> None:
    if depth > DEEPEST:
        raise PlainYamlError(f"more than {DEEPEST} blocks and lists inside one another", line)
    if nodes > MOST_NODES:
        raise PlainYamlError(f"more than {MOST_NODES} keys and values, with those that aliases repeat", line)


def _line(node: yaml.Node) -> int:
    return int(node.start_mark.line) + 1


def dotted(key_path: KeyPath) -> str:
    """Key path as ``--set`` accepts it; unusual keys are quoted, and long ones shortened."""
    return ".".join(_readable(str(key)) for key in key_path)


def _readable(key: str) -> str:
    return key if is_name(key) and len(key) <= 60 else shown(key)
