"""Named methods with parameters, checked against the constructors that they will be handed to."""

import inspect
from collections.abc import Callable
from typing import Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, create_model

from fogsim.errors import UnknownNameError, suggest
from fogsim.registry import Registry

GIVEN_BY_THE_LOOP = frozenset({"camera"})
"""Constructor arguments that the loop hands in, so no scenario sets them."""


class Method(BaseModel):
    """A named method and its parameters (SI units, as its documentation names them)."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    method: str
    parameters: dict[str, Any] = Field(default_factory=dict)


def method_of(registry: Registry[Callable[..., Any]]) -> BeforeValidator:
    """Validator of one registry's methods.

    A method may be written as its bare name; names that the registry does not know are refused, and so are parameters
    that the method does not have or that are of a wrong type.
    """

    def check(value: object) -> object:
        written = {"method": value} if isinstance(value, str) else value
        if isinstance(written, dict) and isinstance(written.get("method"), str):
            try:
                factory = registry[written["method"]]
            except UnknownNameError as error:
                # Only a plain ValueError is a message to pydantic's user.
                raise ValueError(str(error)) from None
            _check_parameters(factory, written.get("parameters") or {})
        return written

    return BeforeValidator(check)


def _check_parameters(factory: Callable[..., Any], parameters: object) -> None:
    model = parameters_model(factory)
    try:
        model.model_validate(parameters)
    except ValidationError as error:
        told = []
        for detail in error.errors():
            name = ".".join(map(str, detail["loc"]))
            if detail["type"] == "extra_forbidden":
                told.append(f"unknown parameter {name!r}; {suggest(name, model.model_fields)}")
            else:
                told.append(f"parameter {name!r}: {detail['msg']}; got {detail['input']!r}")
        raise ValueError("; ".join(told)) from None


def parameters_model(factory: Callable[..., Any]) -> type[BaseModel]:
    """Schema of a factory's parameters, made from its signature."""
    fields: dict[str, Any] = {
        name: (parameter.annotation, ... if parameter.default is parameter.empty else parameter.default)
        for name, parameter in inspect.signature(factory, eval_str=True).parameters.items()
        if name not in GIVEN_BY_THE_LOOP
    }
    return create_model("Parameters", __config__=ConfigDict(extra="forbid"), **fields)
