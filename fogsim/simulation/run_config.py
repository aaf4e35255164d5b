"""What a run is made of, in SI units and radians: plain values, from a scenario file or from a program."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Annotated, Any, ClassVar, Protocol

from fogsim.atmosphere import FogConfig
from fogsim.camera import DEFAULT_CAMERA, CameraConfig
from fogsim.conditions import Condition
from fogsim.core.parameters import Range, checked_parameters
from fogsim.core.registry import MethodConfig
from fogsim.errors import InputError
from fogsim.sensors import Gps, LeadSensor
from fogsim.traffic import TrafficSetup
from fogsim.units import clock_time
from fogsim.values import Display, Fault, Pavement, StretchAdvice
from fogsim.values.scene import USUAL_PAVEMENT
from fogsim.values.script import Actions

_FROM_0, _FROM_1, _ABOVE_0 = Range(0, math.inf), Range(1, math.inf), Range(0.001, math.inf, "s")

NO_RENDERER = "none"
"""Name that stands for drawing nothing, in runs that need no camera."""

_RADAR, _GPS, _CAMERA = LeadSensor(), Gps(), CameraConfig(DEFAULT_CAMERA)
_ESTIMATORS, _FUSION = (MethodConfig("joint_road"),), MethodConfig("grid_filter")
_ADVISER, _LIGHTING = MethodConfig("stopping_sight_distance"), MethodConfig("fog_lamp_rules")


@checked_parameters
@dataclass(frozen=True, slots=True)
class Periods:
    """The clocks of a run as whole numbers.

    Parameters
    ----------
    camera_period : float
        Time between frames [s].
    traffic_steps : int
        Traffic steps in one camera period.
    decision_frames : int
        Camera periods in one decision period.
    frames : int
        Most camera periods that a run may last.
    """

    camera_period: Annotated[float, _ABOVE_0] = 0.1
    traffic_steps: Annotated[int, _FROM_1] = 1
    decision_frames: Annotated[int, _FROM_1] = 5
    frames: Annotated[int, _FROM_0] = 1200

    def time(self, index: int) -> float:
        """Time of a camera period since the run began [s].

        Parameters
        ----------
        index : int
            Number of the camera period.
        """
        return clock_time(index * self.camera_period)


@checked_parameters
@dataclass(frozen=True, slots=True)
class WorldConfig:
    """Fog, light, and what is drawn.

    Parameters
    ----------
    fog : FogConfig
        The fog; its airlight belongs to `illuminance`.
    illuminance : float
        Horizontal illuminance of the sky [lx].
    darkest : float
        Lowest illuminance that there may be in the run [lx]; ``inf`` if that is `illuminance`.
    renderer : str
        Name of a renderer, or ``"none"`` for no frames.
    has_street_lamps : bool
        Whether lamps stand along the roads.
    scenery_seed : int
        Seed of trees and posts.
    pavement : Pavement
        What the roads' asphalt is like.
    """

    fog: FogConfig
    illuminance: Annotated[float, Range(0.0, 200_000.0, "lx")] = 10_000.0
    darkest: Annotated[float, _FROM_0] = math.inf
    renderer: str = "auto"
    has_street_lamps: bool = False
    scenery_seed: int = 0
    pavement: Pavement = USUAL_PAVEMENT


@dataclass(frozen=True, slots=True)
class ScatterometerConfig:
    """A forward-scatter visibility sensor on board; deviations relative to k."""

    relative_deviation: float = 0.05  # Of its values about their mean [-]
    calibration_deviation: float = 0.1  # Of its calibration, one error for all of a run [-]
    averaging_time: float = 5.0  # Time constant of its average [s]


@dataclass(frozen=True, slots=True)
class LightSensor:
    """The light sensor behind the windscreen."""

    # reach, tail_reach: Distance up to which it finds dipped head lamps and tail lamps in clear air [m]
    reach: float = 400.0
    tail_reach: float = 100.0
    field_of_view: float = math.radians(40.0)  # Full horizontal angle within which it looks for lamps [rad]


@checked_parameters
@dataclass(frozen=True, slots=True)
class SensorsConfig:
    """Sensors next to the camera, and the faults of all."""

    radar: LeadSensor = _RADAR
    gps: Gps = _GPS
    light: LightSensor = LightSensor()
    sign_reach: float = 250.0  # Distance up to which the map lists signs ahead [m]
    scatterometer: ScatterometerConfig | None = None
    faults: tuple[Fault, ...] = ()


@dataclass(frozen=True, slots=True)
class ReportSender:
    """Senders of fog reports to the ego."""

    period: float  # Time between two reports of one sender [s]
    delay: float = 0.5  # Time from a measurement to its arrival [s]
    loss: float = 0.0  # Share of reports that do not arrive [-]
    clock_deviation: float = 0.0  # Standard deviation of the senders' clocks [s]
    deviation: float = 0.1  # Standard deviation of a measurement, relative to k [-]
    wrong: float = 0.0  # Share of measurements that are of any visibility [-]


@dataclass(frozen=True, slots=True)
class RadioSender(ReportSender):
    """Vehicles that report by radio."""

    reach: float = 500.0  # Distance over which they are heard [m]
    equipped: float = 1.0  # Share of the vehicles that report [-]


@dataclass(frozen=True, slots=True)
class MastCamera:
    """A camera on a mast to the right of the route, and the estimator that reads its images."""

    camera: CameraConfig
    estimator: MethodConfig
    right_of_route: float  # [m]


@dataclass(frozen=True, slots=True)
class RoadsideSender(ReportSender):
    """Sensors next to the route, which measure with noise, or whose cameras are read."""

    spacing: float = 804.672  # Distance from one to the next [m]
    first: float = 0.0  # Where the first one stands on the route [m]
    camera: MastCamera | None = None


@checked_parameters
@dataclass(frozen=True, slots=True)
class ReportsConfig:
    """Senders that report fog elsewhere to the ego."""

    roadside: RoadsideSender | None = None
    vehicles: RadioSender | None = None  # Vehicles whose measurement is the truth with noise
    cameras: RadioSender | None = None  # Equipped vehicles, which send what their estimators see


@dataclass(frozen=True, slots=True)
class Harmonisation:
    """How advice to sections of road steps down towards the slow ones."""

    largest_step: float  # From one section to the next [m/s]
    deceleration: float  # Greatest deceleration needed from one section to the next [m/s²]


@dataclass(frozen=True, slots=True)
class SectionsConfig:
    """Sections of the route that are advised each by itself, in the direction of travel."""

    display: Display  # How drivers hear the advice
    spacing: float = 100.0  # Length of a section [m]
    # first, end: Where the first section begins and the last one ends [m]
    first: float = 0.0
    end: float = math.inf
    at: tuple[float, ...] = ()  # Where sections begin, in place of the first one and the spacing [m]
    reading_distance: float = 0.0  # How far before a section its advice is read [m]
    harmonisation: Harmonisation | None = None
    along: tuple[str, ...] = ()  # Edges of the route, where there is no ego


@checked_parameters
@dataclass(frozen=True, slots=True)
class AdviceConfig:
    """From the belief to advice, lamps, and who hears the advice.

    Parameters
    ----------
    adviser, lighting : MethodConfig
        Speed adviser and lighting policy.
    informed_by : str
        How the adviser knows the fog: ``"belief"``, ``"truth"`` or, for sections of road, ``"sensors"``.
    lighting_informed_by : str
        How the lighting policy knows it: ``"belief"`` or ``"truth"``.
    reach : float
        Distance from the ego up to which all hear its advice [m]; 0 for the ego alone.
    stretch : StretchAdvice or None
        Stretch on which all hear its advice, in place of that; its speed is ignored.
    sections : SectionsConfig or None
        Sections that are advised each by itself, in place of both.
    """

    adviser: MethodConfig = _ADVISER
    lighting: MethodConfig = _LIGHTING
    informed_by: str = "belief"
    lighting_informed_by: str = "belief"
    reach: Annotated[float, _FROM_0] = 0.0
    stretch: StretchAdvice | None = None
    sections: SectionsConfig | None = None


@checked_parameters
@dataclass(frozen=True, slots=True)
class ControllerConfig:
    """A controller in the ego, and what its actuators can do."""

    method: MethodConfig
    driver: str = "none"  # Who drives where it requests nothing: "none", "human" or "human_until_intervention"
    delay: float = 0.2  # From a request to the first change of the acceleration [s]
    lag: float = 0.1  # Time constant of that change [s]
    braking: float = 9.0  # Greatest deceleration [m/s²]
    accelerating: float = 2.5  # Greatest acceleration [m/s²]
    frames: int = 1  # Camera periods from one request to the next


class Situation(Protocol):
    """Where vehicles are when an entry of a script begins; None for what is not known of them now."""

    def vehicle_id(self, vehicle: str) -> str:
        """Id of a vehicle: the ego's own for ``ego``."""

    def speed(self, vehicle: str) -> float | None:
        """Speed of a vehicle [m/s]."""

    def position(self, vehicle: str) -> float | None:
        """How far along the route its front bumper is [m]."""

    def lane(self, vehicle: str) -> int | None:
        """Number of its lane from the right."""


