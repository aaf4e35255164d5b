"""Published visibility estimators, one method a module, in one registry."""

from collections.abc import Callable

from fogsim import registry
from fogsim.estimators.negru2013 import Negru2013
from fogsim.estimators.protocol import Estimator
from fogsim.registry import Registry
from fogsim.values.camera import Camera

ESTIMATORS: Registry[Callable[..., Estimator]] = Registry("estimator", {"negru2013": Negru2013})
"""Every estimator by name: called with a camera and keyword parameters it gives an `Estimator`."""


def make(name: str, camera: Camera, **options: object) -> Estimator:
    """Build an estimator.

    Parameters
    ----------
    name : str
        Name in `ESTIMATORS`.
    camera : Camera
        The calibration as the vehicle was told it.
    **options : object
        Parameters of the estimator.

    Raises
    ------
    UnknownNameError
        If there is no estimator of that name.
    InputError
        If the estimator has no such parameter.
    """
    return registry.make(ESTIMATORS, name, camera, **options)


__all__ = ["ESTIMATORS", "Estimator", "make"]
