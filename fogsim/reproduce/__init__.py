"""Papers' evaluations run again on FogSim's frames, one paper a module, in one registry."""

from collections.abc import Callable

from fogsim.registry import Registry
from fogsim.reproduce import negru2013
from fogsim.reproduce.result import Reproduction

REPRODUCTIONS: Registry[Callable[[], Reproduction]] = Registry("paper", {"negru2013": negru2013.reproduce})
"""Every paper by name: called, it reruns the evaluation."""

__all__ = ["REPRODUCTIONS", "Reproduction"]