@dataclass(frozen=True, slots=True)
class ScriptEntry:
    """Something that happens when a condition holds."""

    name: str  # What conditions and messages call it
    key: str  # Its key path in the scenario
    when: Condition
    actions: Callable[[Situation], Actions | None]  # What begins; None while a vehicle that it needs is not there
    text: str  # What it does, in a few words
    vehicles: tuple[str, ...] = ()  # Vehicles that it involves
    delay: float = 0.0  # From the condition to the beginning [s]
    happens_once: bool = True  # Or whenever the condition begins to hold


@dataclass(frozen=True, slots=True)
class Script:
    """What happens in a run."""

    entries: tuple[ScriptEntry, ...] = ()
    end_when: Condition | None = None  # Condition at which the run is over


@dataclass(frozen=True, slots=True)
class RunRecord:
    """What the files of a recorded run state about its scenario."""

    resolved: Mapping[str, Any] = field(default_factory=dict)  # The scenario as JSON-compatible data
    own_methods: Mapping[str, str] = field(default_factory=dict)  # Versions of the user's methods
    settings: Callable[[], Mapping[str, str]] = dict  # The scenario in sentences, by heading


class ScenarioLike(ABC):
    """What can be run: a `RunConfig`, or a scenario, which makes one."""

    __slots__ = ()
    EXPECTED: ClassVar[str] = "a scenario, as fogsim.load_scenario returns it, or a RunConfig"

    @abstractmethod
    def run_config(self) -> "RunConfig":
        """What the run is made of."""

    def run_record(self) -> RunRecord:
        """What files of a recorded run state about it."""
        return RunRecord()


