"""Who is equipped, where they look from, and in which process."""

import contextlib
import multiprocessing
import signal
import zlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from multiprocessing.connection import Connection

import numpy as np

from fogsim.core.files.standard_streams import open_standard_streams
from fogsim.core.processes import refuse_to_run_again
from fogsim.core.randomness import named_generator
from fogsim.errors import SimulationError
from fogsim.simulation.ego.route_places import Places, RoutePlaces
from fogsim.simulation.fleet.on_board_unit import Instant, Lookout, UnitPool
from fogsim.simulation.run_config import RunConfig, Script
from fogsim.values import (
    Command,
    EquippedVehicle,
    FogReport,
    Leader,
    RoadNetwork,
    SignMap,
    TrafficSnapshot,
    TrafficState,
)
from fogsim.values.script import Actions

_LONGEST_END = 5.0
"""Time that a process is given to end by itself [s]."""


class _UnitProcess:
    """A `UnitPool` in another process, which is asked and answers when it is done."""

    def __init__(self, config: RunConfig) -> None:
        # The script, which may hold functions of the user's, is played where the traffic is.
        self._config = replace(config, script=Script())
        self._process: multiprocessing.process.BaseProcess | None = None
        self._link: Connection | None = None
        self._is_asked = False

    def start_run(self, seed: int, network: tuple[RoadNetwork, SignMap]) -> None:
        """Begin a run; see `UnitPool.start_run`."""
        if self._process is None:
            open_standard_streams()
            refuse_to_run_again()
            # None of this process's simulation, threads and contexts in it.
            context = multiprocessing.get_context("forkserver")
            self._link, theirs = context.Pipe()
            self._process = context.Process(target=_serve, args=(theirs, self._config), daemon=True)
            self._process.start()
            theirs.close()
        if self._is_asked:
            self.answer()
        self._call("start_run", seed, network)

    def begin(self, actions: Actions, time: float, first_time: float) -> None:
        """Let begin what a script asks for; see `UnitPool.begin`."""
        self._call("begin", actions, time, first_time)

    def ask(self, lookouts: Sequence[Lookout], now: Instant) -> None:
        """Begin to let vehicles look; `answer` must follow."""
        self._send("look", lookouts, now)
        self._is_asked = True

    def answer(self) -> list[EquippedVehicle]:
        """What they have seen."""
        if self._link is None:
            raise SimulationError("the run has not been started, or is closed")
        self._is_asked = False
        try:
            found = self._link.recv()
        except (EOFError, OSError) as error:
            raise SimulationError("a process that draws for equipped vehicles has died") from error
        if isinstance(found, Exception):
            raise found
        return list(found or ())

    def _call(self, what: str, *arguments: object) -> None:
        self._send(what, *arguments)
        self.answer()

    def _send(self, what: str, *arguments: object) -> None:
        if self._link is None:
            raise SimulationError("the run has not been started, or is closed")
        try:
            self._link.send((what, arguments))
        except OSError as error:
            raise SimulationError("a process that draws for equipped vehicles has died") from error

    def close(self) -> None:
        """End the process; closing twice is allowed."""
        if self._link is not None:
            self._link.close()
        if self._process is not None:
            self._process.join(_LONGEST_END)
            if self._process.is_alive():
                self._process.terminate()
                self._process.join()
        self._process, self._link, self._is_asked = None, None, False


def _serve(link: Connection, config: RunConfig) -> None:
    """Do what is asked over a link until it is closed."""
    # Ctrl-C and a terminal's end, which reach all, end the process that asks, and that this one.
    for signum in (signal.SIGINT, signal.SIGHUP):
        signal.signal(signum, signal.SIG_IGN)
    pool = UnitPool(config)
    with contextlib.suppress(EOFError, OSError), contextlib.closing(pool):
        while True:
            what, arguments = link.recv()
            try:
                answer = getattr(pool, what)(*arguments)
            except Exception as error:  # noqa: BLE001 - whatever it is, who has asked is to raise it
                answer = error
            link.send(answer)


