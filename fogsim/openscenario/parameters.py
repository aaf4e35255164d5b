"""Values of parameters in place of ``$name`` and ``${expression}``, in a file and in the entries of its catalogs."""

import ast
import contextlib
import math
import operator
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from fogsim.errors import InputError, nearest, shown, suggest
from fogsim.openscenario.xml_tree import Node, NodeError, read_xml

_NAME = re.compile(r"\$([A-Za-z_][A-Za-z0-9_.]*)")
_EXPRESSION = re.compile(r"\$\{([^{}]*)\}")
_LONGEST = 500
_FREE_TEXT = ("name", "description", "author", "license")  # A ``$`` without meaning does no harm there.

_ORDERS = (operator.gt, operator.ge, operator.lt, operator.le, operator.eq, operator.ne)
_ARITHMETIC = (operator.neg, operator.pos, operator.not_, operator.add, operator.sub, operator.mul, operator.truediv)
_OPERATORS: Mapping[type[ast.AST], Callable[..., float]] = {
    **dict(zip((ast.Gt, ast.GtE, ast.Lt, ast.LtE, ast.Eq, ast.NotEq), _ORDERS, strict=True)),
    **dict(zip((ast.USub, ast.UAdd, ast.Not, ast.Add, ast.Sub, ast.Mult, ast.Div), _ARITHMETIC, strict=True)),
    ast.Mod: operator.mod,
}
_FUNCTIONS: Mapping[str, Callable[..., float]] = {
    **{one.__name__: one for one in (math.floor, math.ceil, math.sqrt, abs, math.pow, min, max)},
    **{one.__name__: one for one in (math.sin, math.cos, math.tan, math.asin, math.acos, math.atan)},
    "round": lambda x: math.copysign(math.floor(abs(x) + 0.5), x),  # Halves away from 0
    "sign": lambda x: float((x > 0) - (x < 0)),
}
_CONSTANTS = {"pi": math.pi, "true": True, "false": False}

_RULES = ("greaterThan", "greaterOrEqual", "lessThan", "lessOrEqual", "equalTo", "notEqualTo")
RULES = dict(zip(_RULES, (">", ">=", "<", "<=", "==", "!="), strict=True))
_HOLDS = dict(zip(_RULES, _ORDERS, strict=True))

_LOCATED = ("Vehicle", "Pedestrian", "MiscObject", "Environment", "Controller", "Maneuver", "Route", "Trajectory")
_MIRRORED = {"y", "dy", "h"}  # Of positions and orientations
_COUNTED = {"RelativeTargetLane": {"value"}}  # ScenarioRunner counts lanes to the right.
_CRITERION = "criteria_"

Parameters = Mapping[str, str]  # Values by name


def put_parameters(node: Node, known: Parameters) -> None:
    """Replace parameters by values in an element and its children, which may declare more."""
    for key, text in node.attributes.items():
        if "$" not in text or (node.tag, key) == ("ParameterDeclaration", "name"):
            continue
        try:
            node.attributes[key] = evaluated(text, known)
        except ValueError as error:
            if key not in _FREE_TEXT:
                node.refuse(f"{key}: {error}")
    inside = declared(node, known)
    for child in node.children:
        if child.tag != "ParameterDeclarations":
            put_parameters(child, inside)


def declared(node: Node, known: Parameters, given: Parameters | None = None) -> Parameters:
    """Parameters known in an element: those around it, and those that it declares, each by those before, or given."""
    inside = dict(known)
    blocks = [child for child in node.children if child.tag == "ParameterDeclarations"]
    for one in (one for block in blocks for one in block.all("ParameterDeclaration")):
        name = one.get("name").removeprefix("$")
        if one.name.strip() != name:
            one.remark(f"a declaration has its name without $; read as {name!r}")
        one.attributes["value"] = (given or {}).get(name, one.get("value"))
        put_parameters(one, inside)
        inside[name] = one.get("value")
        _check_constraints(one)
    return inside


def _check_constraints(declaration: Node) -> None:
    """Refuse a value that fits none of its groups of constraints; it fits a group by fitting all of it."""
    groups = [group.all("ValueConstraint") for group in declaration.all("ConstraintGroup")]
    value = declaration.get("value")
    broken = [next((one for one in group if not fits(value, one)), None) for group in groups]
    if broken and all(broken):
        message = " or ".join(f"{one.get('rule')} {one.get('value')}" for one in broken if one)
        declaration.refuse(f"value: its ConstraintGroup wants {message}, got {value!r}")


def fits(value: str, constraint: Node) -> bool:
    """Whether a value fits the `rule` and `value` of a constraint or condition."""
    rule, limit = constraint.word("rule", tuple(RULES)), constraint.get("value")
    try:
        return bool(_HOLDS[rule](float(value), float(limit)))
    except ValueError:
        return {"equalTo": value == limit, "notEqualTo": value != limit}.get(rule, False)


def evaluated(text: str, known: Parameters) -> str:
    """A text with ``$name`` and ``${expression}`` replaced by values; ValueError if one is unknown or invalid."""
    if (match := _NAME.fullmatch(text.strip())) is not None:
        return _parameter(match[1], known)
    return _EXPRESSION.sub(lambda match: _result(match[1], known), text)


def _parameter(name: str, known: Parameters) -> str:
    if name not in known:
        near = nearest(name, known)
        raise ValueError(f"unknown parameter ${name}" + (f"; did you mean ${near}?" if near else ""))
    return known[name]


