"""Vehicles and persons of a simulation, from its route and additional files, without starting SUMO."""

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from fogsim.core.files.xml_reader import read_elements
from fogsim.errors import InputError
from fogsim.traffic.road.configuration import configured_demand

_HOUR = 3600.0
_MOST_BYTES = 50_000_000
"""Unpacked bytes of files after which nothing is claimed about a demand."""


@dataclass(slots=True)
class _Flows:
    """Rates by vehicle type [1/h], number of flows, and single vehicles; not `is_whole` if a file was cut off."""

    rates: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    flows: int = 0
    single: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    is_whole: bool = True


def read_flows(files: Iterable[Path]) -> _Flows:
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
        self.found = _Flows()
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


_MOST_NAMES = 10_000
"""Maximum number of ids that are kept to suggest the nearest."""

_OPENING = frozenset(("include", "calibrator", "personTrip"))
"""Elements that create vehicles with unknown ids."""


@dataclass(frozen=True, slots=True)
class VehicleRoute:
    """A vehicle's written-out edges, its departure lane (from 0, None if SUMO chooses), and the file with it."""

    edges: tuple[str, ...]
    depart_lane: int | None
    file: Path


@dataclass(frozen=True, slots=True)
class Demand:
    """What route and additional files say about the wanted vehicles.

    `found` are those that can come, and `routes` the written-out, fixed routes. `names` are at most `_MOST_NAMES` ids
    in file order; a flow has its first and last. `is_open` if other vehicles may come, so that nothing is known about
    those that were not found. `persons` are found ones that no vehicle shares its id with.
    """

    files: tuple[Path, ...]
    found: frozenset[str]
    names: tuple[str, ...]
    routes: Mapping[str, VehicleRoute]
    is_open: bool
    persons: frozenset[str] = frozenset()

    def lacks(self, vehicle: str) -> bool:
        """Whether a wanted vehicle can never come."""
        return not self.is_open and vehicle not in self.found


def read_configured_demand(config: Path, wanted: Iterable[str]) -> Demand:
    """Search for vehicles in the files of a SUMO configuration."""
    configured = configured_demand(config)
    if configured.is_open:
        return Demand(configured.files, frozenset(), (), {}, is_open=True)
    return read_demand(configured.files, wanted, reroutes=configured.reroutes)


def read_demand(
    files: Iterable[Path], wanted: Iterable[str], most_bytes: int = _MOST_BYTES, *, reroutes: bool = False
) -> Demand:
    """Search additional and route files for vehicles in SUMO's order; open after `most_bytes` unpacked bytes."""
    files, reader, left = tuple(files), _DemandReader(frozenset(wanted), reroutes), most_bytes
    for file in files:
        reader.file = file
        try:
            left -= read_elements(file, reader, left)
        except InputError:
            # SUMO reports its faults when it starts.
            reader.is_open = True
        if reader.is_done:
            break
        if left <= 0:
            reader.is_open = True
            break
    return reader.demand(files)


class _DemandReader:
    """Searches elements for wanted vehicles."""

    def __init__(self, wanted: frozenset[str], reroutes: bool) -> None:
        self.file = Path()
        self.is_open = False
        self._wanted = wanted
        self._reroutes = reroutes
        self._found: set[str] = set()
        self._persons: set[str] = set()
        self._vehicles: set[str] = set()
        self._names: list[str] = []
        self._named_routes: dict[str, tuple[str, ...]] = {}
        self._routes: dict[str, VehicleRoute] = {}
        self._inside: tuple[tuple[str, ...], int | None] = ((), None)

    @property
    def is_done(self) -> bool:
        # A vehicle may come under the id of a person.
        is_found = self._found == self._wanted and self._persons <= self._vehicles
        return self.is_open or (is_found and not self._inside[0])

    def demand(self, files: tuple[Path, ...]) -> Demand:
        routes = {} if self._reroutes or self.is_open else self._routes
        persons = frozenset(self._persons - self._vehicles)
        return Demand(files, frozenset(self._found), tuple(self._names), routes, self.is_open, persons)

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        if tag in {"vehicle", "trip", "person"}:
            self._take(attributes, (attributes.get("id", ""),))
            (self._persons if tag == "person" else self._vehicles).update(self._inside[0])
        elif tag in {"flow", "personFlow"}:
            self._take_flow(attributes)
            (self._vehicles if tag == "flow" else self._persons).update(self._inside[0])
        elif tag == "route":
            self._take_route(attributes)
        elif tag == "routeDistribution":
            # SUMO chooses one of its routes at random.
            self._inside = ((), None)
        elif tag in _OPENING or (tag == "vType" and "scale" in attributes):
            self.is_open = True
        elif tag == "rerouter" or attributes.get("key") == "has.rerouting.device":
            self._reroutes = True

    def end(self, tag: str) -> None:
        if tag in {"vehicle", "trip", "flow", "person", "personFlow"}:
            self._inside = ((), None)

    def _take_flow(self, attributes: Mapping[str, str]) -> None:
        flow, written = attributes.get("id", ""), attributes.get("number", "")
        number = int(written) if _is_number(written) else None
        names = (f"{flow}.0",) if number in {None, 1} else (f"{flow}.0", f"{flow}.{(number or 1) - 1}")
        self._take(attributes, () if number == 0 else names, _flow_vehicles(flow, number, self._wanted))

    def _take(
        self, attributes: Mapping[str, str], names: tuple[str, ...], vehicles: Collection[str] | None = None
    ) -> None:
        if len(self._names) < _MOST_NAMES:
            self._names += names
        here = tuple(v for v in (names if vehicles is None else vehicles) if v in self._wanted)
        self._found.update(here)
        lane = attributes.get("departLane", "")
        self._inside = (here, int(lane) if _is_number(lane) and "departEdge" not in attributes else None)
        self._drive(self._named_routes.get(attributes.get("route", "")))

    def _take_route(self, attributes: Mapping[str, str]) -> None:
        if "id" not in attributes and not self._inside[0]:
            return
        edges = tuple(attributes.get("edges", "").split())
        if edges and "repeat" not in attributes:
            if "id" in attributes:
                self._named_routes[attributes["id"]] = edges
            self._drive(edges)

    def _drive(self, edges: tuple[str, ...] | None) -> None:
        vehicles, lane = self._inside
        if edges:
            self._routes.update({v: VehicleRoute(edges, lane, self.file) for v in vehicles})


def _flow_vehicles(flow: str, number: int | None, wanted: Collection[str]) -> tuple[str, ...]:
    """Wanted vehicles of a flow, which are named by its id and a number from 0."""
    made = []
    for vehicle in wanted:
        name, _, place = vehicle.rpartition(".")
        is_one = name == flow and _is_number(place) and str(int(place)) == place
        if is_one and (number is None or int(place) < number):
            made.append(vehicle)
    return tuple(made)


def _is_number(text: str) -> bool:
    return text.isascii() and text.isdigit() and len(text) < 10
