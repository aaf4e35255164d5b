"""Vehicles per hour of a demand by vehicle type, from route files, without starting SUMO."""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from fogsim.core.files.xml_reader import read_elements
from fogsim.errors import InputError

_HOUR = 3600.0
_MOST_BYTES = 50_000_000


@dataclass(slots=True)
class Flows:
    """Rates of all flows together by vehicle type [1/h], number of flows, and vehicles that are written one by one.

    `is_whole` is False if a file could not be read to its end.
    """

    rates: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    flows: int = 0
    single: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    is_whole: bool = True


def read_flows(files: Iterable[Path]) -> Flows:
    """Flows and single vehicles of additional and route files, in SUMO's order."""
    reader = _FlowReader()
    for file in files:
        try:
            reader.found.is_whole &= read_elements(file, reader, _MOST_BYTES) < _MOST_BYTES
        except InputError:
            reader.found.is_whole = False
    return reader.found


class _FlowReader:
    """Adds up flows; the vehicles of a distribution count by their types."""

    is_done = False

    def __init__(self) -> None:
        self.found = Flows()
        self._mixes: dict[str, dict[str, float]] = {}
        self._mix = ""

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        if tag == "vTypeDistribution":
            self._mix = attributes.get("id", "")
            names, weights = attributes.get("vTypes", "").split(), attributes.get("probabilities", "").split()
            self._mixes[self._mix] = {n: _number(w) for n, w in zip(names, weights or ["1"] * len(names), strict=False)}
        elif tag == "vType" and self._mix:
            self._mixes[self._mix][attributes.get("id", "")] = _number(attributes.get("probability", "1"))
        elif tag == "flow":
            self.found.flows += 1
            self._add(self.found.rates, attributes, _rate(attributes))
        elif tag in {"vehicle", "trip"}:
            self._add(self.found.single, attributes, 1)

    def end(self, tag: str) -> None:
        if tag == "vTypeDistribution":
            self._mix = ""

    def _add(self, to: dict[str, float], attributes: Mapping[str, str], number: float) -> None:
        name = attributes.get("type", "DEFAULT_VEHTYPE")
        mix = self._mixes.get(name) or {name: 1.0}
        for one, share in mix.items():
            to[one] += number * share / (sum(mix.values()) or 1.0)


def _rate(flow: Mapping[str, str]) -> float:
    """Vehicles per hour while a flow lasts; 0 where its times are not numbers."""
    if (each := flow.get("vehsPerHour", flow.get("perHour"))) is not None:
        return _number(each)
    period = flow.get("period", "")
    if period.startswith("exp("):
        return _HOUR * _number(period[4:-1])
    if period:
        return _HOUR / _number(period) if _number(period) else 0.0
    if "probability" in flow:
        return _HOUR * _number(flow["probability"])
    lasts = _number(flow.get("end", "0")) - _number(flow.get("begin", "0"))
    return _HOUR * _number(flow.get("number", "0")) / lasts if lasts > 0 else 0.0


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0
