"""Values of a file's parameters in place of ``$name`` and ``${expression}``."""

import ast
import math
import operator
import re
from collections.abc import Callable, Mapping

from fogsim.errors import nearest
from fogsim.openscenario.xml_tree import Node

_NAME = re.compile(r"\$([A-Za-z_][A-Za-z0-9_.]*)")
_EXPRESSION = re.compile(r"\$\{([^{}]*)\}")
_LONGEST = 500
_FREE_TEXT = ("name", "description", "author", "license")
"""Attributes in which a ``$`` without meaning does no harm."""

_OPERATORS: Mapping[type[ast.AST], Callable[..., float]] = {
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
    ast.Not: operator.not_,
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Mod: operator.mod,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}
_FUNCTIONS: Mapping[str, Callable[..., float]] = {
    "round": round,
    "floor": math.floor,
    "ceil": math.ceil,
    "sqrt": math.sqrt,
    "abs": abs,
    "pow": math.pow,
    "sign": lambda x: float((x > 0) - (x < 0)),
    "min": min,
    "max": max,
}
_CONSTANTS = {"pi": math.pi, "true": True, "false": False}

RULES = {
    "greaterThan": ">",
    "greaterOrEqual": ">=",
    "lessThan": "<",
    "lessOrEqual": "<=",
    "equalTo": "==",
    "notEqualTo": "!=",
}
"""Operators of rules."""

_HOLDS = dict(zip(RULES, (operator.gt, operator.ge, operator.lt, operator.le, operator.eq, operator.ne), strict=True))

Parameters = Mapping[str, str]
"""Values of parameters by name."""


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
    """Parameters known in an element: those around it, and those that it declares, each by those before it.

    Values that are `given` take the place of those in the declarations.
    """
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
        return repr(int(value)) if float(value).is_integer() and abs(value) < 1e15 else repr(float(value))
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
