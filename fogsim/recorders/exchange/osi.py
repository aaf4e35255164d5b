"""What a run was as a trace of ASAM OSI's ground truth."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, BinaryIO

import numpy as np

from fogsim.core.files.osi_messages import framed, osi_library, stamp
from fogsim.recorders.protocol import Derived
from fogsim.values import Lamp, SignalColour, Step, TrafficState, TrafficStep
from fogsim.values.traffic import BOX, PEDESTRIAN

_FOG_CLASSES = ((50.0, "DENSE"), (200.0, "THICK"), (1000.0, "LIGHT"), (2000.0, "MIST"), (4000.0, "POOR_VISIBILITY"),
               (10_000.0, "MODERATE_VISIBILITY"), (40_000.0, "GOOD_VISIBILITY"))  # fmt: skip
"""Upper ends of OSI's classes of visibility [m]; beyond them it is excellent (osi_environment.proto)."""

_TYPES: Mapping[str, str] = MappingProxyType(
    {"car": "MEDIUM_CAR", "van": "DELIVERY_VAN", "truck": "HEAVY_TRUCK", "bus": "BUS", "motorcycle": "MOTORBIKE"}
)
_LAMPS: Mapping[str, Lamp] = MappingProxyType(
    {
        "front_fog_light": Lamp.FRONT_FOG,
        "rear_fog_light": Lamp.REAR_FOG,
        "head_light": Lamp.LOW_BEAM,
        "high_beam": Lamp.HIGH_BEAM,
        "tail_light": Lamp.POSITION,
    }
)
_COLOURS: Mapping[SignalColour, tuple[str, ...]] = MappingProxyType(
    {
        SignalColour.RED: ("RED",),
        SignalColour.YELLOW: ("YELLOW",),
        SignalColour.RED_YELLOW: ("RED", "YELLOW"),
        SignalColour.GREEN: ("GREEN",),
        SignalColour.GREEN_ARROW: ("GREEN",),
        SignalColour.BLINKING: ("YELLOW",),
        SignalColour.OFF: ("YELLOW",),
    }
)
_PERSON = (0.5, 0.5, 1.75)
"""Length, width and height of a person [m]."""


