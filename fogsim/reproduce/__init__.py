"""Papers' evaluations run again on FogSim's frames, one paper a module, in one registry."""

from collections.abc import Callable

from fogsim.registry import Registry
from fogsim.reproduce import huang2015, negru2013, zhu2015
from fogsim.reproduce.result import Reproduction

REPRODUCTIONS: Registry[Callable[[], Reproduction]] = Registry(
    "paper", {"negru2013": negru2013.reproduce, "zhu2015": zhu2015.reproduce, "huang2015": huang2015.reproduce}
)
"""Every paper by name: called, it reruns the evaluation."""

__all__ = ["REPRODUCTIONS", "Reproduction"]
