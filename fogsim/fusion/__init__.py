"""Many estimates over time to one belief."""

from collections.abc import Callable

from fogsim.core import registry
from fogsim.core.parameters import checked_parameters
from fogsim.core.registry import Registry
from fogsim.fusion.field_filter import FieldFilter
from fogsim.fusion.grid_filter import GridFilter
from fogsim.fusion.mixture_filter import MixtureFilter
from fogsim.fusion.protocol import DatedFusion, Fusion, LocatedFusion, NoFusion

FUSIONS: Registry[Callable[..., Fusion | LocatedFusion]] = Registry(
    "fusion",
    {"field_filter": FieldFilter, "grid_filter": GridFilter, "mixture_filter": MixtureFilter, "none": NoFusion},
    group="fogsim.fusion",
    methods=("update|update_at", "reset"),
)
"""Every fusion by name: called with keyword parameters it gives a `Fusion`."""


@checked_parameters
def make(name: str, **options: object) -> Fusion | LocatedFusion:
    """Build a fusion.

    Parameters
    ----------
    name : str
        Name in `FUSIONS`.
    **options : object
        Parameters of the fusion.

    Raises
    ------
    UnknownNameError
        If there is no fusion of that name.
    InputError
        If the fusion has no such parameter.
    """
    return registry.make(FUSIONS, name, **options)


__all__ = ["FUSIONS", "DatedFusion", "Fusion", "LocatedFusion", "make"]