class EquippedFleet:
    """All equipped vehicles next to the ego that are read and on its way.

    What they see does not go by who draws it: each has random numbers of its own, by its id.
    """

    def __init__(self, config: RunConfig, processes: int = 0) -> None:
        self._share, self._named = config.equipped_share, frozenset(config.equipped_vehicles)
        self._pools: Sequence[UnitPool | _UnitProcess] = ()
        if config.has_equipped:
            self._pools = [_UnitProcess(config) for _ in range(processes)] or [UnitPool(config)]
        self._draw = 0
        self._order: list[str] = []
        self._pool_of: dict[str, int] = {}
        self._routes: tuple[RoutePlaces, RoadNetwork] | None = None

    @property
    def is_there(self) -> bool:
        """Whether any vehicle may be equipped."""
        return bool(self._pools)

    def start_run(self, seed: int, network: Callable[[], tuple[RoadNetwork, SignMap]]) -> None:
        """Begin a run."""
        if not self._pools:
            return
        roads = network()
        self._routes = RoutePlaces(roads[0].route), roads[0]
        self._draw, self._pool_of = int(named_generator(seed, "equipped").integers(2**32)), {}
        for pool in self._pools:
            pool.start_run(seed, roads)

    def begin(self, actions: Actions, time: float, first_time: float) -> None:
        """Let begin what a script asks of fog and light; see `OnBoardUnit.begin`."""
        if actions.fog or actions.light:
            for pool in self._pools:
                pool.begin(actions, time, first_time)

    def ask(self, index: int, time: float, snapshot: TrafficSnapshot, sent: Sequence[tuple[str, FogReport]]) -> None:
        """Let all see, measure, estimate, believe and decide; `answer` waits for them."""
        if self._routes is None:
            return
        lookouts = self._lookouts(snapshot, *self._routes)
        now = Instant(index, time, snapshot.state, snapshot.route_length, tuple(sent))
        for pool, part in zip(self._pools, self._parts(lookouts), strict=True):
            pool.ask(part, now)
        self._order = [lookout.vehicle_id for lookout in lookouts]

    def answer(self) -> tuple[EquippedVehicle, ...]:
        """What they have seen, in the order of their rows in the traffic."""
        seen = {one.vehicle_id: one for pool in self._pools for one in pool.answer()}
        return tuple(seen[vehicle] for vehicle in self._order)

    def _parts(self, lookouts: Sequence[Lookout]) -> list[list[Lookout]]:
        """Who looks in which pool: where they did before, newcomers where fewest do."""
        parts: list[list[Lookout]] = [[] for _ in self._pools]
        present = {lookout.vehicle_id for lookout in lookouts}
        self._pool_of = {vehicle: pool for vehicle, pool in self._pool_of.items() if vehicle in present}
        for lookout in sorted(lookouts, key=lambda one: one.vehicle_id not in self._pool_of):
            fewest = min(range(len(parts)), key=lambda pool: len(parts[pool]))
            parts[self._pool_of.setdefault(lookout.vehicle_id, fewest)].append(lookout)
        return parts

    def _lookouts(self, snapshot: TrafficSnapshot, places: RoutePlaces, roads: RoadNetwork) -> list[Lookout]:
        state, at = snapshot.state, places.of(snapshot.state)
        equipped = [row for row, name in enumerate(state.ids) if row != snapshot.ego and self._is_equipped(name)]
        return [
            Lookout(
                state.ids[row],
                float(at.along[row]),
                _speed_limit(float(at.along[row]), places, roads, snapshot.speed_limit),
                _leader(row, at, state),
            )
            for row in equipped
            if at.on_way[row] and not state.off_lanes[row]
        ]

    def _is_equipped(self, name: str) -> bool:
        return name in self._named or zlib.crc32(f"{self._draw} {name}".encode()) < self._share * 2**32

    def advised(self, command: Command, equipped: Sequence[EquippedVehicle]) -> Command:
        """A command with what equipped vehicles are advised and light; what it says of them itself counts more."""
        if not equipped:
            return command
        speeds = {one.vehicle_id: one.advice.speed for one in equipped}
        lamps = {one.vehicle_id: one.lamps for one in equipped}
        return replace(
            command, advised_speeds={**speeds, **command.advised_speeds}, lamps_of={**lamps, **command.lamps_of}
        )

    def close(self) -> None:
        """Free all renderers and end all processes; closing twice is allowed."""
        for pool in self._pools:
            pool.close()


def _speed_limit(place: float, places: RoutePlaces, roads: RoadNetwork, otherwise: float) -> float:
    """Speed limit at a place along the route [m/s]."""
    if not roads.route_limits.size:
        return otherwise
    return float(roads.route_limits[min(int(np.searchsorted(places.stations, place)), roads.route_limits.size - 1)])


def _leader(row: int, at: Places, state: TrafficState) -> Leader | None:
    """The nearest vehicle ahead of one whose width overlaps."""
    ahead = at.along - state.length - at.along[row]
    is_beside = np.abs(at.aside - at.aside[row]) >= 0.5 * (state.width + state.width[row])
    ahead[~at.on_way | state.off_lanes | is_beside | (at.along <= at.along[row])] = np.inf
    nearest = int(ahead.argmin())
    if not np.isfinite(ahead[nearest]):
        return None
    return Leader(state.ids[nearest], max(float(ahead[nearest]), 0.0), float(state.speed[nearest]))