@checked_parameters
@dataclass(frozen=True, slots=True)
class RunConfig(ScenarioLike):
    """What a run is made of.

    Parameters
    ----------
    traffic : TrafficSetup
        The traffic simulation and the ego.
    world : WorldConfig
        Fog, light, and what is drawn.
    camera : CameraConfig
        The ego's camera.
    sensors : SensorsConfig
        Its other sensors, and the faults of all.
    reports : ReportsConfig
        Senders that report fog elsewhere.
    estimators : tuple of MethodConfig
        Estimators that read every frame.
    fusion : MethodConfig
        How estimates become a belief.
    advice : AdviceConfig
        How the belief becomes advice and lamps.
    controller : ControllerConfig or None
        What drives the ego in its driver's place; None for the driver.
    script : Script
        What happens in the run.
    periods : Periods
        The clocks.
    equipped_share : float
        Share of the other vehicles that have a camera and estimators [-].
    equipped_vehicles : tuple of str
        Ids of vehicles that have them in any case.
    ends_on_collision : bool
        Whether a collision of the ego ends the run.
    stop_before_end : float
        The ego has arrived when it is this near to the end of its route [m].
    along : tuple of str
        Without an ego, edges along which places count.
    cohort : float or None
        Without an ego, time in which vehicles of the cohort are due [s].
    name, description : str
        For messages and reports.
    """

    traffic: TrafficSetup
    world: WorldConfig
    camera: CameraConfig = _CAMERA
    sensors: SensorsConfig = SensorsConfig()
    reports: ReportsConfig = ReportsConfig()
    estimators: tuple[MethodConfig, ...] = _ESTIMATORS
    fusion: MethodConfig = _FUSION
    advice: AdviceConfig = AdviceConfig()
    controller: ControllerConfig | None = None
    script: Script = Script()
    periods: Periods = Periods()
    equipped_share: float = 0.0
    equipped_vehicles: tuple[str, ...] = ()
    ends_on_collision: bool = True
    stop_before_end: float = 60.0
    along: tuple[str, ...] = ()
    cohort: float | None = None
    name: str = "run"
    description: str = ""

    def __post_init__(self) -> None:
        """Refuse clocks that do not fit, estimators that would count twice, and NaN in any part."""
        step, steps, period = self.traffic.step_length, self.periods.traffic_steps, self.periods.camera_period
        if not math.isclose(step * steps, period, rel_tol=1e-5):
            raise InputError(f"periods: {steps} traffic steps of {step:g} s are not one camera period, {period:g} s")
        if len({one.name for one in self.estimators}) < len(self.estimators):
            raise InputError(f"estimators must differ, got {', '.join(one.name for one in self.estimators)}")
        if where := _not_a_number(self):
            raise InputError(f"RunConfig: {where} must be a number, got nan")

    @property
    def has_equipped(self) -> bool:
        """Whether other vehicles than the ego have a camera."""
        return self.equipped_share > 0.0 or bool(self.equipped_vehicles)

    def run_config(self) -> "RunConfig":
        """Return this configuration itself."""
        return self


def _not_a_number(part: object, where: str = "") -> str:
    """Key path of the first NaN in a configuration; empty without one."""
    if isinstance(part, float):
        return where if math.isnan(part) else ""
    if isinstance(part, tuple):
        inner = [(f"{where}[{number}]", one) for number, one in enumerate(part)]
    elif is_dataclass(part):
        inner = [(f"{where}.{one.name}".lstrip("."), getattr(part, one.name)) for one in fields(part)]
    else:
        return ""
    return next(filter(None, (_not_a_number(one, path) for path, one in inner)), "")


def check_ego(ego: str | None, who: str) -> None:
    """Refuse a run without an ego."""
    if ego is None:
        raise InputError(
            f"{who} needs an ego vehicle, and traffic.ego is none; name one, or run traffic alone with fogsim "
            "run, fogsim study or fogsim.run_traffic"
        )
