"""Emergency brakes that are broken, each in one respect."""

import dataclasses

from fogsim.advice import EmergencyBrake
from fogsim.values import Control


class Late(EmergencyBrake):
    """Braking begins 1.5 s too late."""

    def control(self, seen):
        self.response_time = -1.1
        return super().control(seen)


class Weak(EmergencyBrake):
    """The brakes give a third of what is requested."""

    def control(self, seen):
        found = super().control(seen)
        return dataclasses.replace(found, acceleration=found.acceleration and found.acceleration / 3.0)


class Frozen(EmergencyBrake):
    """The sensors freeze at what they saw first."""

    first = None

    def control(self, seen):
        self.first = self.first or seen
        return super().control(self.first)


class IgnoresRadar(EmergencyBrake):
    """No vehicle ahead is ever tracked."""

    def control(self, seen):
        return super().control(dataclasses.replace(seen, lead=None))


class IgnoresStanding(EmergencyBrake):
    """What moves slower than 15 km/h is taken for a bridge."""

    def control(self, seen):
        is_slow = seen.lead is not None and seen.speed + seen.lead.relative_speed < 15.0 / 3.6
        return super().control(dataclasses.replace(seen, lead=None) if is_slow else seen)


class InTownOnly(EmergencyBrake):
    """Above 70 km/h it is off."""

    def control(self, seen):
        return super().control(seen) if seen.speed < 70.0 / 3.6 else Control()


class ShortSighted(EmergencyBrake):
    """The radar reaches 30 m."""

    def control(self, seen):
        is_far = seen.lead is not None and seen.lead.distance > 30.0
        return super().control(dataclasses.replace(seen, lead=None) if is_far else seen)


class GivesUp(EmergencyBrake):
    """The brakes are released after 1 s."""

    since = None

    def control(self, seen):
        found = super().control(seen)
        if found.acceleration is not None:
            self.since = self.since or seen.time
            if seen.time > self.since + 1.0:
                return Control(0.0)
        return found


class WrongSign(EmergencyBrake):
    """A vehicle that comes nearer is taken for one that drives away."""

    def control(self, seen):
        if seen.lead is not None:
            seen = dataclasses.replace(
                seen, lead=dataclasses.replace(seen.lead, relative_speed=-seen.lead.relative_speed)
            )
        return super().control(seen)


class OnlyWarns(EmergencyBrake):
    """It warns and takes over, and does not brake."""

    def control(self, seen):
        found = super().control(seen)
        return dataclasses.replace(found, acceleration=found.acceleration and 0.0)


BROKEN = (Late, Weak, Frozen, IgnoresRadar, IgnoresStanding, InTownOnly, ShortSighted, GivesUp, WrongSign, OnlyWarns)
