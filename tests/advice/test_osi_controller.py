"""A controller in a process of its own: what it is sent, what it may answer, and that it never keeps a run waiting."""

import math
import re
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from osi3.osi_motionrequest_pb2 import MotionRequest
from osi3.osi_sensordata_pb2 import SensorData

import fogsim
from fogsim.advice import CONTROLLERS
from fogsim.core.registry import make
from fogsim.errors import InputError, MethodError
from fogsim.testing.collection import collect
from fogsim.testing.execution import check_test
from fogsim.values import Camera, Control, Frame, LeadMeasurement, Observation, Step
from fogsim.values.result_checks import checked_control
from tests.helpers.osi_peer import Answer, framed, osi_peer

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "how_to" / "own_controller.md").read_text(encoding="utf-8")
SEEN = Observation(np.zeros((1, 1, 3), np.uint8), 20.0)


def printed(kind: str, name: str) -> str:
    (text,) = re.findall(rf"```{kind}\n(# {name}\n.*?)```", PAGE, re.DOTALL)
    return str(text)


def asked(answer: Answer, observation: Observation = SEEN, **parameters: object) -> Control:
    with osi_peer(answer) as port:
        controller = make(CONTROLLERS, "osi", port=port, **parameters)
        return checked_control("osi", controller.control(observation))


def request(**fields: float) -> bytes:
    """A MotionRequest with values of its desired state by their paths, joined by "_"."""
    answer = MotionRequest()
    for path, value in fields.items():
        *parts, last = path.split("_")
        part = answer.desired_state
        for name in parts:
            part = getattr(part, name)
        setattr(part, last, value)
    return answer.SerializeToString()


def test_a_message_holds_what_was_measured_and_no_truth() -> None:
    image, got = np.arange(48, dtype=np.uint8).reshape(4, 4, 3), []
    frame = Frame(1.5, image, Camera(4, 4, 2.0, (2.0, 2.0), 1.4))

    def answer(content: bytes) -> list[bytes]:
        got.append(SensorData.FromString(content))
        return [framed(b"")]

    seen = Observation(frame, 1.0 / 3.0, LeadMeasurement(0.1, -0.7))
    assert asked(answer, seen, frames=True) == asked(answer, Observation(frame, 20.0)) == Control()
    whole, bare = got
    (view,), (lead,) = whole.sensor_view, whole.moving_object
    assert (whole.timestamp.seconds, whole.timestamp.nanos) == (1, 500_000_000)
    assert view.host_vehicle_data.vehicle_motion.velocity.x == 1.0 / 3.0
    assert (lead.base.position.x, lead.base.velocity.x) == (0.1, -0.7)
    assert view.camera_sensor_view[0].image_data == image.tobytes()
    written = view.camera_sensor_view[0].view_configuration
    assert (written.number_of_pixels_horizontal, written.number_of_pixels_vertical) == (4, 4)
    assert written.channel_format == [written.CHANNEL_FORMAT_RGB_U8_LIN]
    assert written.field_of_view_horizontal == pytest.approx(math.radians(90.0))
    assert not view.HasField("global_ground_truth")
    assert not bare.moving_object
    assert not bare.sensor_view[0].camera_sensor_view


def test_requests_come_back_as_they_were_sent() -> None:
    assert asked(lambda _: [framed(request(acceleration_x=-0.1))]) == Control(acceleration=-0.1)
    assert asked(lambda _: [framed(request(velocity_x=1.0 / 3.0))]) == Control(speed=1.0 / 3.0)
    whole = framed(request(acceleration_x=-8.0))
    assert asked(lambda _: [whole[:2], whole[2:9], whole[9:]]) == Control(acceleration=-8.0)


def dripping(_: bytes) -> Iterator[bytes]:
    yield struct.pack("<L", 60_000)
    while True:
        time.sleep(0.02)
        yield b"\0"


