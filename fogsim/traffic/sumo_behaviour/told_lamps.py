"""Which lamps the ego has lit, told to SUMO."""

from fogsim.traffic.sumo.link import Api
from fogsim.values import Lamp
from fogsim.values.light import lamp_names

LAMPS_PARAMETER = "fogsim-lamps"
"""Parameter of the ego that names its lit lamps, joined by "+"."""


class ToldLamps:
    """Tells SUMO the ego's lamps whenever they change, for sumo-gui's parameter window, outputs and other clients.

    A parameter says it and not SUMO's own signals of the vehicle: who sets those takes braking and turning out of
    SUMO's hands, so that its stop lamps would stay dark.

    Parameters
    ----------
    api : Api
        The simulation.
    ego : str or None
        Id of the ego; None if there is none.
    """

    def __init__(self, api: Api, ego: str | None) -> None:
        self._api, self._ego = api, ego
        self._told: Lamp | None = None

    def tell(self, lamps: Lamp, present: set[str]) -> None:
        """Tell the lamps if they are other ones than before.

        Parameters
        ----------
        lamps : Lamp
            Lit lamps.
        present : set of str
            Vehicles on the road.
        """
        if lamps != self._told and self._ego in present:
            self._api.vehicle.setParameter(self._ego, LAMPS_PARAMETER, lamp_names(lamps))
            self._told = lamps
