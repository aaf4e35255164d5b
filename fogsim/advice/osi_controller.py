"""A controller in a process of its own, which the user starts: ASAM OSI messages over a socket of this machine."""

import contextlib
import math
import socket
import time
import weakref
from typing import Annotated, Any

from fogsim.core.files.osi_messages import LENGTH, framed, osi_library, stamp
from fogsim.core.parameters import Range, checked_parameters
from fogsim.errors import MethodError
from fogsim.values import Control, Observation, Response

_HOST = "127.0.0.1"
"""The only machine that is connected to: a scenario may come from others."""

_LONGEST = 2**16
"""Longest answer that is read [bytes]; a request takes about 100."""


@checked_parameters
class OsiController:
    """A process that listens on a port of this machine: each run connects, sends what is measured and reads requests.

    Each message follows its length (4 bytes, little-endian), as in a trace of OSI: a SensorData, then the answer to it,
    a MotionRequest. Nothing is ever started, and no other machine connected to.

    Parameters
    ----------
    port : int
        Port of 127.0.0.1 on which the process listens.
    timeout : float
        Longest time to connect, and to the complete answer to a message [s].
    frames : bool
        Whether messages contain the frame.
    """

    def __init__(
        self,
        *,
        port: Annotated[int, Range(1024, 65535)] = 4711,
        timeout: Annotated[float, Range(0.01, 3600.0, "s")] = 2.0,
        frames: bool = False,
    ) -> None:
        self._osi = osi_library("controller: osi")
        self._who = f"controller 'osi' at {_HOST}:{port} (controller.parameters.port)"
        self._timeout, self._frames = timeout, frames
        try:
            self._socket = socket.create_connection((_HOST, port), timeout)
        except OSError as error:
            raise MethodError(
                f"{self._who}: expected a process that listens there, start yours first: {_reason(error)}"
            ) from error
        weakref.finalize(self, _close, self._socket)
        # The last part of a frame would otherwise wait until the others are acknowledged.
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def control(self, observation: Observation) -> Control:
        """Send what was measured and wait for the request; MethodError without one in time that FogSim can honour."""
        message = self._sensor_data(observation)
        try:
            self._socket.settimeout(self._timeout)
            self._socket.sendall(framed(message))
            content = self._answer(time.monotonic() + self._timeout)
        except TimeoutError as error:
            raise MethodError(
                f"{self._who}: no answer within {self._timeout:g} s (controller.parameters.timeout) to the message of "
                f"{observation.time:g} s"
            ) from error
        except OSError as error:
            raise MethodError(f"{self._who}: no answer to the message of {observation.time:g} s: {error}") from error
        return self._request(content, message.timestamp)

    def _sensor_data(self, observation: Observation) -> Any:
        """A SensorData; its frame's origin is the middle of the front bumper, x points ahead."""
        message = self._osi.osi_sensordata_pb2.SensorData()
        stamp(message, observation.time)
        message.last_measurement_time.CopyFrom(message.timestamp)
        view = message.sensor_view.add()
        view.host_vehicle_data.vehicle_motion.velocity.x = observation.speed
        if observation.lead is not None:
            lead = message.moving_object.add()
            lead.reference_point = lead.REFERENCE_POINT_REAR_MIDDLE
            lead.base.position.x = observation.lead.distance
            lead.base.velocity.x = observation.lead.relative_speed
        if self._frames:
            _add_frame(view.camera_sensor_view.add(), observation)
        return message

    def _answer(self, deadline: float) -> bytes:
        """Content of the next message; OSError if it has not come by the `deadline` (of time.monotonic)."""
        (length,) = LENGTH.unpack(self._received(LENGTH.size, deadline))
        if length > _LONGEST:
            raise MethodError(
                f"{self._who}: expected the length of a MotionRequest (4 bytes, little-endian) of at most {_LONGEST} "
                f"bytes, got {length}"
            )
        return self._received(length, deadline)

    def _received(self, count: int, deadline: float) -> bytes:
        found = bytearray()
        while len(found) < count:
            left = deadline - time.monotonic()
            if left <= 0.0:
                raise TimeoutError
            self._socket.settimeout(left)
            part = self._socket.recv(count - len(found))
            if not part:
                raise ConnectionResetError("the process closed the connection")
            found += part
        return bytes(found)

    def _request(self, content: bytes, timestamp: Any) -> Control:
        answer = self._osi.osi_motionrequest_pb2.MotionRequest()
        try:
            answer.ParseFromString(content)
        except Exception as error:  # protobuf's, which is no dependency of its own
            raise MethodError(f"{self._who}: expected a MotionRequest, got {len(content)} other bytes") from error
        size = answer.ByteSize()
        answer.DiscardUnknownFields()
        if answer.ByteSize() != size:
            raise MethodError(f"{self._who}: expected a MotionRequest of OSI 3, got one with unknown fields")
        if answer.HasField("timestamp") and answer.timestamp != timestamp:
            expected, got = _seconds(timestamp), _seconds(answer.timestamp)
            raise MethodError(f"{self._who}: expected the answer with timestamp {expected}, got {got}")
        known = {"version", "timestamp", "motion_request_type", "desired_state"}
        wrong = [field.name for field, _ in answer.ListFields() if field.name not in known]
        wrong += [
            f"desired_state.{field.name}"
            for field, value in answer.desired_state.ListFields()
            if field.name not in {"acceleration", "velocity"} or value.y or value.z
        ]
        if wrong or answer.motion_request_type:
            raise MethodError(
                f"{self._who}: expected desired_state with x of acceleration or velocity, along the vehicle, alone; "
                f"got {', '.join(wrong) or 'motion_request_type'}"
            )
        state = answer.desired_state
        return Control(
            acceleration=state.acceleration.x if state.HasField("acceleration") else None,
            speed=state.velocity.x if state.HasField("velocity") else None,
        )


def _add_frame(camera_view: Any, observation: Observation) -> None:
    """Add the pixels, row by row, and what the vehicle assumes of the camera."""
    image, written = observation.image, camera_view.view_configuration
    camera_view.image_data = image.tobytes()
    written.number_of_pixels_vertical, written.number_of_pixels_horizontal = image.shape[:2]
    camera = getattr(observation.frame, "camera", None)
    colours, bits = "MONO" if image.ndim == 2 else "RGB", 8 * image.itemsize
    is_linear = camera is not None and camera.response is Response.LINEAR
    # OSI has formats for values in proportion to light alone.
    layout = f"{colours}_U{bits}_LIN" if is_linear else "OTHER"
    written.channel_format.append(written.ChannelFormat.Value(f"CHANNEL_FORMAT_{layout}"))
    if camera is not None:
        written.field_of_view_horizontal = 2.0 * math.atan(0.5 * camera.width / camera.focal_length)
        written.field_of_view_vertical = 2.0 * math.atan(0.5 * camera.height / camera.focal_length)


def _close(connection: socket.socket) -> None:
    """End a connection, so that the process knows that the run is over even if a child inherited the socket."""
    with contextlib.suppress(OSError):  # the process may have ended it
        connection.shutdown(socket.SHUT_RDWR)
    connection.close()


def _reason(error: OSError) -> str:
    return error.strerror or str(error)


def _seconds(timestamp: Any) -> str:
    return f"{timestamp.seconds + 1e-9 * timestamp.nanos:g} s"