def _result(expression: str, known: Parameters) -> str:
    if len(expression) > _LONGEST:
        raise ValueError(f"an expression has at most {_LONGEST} characters")
    plain = _NAME.sub(lambda match: f" {_as_number(_parameter(match[1], known))} ", expression).strip()
    try:
        value = _value(ast.parse(plain, mode="eval").body)
        if isinstance(value, bool):
            return str(value).lower()
        # int() refuses what is infinite.
        return repr(int(value)) if int(value) == value and abs(value) < 1e15 else repr(float(value))
    except (SyntaxError, ArithmeticError, TypeError, RecursionError) as error:
        raise ValueError(f"cannot evaluate ${{{expression}}}: {error}") from None


def _as_number(text: str) -> str:
    if text in ("true", "false"):
        return text
    try:
        return repr(float(text))
    except ValueError:
        raise ValueError(f"expected a number in an expression, got {text!r}") from None


def _value(node: ast.expr) -> float:
    match node:
        case ast.Constant(bool() | int() | float() as number):
            return number
        case ast.Name(name) if name in _CONSTANTS:
            return _CONSTANTS[name]
        case ast.UnaryOp(op, operand) if type(op) in _OPERATORS:
            return _OPERATORS[type(op)](_value(operand))
        case ast.BinOp(left, op, right) | ast.Compare(left, [op], [right]) if type(op) in _OPERATORS:
            return _OPERATORS[type(op)](_value(left), _value(right))
        case ast.BoolOp(op, values):
            return (all if isinstance(op, ast.And) else any)([bool(_value(one)) for one in values])
        case ast.Call(ast.Name(name), arguments, []) if name in _FUNCTIONS:
            return _FUNCTIONS[name](*map(_value, arguments))
    raise ValueError(f"an expression may hold numbers, parameters, + - * / %, comparisons and {', '.join(_FUNCTIONS)}")


@dataclass
class Catalogs:
    """The catalogs that a file names, relative to its folder."""

    root: Node
    _read: dict[Path, list[Node]] = field(default_factory=dict)
    _places: list[Path] = field(default_factory=list)

    def __post_init__(self) -> None:
        locations = self.root.one("CatalogLocations")
        for kind in locations.all(*(f"{kind}Catalog" for kind in _LOCATED)) if locations else ():
            paths = (place.get("path").replace("\\", "/") for place in kind.all("Directory"))
            self._places += [self.root.file.parent / path for path in paths]

    def entry(self, reference: Node) -> Node:
        """The element of a ``CatalogReference``, with its parameters, below it from then on; NodeError if missing."""
        catalog, name = reference.get("catalogName"), reference.get("entryName")
        assigned = (one for block in reference.all("ParameterAssignments") for one in block.all("ParameterAssignment"))
        given = {one.get("parameterRef").removeprefix("$"): one.get("value") for one in assigned}
        names: list[str] = []
        for found in self._entries(catalog):
            if found.name == name:
                reference.children.append(whole := found.copy())
                own = declared(whole, {}, given)
                texts = " ".join(text for one in whole.walk() for text in one.attributes.values())
                for key in (key for key in given if key not in own and f"${key}" not in texts):
                    reference.refuse(f"{shown(name)} has no parameter {shown(key)}; {suggest(key, own)}")
                whole.children = [child for child in whole.children if child.tag != "ParameterDeclarations"]
                put_parameters(whole, {**own, **given})
                to_standard(self.root, whole)
                whole.is_read = True
                return whole
            names.append(found.name)
        message = suggest(name, names) if names else f"there is no catalog {shown(catalog)} in the CatalogLocations"
        raise NodeError(reference, f"unknown entry {shown(name)} of {catalog}; {message}")

    def need(self, holder: Node, *tags: str) -> Node:
        """The child element with one of these tags, or the entry of a catalog in its place; NodeError without one."""
        found = holder.need(*tags, "CatalogReference")
        return self.entry(found) if found.tag == "CatalogReference" else found

    def _entries(self, catalog: str) -> Iterator[Node]:
        folders = (sorted(path.glob("*.xosc")) if path.is_dir() else [path] for path in self._places)
        for file in (file for files in folders for file in files if file.is_file()):
            if file not in self._read:
                self._read[file] = []
                try:
                    self._read[file] = read_xml(file, self.root.findings).children
                except InputError as error:
                    self.root.findings.refused.setdefault(str(error))
            for one in self._read[file]:
                # A copied catalog may still have its old name inside.
                if one.tag == "Catalog" and catalog in (one.attributes.get("name"), file.stem):
                    yield from one.children


def is_of_carla(root: Node) -> bool:
    """Whether a file begins its description with ``CARLA:``, as those for ScenarioRunner do."""
    return any(one.attributes.get("description", "").startswith("CARLA:") for one in root.all("FileHeader"))


def to_standard(root: Node, entry: Node | None = None) -> None:
    """Give a file for ScenarioRunner, or a catalog's entry in it, the format's axes, and leave out criteria."""
    nodes = list((entry or root).walk()) if is_of_carla(root) else []
    for node in nodes:
        if node.tag == "Orientation":
            node.attributes.setdefault("type", "relative")
        mirrored = _MIRRORED if node.tag.endswith(("Position", "Orientation")) else _COUNTED.get(node.tag, set())
        for key in node.attributes.keys() & mirrored:
            # What is no number is found where it is read.
            with contextlib.suppress(ValueError):
                node.attributes[key] = repr(-float(node.attributes[key]))
    for node in (one for one in nodes if one.tag == "StopTrigger"):
        for group in node.children:
            criteria = [one for one in group.children if one.name.startswith(_CRITERION)]
            for one in criteria:
                one.remark("a criterion of ScenarioRunner; FogSim's are expectations")
            group.children = [one for one in group.children if one not in criteria]
        node.children = [group for group in node.children if group.children]
