"""Drivers react to a leader only once they can see it.

SUMO's own car-following models are told which leader to ignore (``carFollowModel.ignoreIDs``), and only when that
changes; so Krauss, IDM, EIDM and the rest stay as they are, and an unseen vehicle stays on the road.
"""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.appearance import lamps_from_signals, paint
from fogsim.traffic.link import Api
from fogsim.traffic.reading import OTHERS_LAMPS
from fogsim.traffic.sight import BRIGHTEST, DriverSight, FogAccess, inherent_contrast, rear_intensity
from fogsim.values import Lamp

REACH = 250.0
"""Leaders farther ahead than this matter to nobody [m]: from 150 km/h one stops in less."""

EYE_HEIGHT = 1.2
"""Height of a driver's eyes and of the middle of a rear above the road [m]."""

LARGEST_MINIMUM_GAP = 5.0
"""No driver's minimum gap is larger than this [m]."""

FASTEST_APPROACH = 70.0
"""Faster than this no gap changes [m/s]: 250 km/h towards a standing vehicle."""

LONGEST_PAUSE = 0.5
"""Every driver looks at least this often [s], for leaders change."""

_IGNORE = "carFollowModel.ignoreIDs"


class Perception:
    """Decides in each step which leaders are seen.

    Parameters
    ----------
    api : Api
        The simulation.
    fog : FogAccess
        The fog.
    sight : DriverSight
        The drivers' eyes.
    """

    def __init__(self, api: Api, fog: FogAccess, sight: DriverSight) -> None:
        self._api = api
        self._fog = fog
        self._sight = sight
        self._ignored: dict[str, str] = {}
        self._emerging: dict[tuple[str, str], float] = {}
        self._own_lamps: dict[str, int | None] = {}
        self._due: dict[str, float] = {}
        self._contrast: dict[str, float] = {}
        self._minimum_gap: dict[str, float] = {}
        # Nobody nearer than this is hidden, wherever the fog is densest: for them nothing need be computed.
        self._surely_seen = sight.sure_distance(fog.maximum_extinction) - LARGEST_MINIMUM_GAP
        # And nobody farther than this is seen, wherever the fog is thinnest.
        self._surely_hidden = sight.hidden_distance(fog.minimum_extinction)

    def update(self, ego: str, ego_lamps: Lamp, dark: frozenset[str]) -> None:
        """Look once: tell SUMO's drivers which leader they do not see.

        Parameters
        ----------
        ego : str
            Id of the ego, whose lamps are not SUMO's.
        ego_lamps : Lamp
            Its lit lamps.
        dark : frozenset of str
            Vehicles whose lamps have failed.
        """
        self._own_lamps = {**dict.fromkeys(dark, None), ego: None if ego in dark else int(ego_lamps)}
        vehicles = self._api.vehicle
        unseen, found = self._sorted_by_gap()
        if found:
            unseen |= self._unseen(found)
            unseen |= self._not_yet_reacted(found, unseen)
        else:
            self._emerging = {}
        gone = self._ignored.keys() - unseen.keys()
        for follower in gone.intersection(vehicles.getIDList()) if gone else ():
            vehicles.setParameter(follower, _IGNORE, "")
        for follower, leader in unseen.items():
            if self._ignored.get(follower) != leader:
                vehicles.setParameter(follower, _IGNORE, leader)
        self._ignored = unseen

    def _sorted_by_gap(self) -> tuple[dict[str, str], list[tuple[str, str, float]]]:
        """Leaders who are surely hidden, by follower, and those for whom sight must be computed, with their gaps.

        Who is far on either side of the doubtful gaps is asked again only when a leader could have come there.
        """
        leader_of, ignored, due = self._api.vehicle.getLeader, self._ignored, self._due
        now = self._api.simulation.getTime()
        hidden: dict[str, str] = {}
        doubtful = []
        ids = self._api.vehicle.getIDList()
        for follower in ids:
            if now < due.get(follower, now):
                if follower in ignored:
                    hidden[follower] = ignored[follower]
                continue
            found = leader_of(follower, REACH)
            leader, gap = found if found and found[0] else ("", math.inf)
            if leader and self._surely_seen < gap <= self._surely_hidden:
                doubtful.append((follower, leader, gap))
            elif leader and gap > self._surely_hidden:
                hidden[follower] = leader
                due[follower] = now + min((gap - self._surely_hidden) / FASTEST_APPROACH, LONGEST_PAUSE)
            elif leader and follower in ignored:
                doubtful.append((follower, leader, gap))
            else:
                due[follower] = now + min(abs(self._surely_seen - gap) / FASTEST_APPROACH, LONGEST_PAUSE)
        if len(due) > 2 * len(ids) + 100:
            self._due = {v: due[v] for v in ids if v in due}
        return hidden, doubtful

    def _not_yet_reacted(self, found: list[tuple[str, str, float]], unseen: dict[str, str]) -> dict[str, str]:
        """Leaders that have just come into view, and to whom nobody has reacted yet."""
        time = self._api.simulation.getTime()
        emerging = {}
        for follower, leader, _ in found:
            if follower not in unseen and self._ignored.get(follower) == leader:
                emerging[follower, leader] = self._emerging.get((follower, leader), time)
        self._emerging = emerging
        return {pair[0]: pair[1] for pair, since in emerging.items() if time - since < self._sight.reaction_time}

    def _unseen(self, found: list[tuple[str, str, float]]) -> dict[str, str]:
        followers, leaders, spacings = zip(*found, strict=True)
        eyes, rears = self._lines(followers, leaders)
        towards = rears - eyes
        # SUMO's gap leaves out the follower's minimum gap.
        distance = np.maximum(np.array(spacings) + [self._minimum_gap_of(v) for v in followers], 0.1)
        depth = self._fog.optical_depth(eyes, eyes + towards * (distance / np.linalg.norm(towards, axis=1))[:, None])
        contrast = np.array([self._contrast_of(v) for v in leaders])
        seen = self._sight.sees_body(distance, depth, contrast)
        self._pause(followers, self._sight.depth_to_spare(depth, contrast))
        # Lamps are asked for only where no body is seen and the brightest of all lamps would be: that saves most calls.
        asked = np.flatnonzero(~seen & self._sight.sees_lamp(distance, depth, np.full(len(found), BRIGHTEST)))
        intensity = np.array([self._rear_intensity(leaders[i]) for i in asked])
        seen[asked] = self._sight.sees_lamp(distance[asked], depth[asked], intensity)
        return {followers[i]: leaders[i] for i in np.flatnonzero(~seen)}

    def _pause(self, followers: tuple[str, ...], spare: NDArray[np.float64]) -> None:
        """Let those whose leader is clearly seen look again when the fog between could have grown too deep."""
        now = self._api.simulation.getTime()
        # Both ends of the line of sight may move into the densest fog.
        pauses = np.minimum(spare / (2.0 * FASTEST_APPROACH * self._fog.maximum_extinction), LONGEST_PAUSE)
        for i in np.flatnonzero(pauses > 0):
            if followers[i] not in self._ignored:
                self._due[followers[i]] = now + float(pauses[i])

    def _rear_intensity(self, vehicle: str) -> float:
        own = self._own_lamps.get(vehicle, int(OTHERS_LAMPS))
        if own is None:
            return 0.0
        return rear_intensity(own | lamps_from_signals(self._api.vehicle.getSignals(vehicle)))

    def _lines(
        self, followers: tuple[str, ...], leaders: tuple[str, ...]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Eyes of the followers and front bumpers of the leaders, (n, 3) each."""
        position = self._api.vehicle.getPosition3D
        known = {v: position(v) for v in {*followers, *leaders}}
        lift = np.array([0.0, 0.0, EYE_HEIGHT])
        return np.array([known[v] for v in followers]) + lift, np.array([known[v] for v in leaders]) + lift

    def _minimum_gap_of(self, vehicle: str) -> float:
        known = self._minimum_gap.get(vehicle)
        if known is None:
            known = self._minimum_gap[vehicle] = float(self._api.vehicle.getMinGap(vehicle))
        return known

    def _contrast_of(self, vehicle: str) -> float:
        known = self._contrast.get(vehicle)
        if known is None:
            known = inherent_contrast(paint(vehicle, self._api.vehicle.getColor(vehicle)))
            self._contrast[vehicle] = known
        return known
