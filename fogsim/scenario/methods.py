"""Named methods with parameters, checked against the constructors that they will be handed to."""

from collections.abc import Callable
from typing import Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError

from fogsim.errors import UnknownNameError
from fogsim.parameters import parameter_mistakes
from fogsim.registry import Registry

GIVEN_BY_THE_LOOP = frozenset({"camera"})
"""Constructor arguments that the loop hands in, so no scenario sets them."""

MISTAKE = "parameter"
"""Type of the errors of parameters, whose messages say all."""


class Method(BaseModel):
    """A named method and its parameters (SI units, as its documentation names them)."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    method: str
    parameters: dict[str, Any] = Field(default_factory=dict)


def method_of(registry: Registry[Callable[..., Any]]) -> BeforeValidator:
    """Validator of one registry's methods.

    A method may be written as its bare name; names that the registry does not know are refused, and so are parameters
    that the method does not have, and values that its annotations do not allow.
    """

    def check(value: object) -> object:
        written = {"method": value} if isinstance(value, str) else value
        if isinstance(written, dict) and isinstance(written.get("method"), str):
            try:
                factory = registry[written["method"]]
            except UnknownNameError as error:
                # Only a plain ValueError is a message to pydantic's user.
                raise ValueError(str(error)) from None
            _check_parameters(factory, written.get("parameters"))
        return written

    return BeforeValidator(check)


def _check_parameters(factory: Callable[..., Any], parameters: object) -> None:
    if not isinstance(parameters, dict | None):
        return  # the model says what it must be
    mistakes = [
        InitErrorDetails(type=PydanticCustomError(MISTAKE, "{told}", {"told": told}), loc=("parameters", name), input=0)
        for name, told in parameter_mistakes(factory, parameters or {}, GIVEN_BY_THE_LOOP)
    ]
    if mistakes:
        raise ValidationError.from_exception_data("parameters", mistakes)