LATE = MotionRequest()
LATE.timestamp.seconds = 7
PATH = MotionRequest(motion_request_type=MotionRequest.MOTION_REQUEST_TYPE_TRAJECTORY)


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (lambda _: [], r"no answer within 0.3 s \(controller.parameters.timeout\) to the message of 0 s"),
        (dripping, r"no answer within 0.3 s"),
        (lambda _: None, "the process closed the connection"),
        (lambda _: [b"HTTP/1.1 400 Bad Request\r\n\r\n"], r"at most 65536 bytes, got 1347703880"),
        (lambda _: [framed(b"rubbish")], "expected a MotionRequest, got 7 other bytes"),
        (lambda _: [framed(b"\xc2\x3e\x03abc")], "unknown fields"),
        (lambda _: [framed(LATE.SerializeToString())], "answer with timestamp 0 s, got 7 s"),
        (lambda _: [framed(PATH.SerializeToString())], "got motion_request_type"),
        (lambda _: [framed(request(acceleration_x=1.0, acceleration_y=0.5))], "got desired_state.acceleration"),
        (lambda _: [framed(request(position_x=1.0))], "got desired_state.position"),
        (lambda _: [framed(request(acceleration_x=1.0, velocity_x=0.5))], "expected an acceleration or a speed"),
        (lambda _: [framed(request(acceleration_x=math.nan))], "acceleration must be finite"),
    ],
)
def test_what_is_no_answer_ends_the_run(answer: Answer, message: str) -> None:
    with pytest.raises((MethodError, InputError), match=message) as caught:
        asked(answer, timeout=0.3)
    assert "controller 'osi'" in str(caught.value)


def test_a_process_that_does_not_listen_is_named(free_port: Callable[[], int]) -> None:
    port = free_port()
    with pytest.raises(MethodError, match=rf"127.0.0.1:{port} \(controller.parameters.port\): .* start yours first"):
        make(CONTROLLERS, "osi", port=port)
    for wrong in (80, 65536, "4711", True):
        with pytest.raises(InputError, match="1024 … 65535"):
            make(CONTROLLERS, "osi", port=wrong)


@pytest.fixture
def listening(tmp_path: Path, free_port: Callable[[], int]) -> Iterator[int]:
    """Port of the process that the page prints."""
    port, file = free_port(), tmp_path / "my_controller.py"
    file.write_text(printed("python", "my_controller.py").replace("4711", str(port)), encoding="utf-8")
    with subprocess.Popen([sys.executable, file]) as process:
        try:
            for _ in range(100):
                time.sleep(0.1)
                try:
                    make(CONTROLLERS, "osi", port=port)
                except MethodError:
                    continue
                break
            yield port
        finally:
            process.kill()


def driven(file: Path, controller: str) -> list[Step]:
    scenario = fogsim.load_scenario(file, ["duration_s=12", "fog.visibility_m=30", f"sut.controller={controller}"])
    return list(fogsim.run(scenario, seed=1))


def test_a_brake_over_the_socket_drives_as_in_this_process(tmp_path: Path, listening: int) -> None:
    """The page's brakes, in one process and in another: the same run, bit for bit."""
    file = tmp_path / "own_brake.fog.yaml"
    text = printed("yaml", "own_brake.fog.yaml").partition("expect:")[0].replace("$fog", "100 m")
    file.write_text(text, encoding="utf-8")
    (tmp_path / "mine.py").write_text(printed("python", "mine.py"), encoding="utf-8")
    here = driven(file, "{method: 'mine:EmergencyBrake', parameters: {threshold: 2}}")
    there = driven(file, f"{{method: osi, parameters: {{port: {listening}, timeout: 60}}}}")
    assert any(step.command.control is not None for step in here)
    assert here[-1].traffic.speed[here[-1].ego] < 0.1, "it has braked"
    for one, other in zip(here, there, strict=True):
        assert one.command == other.command
        assert one.traffic.position.tobytes() == other.traffic.position.tobytes()
        assert one.traffic.speed.tobytes() == other.traffic.speed.tobytes()


def test_a_process_that_dies_costs_one_case(tmp_path: Path) -> None:
    count = 0

    def answer(_: bytes) -> list[bytes] | None:
        nonlocal count
        count += 1
        return [framed(b"")] if count < 15 else None

    text = printed("yaml", "own_brake.fog.yaml").replace("20 s", "1 s").replace("mine:EmergencyBrake", "osi")
    with osi_peer(answer) as port:
        text = text.replace('"osi"', f"{{method: osi, parameters: {{port: {port}}}}}")
        (tmp_path / "two.fog.yaml").write_text(text, encoding="utf-8")
        (test,) = collect([tmp_path / "two.fog.yaml"])
        outcome = check_test(test, tmp_path / "out", 1)
    first, second = outcome.results
    assert first.is_passed
    assert "the process closed the connection" in str(second.message)