class OsiRecorder:
    """Writes ``ground_truth.osi``: a GroundTruth message for each camera period, each after its length (4 bytes).

    Moving objects are vehicles and persons, their base in the middle of their bounding boxes; traffic lights have one
    object for each lit lens. Fog is the class of the visibility at the camera, which OSI has no number for. Ids are
    numbers by the order of first appearance; an object's ``source_reference`` has the name that it has in SUMO.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._new_message, self._enums = _library()
        self._numbers: dict[str, int] = {}
        self._file: BinaryIO | None = None
        self._closed = False

    def record(self, step: TrafficStep, _derived: Derived | None = None) -> None:
        """Write one step."""
        if self._closed:
            return
        if self._file is None:
            # The folder is there from the first step on.
            self._file = self._path.open("wb")
        self._file.write(framed(self._message(step)))

    def close(self, complete: bool) -> None:  # noqa: ARG002 - a trace that was cut short is one all the same
        """Finish the file; closing twice does nothing."""
        if self._file is not None:
            self._file.close()
        self._closed = True

    def _message(self, step: TrafficStep) -> Any:
        message, traffic = self._new_message(), step.traffic
        stamp(message, step.time)
        if isinstance(step, Step):
            message.host_vehicle_id.value = self._number(f"vehicle {traffic.ids[step.ego]}")
        for row in range(len(traffic.ids)):
            self._add_vehicle(message.moving_object.add(), traffic, row)
        self._add_persons(message, traffic)
        self._add_signals(message, traffic)
        self._add_signs(message, step)
        environment = message.environmental_conditions
        environment.fog = self._enums["fog"].Value(f"FOG_{fog_class(step.truth.visibility)}")
        return message

    def _number(self, name: str) -> int:
        return self._numbers.setdefault(name, len(self._numbers) + 1)

    def _identify(self, thing: Any, kind: str, name: str) -> None:
        thing.id.value = self._number(f"{kind} {name}")
        reference = thing.source_reference.add()
        reference.type = "net.sumo"
        reference.identifier.append(name)

    def _add_vehicle(self, vehicle: Any, traffic: TrafficState, row: int) -> None:
        self._identify(vehicle, "vehicle", traffic.ids[row])
        thing = {PEDESTRIAN: "PEDESTRIAN", BOX: "OTHER"}.get(traffic.types[row])
        vehicle.type = self._enums["object"].Value(f"TYPE_{thing or 'VEHICLE'}")
        length, height = float(traffic.length[row]), float(traffic.height[row])
        heading, grade = float(traffic.heading[row]), float(traffic.grade[row])
        # The middle of the front bumper on the road becomes the middle of the body.
        along = np.array([np.cos(heading) * np.cos(grade), np.sin(heading) * np.cos(grade), np.sin(grade)])
        middle = traffic.position[row] - 0.5 * length * along + np.array([0.0, 0.0, 0.5 * height])
        base = vehicle.base
        _set_vector(base.position, middle)
        base.dimension.length, base.dimension.width, base.dimension.height = length, float(traffic.width[row]), height
        base.orientation.yaw, base.orientation.pitch = heading, -grade
        _set_vector(base.velocity, float(traffic.speed[row]) * along)
        _set_vector(base.acceleration, float(traffic.acceleration[row]) * along)
        if thing is not None:
            return
        kind = _TYPES.get(traffic.types[row], "OTHER")
        vehicle.vehicle_classification.type = self._enums["vehicle"].Value(f"TYPE_{kind}")
        self._set_lamps(vehicle.vehicle_classification.light_state, Lamp(int(traffic.lamps[row])))

    def _set_lamps(self, state: Any, lit: Lamp) -> None:
        on, off = (self._enums["lamp"].Value(f"GENERIC_LIGHT_STATE_{name}") for name in ("ON", "OFF"))
        for field, lamp in _LAMPS.items():
            setattr(state, field, on if lamp in lit else off)
        left, right = Lamp.INDICATOR_LEFT in lit, Lamp.INDICATOR_RIGHT in lit
        indicated = "WARNING" if left and right else "LEFT" if left else "RIGHT" if right else "OFF"
        state.indicator_state = self._enums["indicator"].Value(f"INDICATOR_STATE_{indicated}")
        braking = "NORMAL" if Lamp.STOP in lit else "OFF"
        state.brake_light_state = self._enums["brake"].Value(f"BRAKE_LIGHT_STATE_{braking}")

    def _add_persons(self, message: Any, traffic: TrafficState) -> None:
        persons = traffic.persons
        for row, name in enumerate(persons.ids):
            person = message.moving_object.add()
            self._identify(person, "person", name)
            person.type = self._enums["object"].Value("TYPE_PEDESTRIAN")
            length, width, height = _PERSON
            base, heading = person.base, float(persons.heading[row])
            _set_vector(base.position, persons.position[row] + np.array([0.0, 0.0, 0.5 * height]))
            base.dimension.length, base.dimension.width, base.dimension.height = length, width, height
            base.orientation.yaw = heading
            along = np.array([np.cos(heading), np.sin(heading), 0.0])
            _set_vector(base.velocity, float(persons.speed[row]) * along)

    def _add_signals(self, message: Any, traffic: TrafficState) -> None:
        signals = traffic.signals
        for row, (name, lane) in enumerate(zip(signals.ids, signals.lane, strict=True)):
            colour = signals.colour[row]
            mode = (
                "FLASHING" if colour is SignalColour.BLINKING else "OFF" if colour is SignalColour.OFF else "CONSTANT"
            )
            for lens in _COLOURS[colour]:
                light = message.traffic_light.add()
                self._identify(light, f"{lens} of {lane} at", name)
                _set_vector(light.base.position, signals.position[row])
                # A face looks at those who come toward it.
                light.base.orientation.yaw = float(signals.heading[row]) + np.pi
                diameter = float(signals.diameter[row])
                light.base.dimension.width = light.base.dimension.height = diameter
                light.classification.color = self._enums["colour"].Value(f"COLOR_{lens}")
                light.classification.icon = self._enums["icon"].Value("ICON_NONE")
                light.classification.mode = self._enums["mode"].Value(f"MODE_{mode}")

    def _add_signs(self, message: Any, step: TrafficStep) -> None:
        for sign in () if step.truth.signs is None else step.truth.signs.signs:
            told = message.traffic_sign.add()
            self._identify(told, "sign", sign.sign_id)
            _set_vector(told.main_sign.base.position, np.array(sign.position))
            told.main_sign.base.orientation.yaw = sign.heading + np.pi
            told.main_sign.base.dimension.width = told.main_sign.base.dimension.height = sign.diameter
            classification = told.main_sign.classification
            if sign.kind == "speed_limit":
                classification.type = self._enums["sign"].Value("TYPE_SPEED_LIMIT_BEGIN")
                classification.value.value = 3.6 * sign.value
                classification.value.value_unit = self._enums["unit"].Value("UNIT_KILOMETER_PER_HOUR")
            else:
                classification.type = self._enums["sign"].Value("TYPE_OTHER")
                classification.value.text = sign.kind


def fog_class(visibility: float) -> str:
    """OSI's name of a class of visibility, without ``FOG_`` (`visibility` [m])."""
    return next((name for end, name in _FOG_CLASSES if visibility < end), "EXCELLENT_VISIBILITY")


def _set_vector(vector: Any, values: Any) -> None:
    vector.x, vector.y, vector.z = map(float, values)


def _library() -> tuple[Any, dict[str, Any]]:
    """The message's class, and the enumerations that are used of the package."""
    osi = osi_library("an OSI trace")
    vehicle = osi.osi_object_pb2.MovingObject.VehicleClassification
    light = osi.osi_trafficlight_pb2.TrafficLight.Classification
    return osi.osi_groundtruth_pb2.GroundTruth, {
        "fog": osi.osi_environment_pb2.EnvironmentalConditions.Fog,
        "object": osi.osi_object_pb2.MovingObject.Type,
        "vehicle": vehicle.Type,
        "lamp": vehicle.LightState.GenericLightState,
        "indicator": vehicle.LightState.IndicatorState,
        "brake": vehicle.LightState.BrakeLightState,
        "colour": light.Color,
        "icon": light.Icon,
        "mode": light.Mode,
        "sign": osi.osi_trafficsign_pb2.TrafficSign.MainSign.Classification.Type,
        "unit": osi.osi_trafficsign_pb2.TrafficSignValue.Unit,
    }
