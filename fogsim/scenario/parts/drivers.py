"""From a scenario to its drivers: how they see, choose their speed and follow advice."""

import dataclasses

from fogsim.scenario.drivers_schema import ComplianceSection
from fogsim.scenario.parts.methods import method
from fogsim.scenario.schema import ScenarioFile
from fogsim.traffic import SPEED_CHOICES, Compliance, DriverSetup, DriverSight
from fogsim.traffic.drivers.speed_choice import CheckedChoice, SpeedChoice
from fogsim.values import Display


def driver_sight(scenario: ScenarioFile) -> DriverSight | None:
    """Eyes of the drivers; None if they see through the fog."""
    drivers = scenario.drivers
    if drivers.see_through_fog:
        return None
    return DriverSight(
        scenario.light.illuminance_lx,
        drivers.headlamp_reach_m,
        drivers.reaction_time_s,
        airlight_share=scenario.fog.airlight_share,
    )


def driver_setup(scenario: ScenarioFile) -> DriverSetup:
    """How drivers choose their speed and follow advice."""
    drivers = scenario.drivers
    compliance, given = _compliance(drivers.compliance), drivers.compliance_by_display
    by_display = {
        display: _compliance(own) for display in Display if (own := getattr(given, display.value)) is not None
    }
    if drivers.advised == "equipped":
        in_car = by_display.get(Display.IN_CAR, compliance)
        reached = drivers.equipped_share * in_car.reached_share
        by_display[Display.IN_CAR] = dataclasses.replace(in_car, reached_share=reached)
    return DriverSetup(
        speed_choice=_speed_choice(scenario),
        spread=drivers.speed_spread,
        compliance=compliance,
        misjudgement=drivers.distance_misjudgement,
        following=drivers.following,
        compliance_by_display=by_display,
    )


def _speed_choice(scenario: ScenarioFile) -> SpeedChoice:
    """How fast drivers drive in fog; results of a user's class are checked."""
    written = scenario.drivers.speed_choice
    made = method(scenario, written).make(SPEED_CHOICES)
    return made if type(made) in SPEED_CHOICES.values() else CheckedChoice(written.method, made)


def _compliance(written: ComplianceSection) -> Compliance:
    return Compliance(
        written.reached_share,
        written.rate,
        written.strength,
        written.delay_s,
        written.trust,
        written.foreseen,
    )
