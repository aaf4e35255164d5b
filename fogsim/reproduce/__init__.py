"""Papers' evaluations run again on FogSim's frames and traffic, in one registry."""

from typing import Protocol

from fogsim.core.registry import Registry
from fogsim.reproduce import airlight, belaroussi2015, drivers, huang2015, negru2013, zhu2015
from fogsim.reproduce.night import gallen2014
from fogsim.reproduce.result import Reproduction, Watch, unwatched


class Evaluation(Protocol):
    """Reruns a paper's evaluation."""

    def __call__(self, *, quick: bool = False, table: str | None = None, watch: Watch = unwatched) -> Reproduction:
        """Run it: with fewer frames if quick, only what one table of the paper needs; the watch counts the steps."""


REPRODUCTIONS: Registry[Evaluation] = Registry(
    "paper",
    {
        "negru2013": negru2013.reproduce,
        "zhu2015": zhu2015.reproduce,
        "huang2015": huang2015.reproduce,
        "belaroussi2015": belaroussi2015.reproduce,
        "gallen2014": gallen2014.reproduce,
        "drivers": drivers.reproduce,
        "airlight": airlight.reproduce,
    },
)
"""Every paper by name, ``drivers`` for the field studies of traffic, ``airlight`` for methods in two fogs: called, it
reruns the evaluation."""

__all__ = ["REPRODUCTIONS", "Evaluation", "Reproduction", "Watch"]
