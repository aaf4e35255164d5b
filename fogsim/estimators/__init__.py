"""Published visibility estimators, one method a module, in one registry."""

import inspect
from collections.abc import Callable

from fogsim.errors import InputError, suggest
from fogsim.estimators.negru2013 import Negru2013
from fogsim.estimators.protocol import Estimator
from fogsim.registry import Registry
from fogsim.values.camera import Camera

ESTIMATORS: Registry[Callable[..., Estimator]] = Registry("estimator", {"negru2013": Negru2013})
"""Every estimator by name: called with a camera and keyword parameters it gives an `Estimator`."""


def parameters(name: str) -> dict[str, object]:
    """Names and defaults of the keyword parameters of an estimator.

    Raises
    ------
    UnknownNameError
        If there is no estimator of that name.
    """
    signature = inspect.signature(ESTIMATORS[name])
    return {
        parameter.name: parameter.default
        for parameter in signature.parameters.values()
        if parameter.kind is inspect.Parameter.KEYWORD_ONLY
    }


def make(name: str, camera: Camera, **options: object) -> Estimator:
    """Build an estimator.

    Parameters
    ----------
    name : str
        Name in `ESTIMATORS`.
    camera : Camera
        The calibration as the vehicle was told it.
    **options : object
        Parameters of the estimator; `parameters` names them.

    Raises
    ------
    UnknownNameError
        If there is no estimator of that name.
    InputError
        If the estimator has no such parameter.
    """
    allowed = parameters(name)
    for option in options:
        if option not in allowed:
            raise InputError(f"estimator {name!r} has no parameter {option!r}; {suggest(option, allowed)}")
    return ESTIMATORS[name](camera, **options)


__all__ = ["ESTIMATORS", "Estimator", "make", "parameters"]
