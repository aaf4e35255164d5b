"""Values of a file's parameters in place of ``$name`` and ``${expression}``."""

import ast
import math
import operator
import re
from collections.abc import Callable, Mapping

from fogsim.errors import nearest
from fogsim.openscenario.findings import Findings
from fogsim.openscenario.xml_tree import Node

_NAME = re.compile(r"\$([A-Za-z_][A-Za-z0-9_.]*)")
_EXPRESSION = re.compile(r"\$\{([^{}]*)\}")
_LONGEST = 500
_FREE_TEXT = ("name", "description", "author", "license")
"""Attributes in which a ``$`` without meaning does no harm."""

_UNARY: Mapping[type[ast.AST], Callable[[float], float]] = {
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
    ast.Not: operator.not_,
}
_BINARY: Mapping[type[ast.AST], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Mod: operator.mod,
}
_COMPARISONS: Mapping[type[ast.AST], Callable[[float, float], bool]] = {
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
    "pow": pow,
    "sign": lambda x: float((x > 0) - (x < 0)),
    "min": min,
    "max": max,
}
_CONSTANTS = {"pi": repr(math.pi), "true": "True", "false": "False"}
_CONSTANT = re.compile(r"\b(pi|true|false)\b")

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


def put_parameters(node: Node, known: Parameters, findings: Findings) -> None:
    """Replace parameters by values in an element and its children, which may declare more."""
    for key, text in node.attributes.items():
        if "$" not in text or (node.tag, key) == ("ParameterDeclaration", "name"):
            continue
        try:
            node.attributes[key] = evaluated(text, known)
        except ValueError as error:
            if key not in _FREE_TEXT:
                findings.refuse(node, f"{key}: {error}")
    inside = declared(node, known, findings)
    for child in node.children:
        if child.tag != "ParameterDeclarations":
            put_parameters(child, inside, findings)


def declared(node: Node, known: Parameters, findings: Findings, given: Parameters | None = None) -> Parameters:
    """Parameters known in an element: those around it, and those that it declares, each by those before it.

    Values that are `given` take the place of those in the declarations.
    """
    inside = dict(known)
    for block in (child for child in node.children if child.tag == "ParameterDeclarations"):
        for one in block.all("ParameterDeclaration"):
            name = one.get("name")
            if name.startswith("$"):
                findings.remark(one, f"a declaration has its name without $; read as {name[1:]!r}")
            one.attributes["value"] = (given or {}).get(name.removeprefix("$"), one.get("value"))
            put_parameters(one, inside, findings)
            inside[name.removeprefix("$")] = one.get("value")
            _check_constraints(one, findings)
    return inside


def _check_constraints(declaration: Node, findings: Findings) -> None:
    """Refuse a value that fits none of its groups of constraints; it fits a group by fitting all of it."""
    groups = [group.all("ValueConstraint") for group in declaration.all("ConstraintGroup")]
    value = declaration.get("value")
    broken = [next((one for one in group if not fits(value, one, findings)), None) for group in groups]
    if broken and all(broken):
        message = " or ".join(f"{one.get('rule')} {one.get('value')}" for one in broken if one)
        findings.refuse(declaration, f"value: its ConstraintGroup wants {message}, got {value!r}")


def fits(value: str, constraint: Node, findings: Findings) -> bool:
    """Whether a value fits the `rule` and `value` of a constraint or condition."""
    rule, limit = findings.word(constraint, "rule", tuple(RULES)), constraint.get("value")
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
    plain = _NAME.sub(lambda match: f" {_as_number(_parameter(match[1], known))} ", expression)
    try:
        value = _value(ast.parse(_CONSTANT.sub(lambda match: _CONSTANTS[match[0]], plain).strip(), mode="eval").body)
    except (SyntaxError, ArithmeticError, TypeError, RecursionError) as error:
        raise ValueError(f"cannot evaluate ${{{expression}}}: {error}") from None
    if isinstance(value, bool):
        return str(value).lower()
    return repr(int(value)) if float(value).is_integer() and abs(value) < 1e15 else repr(float(value))


def _as_number(text: str) -> str:
    if text in ("true", "false"):
        return text.capitalize()
    try:
        return repr(float(text))
    except ValueError:
        raise ValueError(f"expected a number in an expression, got {text!r}") from None


def _value(node: ast.expr) -> float:
    match node:
        case ast.Constant(bool() | int() | float() as number):
            return number
        case ast.UnaryOp(op, operand) if type(op) in _UNARY:
            return _UNARY[type(op)](_value(operand))
        case ast.BinOp(left, op, right) if type(op) in _BINARY:
            return _BINARY[type(op)](_value(left), _value(right))
        case ast.BoolOp(op, values):
            found = [bool(_value(one)) for one in values]
            return all(found) if isinstance(op, ast.And) else any(found)
        case ast.Compare(left, [op], [right]) if type(op) in _COMPARISONS:
            return _COMPARISONS[type(op)](_value(left), _value(right))
        case ast.Call(ast.Name(name), arguments, []) if name in _FUNCTIONS:
            return _FUNCTIONS[name](*(_value(one) for one in arguments))
    raise ValueError(f"an expression may hold numbers, parameters, + - * / %, comparisons and {', '.join(_FUNCTIONS)}")
