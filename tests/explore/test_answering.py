"""What ``fogsim explore`` answers: pure functions of what is chosen, in the scene of the drive."""

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest
from early_motorway import EARLY

from fogsim.errors import InputError, SimulationError
from fogsim.estimators.night.own_light import VISIBILITIES, OwnLight, cells_of
from fogsim.explore.answering import CALIBRATING, Explorer, Question, _estimate, question
from fogsim.scenario import catalogue, load_scenario
from fogsim.values import Camera, Estimate

SMALL = [EARLY, "renderer=cpu", "camera.width=160", "camera.height=120", "duration_s=2"]
IN_FOG = Question(time=0.5, chosen={"visibility": 80.0})


def begun(settings: list[str]) -> Explorer:
    explorer = Explorer(load_scenario("motorway_fog_bank", settings), "motorway_fog_bank", 1, settings)
    explorer.drive.start()
    return explorer


def test_a_question_has_one_answer_whatever_was_asked_before() -> None:
    explorer = begun(SMALL)
    questions = [
        IN_FOG,
        Question(time=0.5, chosen={"visibility": 80.0, "light": 1.0, "height": 2.0, "pitch": 4.0}),
        Question(time=0.5, frames=3, chosen={"pitch_error": 0.5}),
    ]
    answers = [explorer.answer(asked) for asked in questions]
    assert [explorer.answer(asked) for asked in questions] == answers
    explorer.close()
    other = begun(SMALL)
    assert [other.answer(asked) for asked in questions[::-1]] == answers[::-1]
    other.close()


def test_what_the_script_does_is_seen_until_it_is_chosen_otherwise() -> None:
    dusk = "timeline=[{when: time >= 0.2 s, do: {light: {illuminance_lx: 100}}}]"
    explorer = begun([*SMALL, dusk])
    lights = [
        explorer.answer(Question(time, chosen=chosen))
        for time, chosen in ((0.1, {}), (0.5, {}), (0.5, {"light": 3000.0}))
    ]
    explorer.close()
    assert [answer and answer["values"]["light"] for answer in lights] == [10_000.0, 100.0, 3000.0]


def test_an_outdated_question_does_not_wait_for_the_drive() -> None:
    explorer = begun(SMALL)
    asked = iter((False, False, True))
    assert explorer.answer(Question(time=2.0), lambda: next(asked)) is None
    assert len(explorer.drive.moments) == 3
    explorer.close()


class Workers:
    """Another process that makes calibrations when it is let, of light that is the same everywhere."""

    def __init__(self) -> None:
        self.begun = 0
        self.are_done = False

    def apply_async(self, make: Callable[..., Any], arguments: tuple[Camera, *tuple[Any, ...]]) -> "Workers":
        assert make.__name__ == "own_light"
        self.begun += 1
        self._cells = len(cells_of(arguments[0]).box)
        return self

    def ready(self) -> bool:
        return self.are_done

    def get(self) -> OwnLight:
        veil = np.ones((2, len(VISIBILITIES), self._cells), np.float32)
        return OwnLight(veil, veil, veil[:, 0])

    def terminate(self) -> None:
        self.begun = 0


def test_methods_that_are_being_calibrated_keep_no_other_waiting() -> None:
    explorer, workers = begun([*SMALL, "estimators=[joint_road, night_road]", "light.illuminance_lx=0.1"]), Workers()
    explorer._calibrator._pool = workers  # type: ignore[assignment]
    soon = Question(time=0.5, frames=2, soon=True)
    for height in (1.5, 1.6, 1.5):
        early = explorer.answer(Question(0.5, chosen={"height": height}, soon=True))
        assert early["calibrating"] == ["night_road"]
        assert early["estimates"][1]["reason"] == CALIBRATING
    assert workers.begun == 1  # one after the other
    assert explorer.answer(soon)["calibrating"] == ["night_road"]
    workers.are_done = True
    assert explorer.answer(soon)["calibrating"] == []
    assert workers.begun == 2
    assert explorer.answer(soon)["estimates"][1]["reason"] != CALIBRATING
    explorer.close()
    assert workers.begun == 0


@pytest.mark.timeout(300)
@pytest.mark.nightly
def test_estimates_are_the_same_whether_waited_for_or_not() -> None:
    explorer = begun([*SMALL, "estimators=[joint_road, night_road]", "light.illuminance_lx=0.1"])
    soon = question({"time": "0.5", "frames": "3", "soon": "on"})
    while (early := explorer.answer(soon))["calibrating"]:
        pass
    assert early == explorer.answer(Question(0.5, 3))
    explorer.close()


def test_a_fault_ends_the_drive_and_the_moments_before_it_are_still_answered(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    explorer = begun(SMALL)
    before = explorer.answer(IN_FOG)
    monkeypatch.setattr(explorer.drive._loop, "advance", MagicMock(side_effect=SimulationError("SUMO is lost")))
    later = explorer.answer(replace(IN_FOG, time=1.5))
    explorer.close()
    assert before is not None
    assert later == {**before, "fault": "the drive ends at 0.5 s: SUMO is lost", "duration": 0.5}
    assert [record.getMessage() for record in caplog.records] == ["fogsim: the drive ends at 0.5 s: SUMO is lost"]


def test_what_has_no_end_is_no_number_of_the_answer() -> None:
    for estimate in (Estimate("own", 0.0, 0.0), Estimate("own", 0.03, 0.0), Estimate.invalid("own", "")):
        json.dumps(_estimate(estimate), allow_nan=False)


def test_only_a_drive_with_frames_is_explored() -> None:
    with pytest.raises(InputError, match="renderer: none draws no frames"):
        begun(["renderer=none", "estimators=[]"])
    with pytest.raises(InputError, match="fogsim explore needs an ego vehicle"):
        begun(
            [
                "traffic.ego=none",
                "lighting=low_beam",
                "traffic.keep_lane=[]",
                "traffic.events=[]",
                "renderer=none",
                "estimators=[]",
                "fog={visibility_m: 80}",
                "fusion=grid_filter",
            ]
        )


@pytest.mark.timeout(1800)  # night methods calibrate themselves for each camera
@pytest.mark.nightly
def test_every_shipped_scenario_is_explored() -> None:
    for name in catalogue():
        # One draws nothing and has no estimators.
        estimators = ["estimators=[joint_road]"] if "renderer: none" in catalogue()[name].read_text("utf-8") else []
        explorer = Explorer(load_scenario(name, [*SMALL[1:4], *estimators]), name, 1)
        explorer.drive.start()
        for chosen in ({}, {"visibility": 80.0}, {"visibility": 80.0, "light": 2000.0}):
            answer = explorer.answer(Question(time=1.0, chosen=chosen))
            assert answer["estimates"], name
        explorer.close()


@pytest.fixture(scope="module")
def explorer() -> Iterator[Explorer]:
    """One for all tests below; its drive has ended, since a process has one SUMO."""
    explorer = begun(SMALL)
    while not explorer.drive.is_over:
        explorer.drive.advance()
    explorer.drive.close()
    yield explorer
    explorer.close()


def test_the_frame_the_estimates_and_the_advice_follow_what_is_chosen(explorer: Explorer) -> None:
    clear = explorer.answer(Question(time=0.5))
    dense = explorer.answer(IN_FOG)
    assert dense["image"] != clear["image"]
    assert clear["values"]["visibility"] > 1000
    assert dense["values"]["visibility"] == pytest.approx(80.0)
    road = dense["estimates"][0]
    assert road["low"] < 80 < road["high"]
    assert dense["advice"]["speed"] < dense["advice"]["limit"]
    assert dense["frames"] == 1
    assert dense["command"].endswith(
        "--set=fog.outside_visibility_m=null '--set=fog.banks=[]' --set=fog.visibility_m=80"
    )


def test_a_wrong_pitch_changes_estimates_and_no_pixel(explorer: Explorer) -> None:
    right = explorer.answer(IN_FOG)
    wrong = explorer.answer(Question(time=0.5, chosen={"visibility": 80.0, "pitch_error": 1.0}))
    assert wrong["image"] == right["image"]
    assert wrong["estimates"] != right["estimates"]


def test_lamps_show_by_night(explorer: Explorer) -> None:
    images = set()
    for lamps in ({}, {"lamps": "none"}, {"lamps": "high"}, {"rear_fog": "on"}):
        answer = explorer.answer(question({"time": "0.5", "light": "0.1", **lamps}))
        images.add(answer["image"])
    assert len(images) == 4


def test_after_the_end_comes_the_last_moment(explorer: Explorer) -> None:
    answer = explorer.answer(Question(time=100.0))
    assert answer["time"] == answer["duration"] == 2.0


def test_an_outdated_question_is_given_up(explorer: Explorer) -> None:
    asked = iter((False, True))
    assert explorer.answer(Question(time=1.0, frames=10), lambda: next(asked)) is None


@pytest.mark.parametrize(
    ("query", "message"),
    [
        ({"vis": "80"}, "unknown vis; known are .*visibility"),
        ({"frames": "41"}, "frames must be a number from 1 to 40, got '41'"),
        ({"time": "nan"}, "time must be a number from 0 to 86400, got 'nan'"),
        ({"lamps": "all"}, "lamps must be one of none, low, fog, high, got 'all'"),
    ],
)
def test_a_query_that_the_page_does_not_send_is_refused(query: dict[str, str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        question(query)


def test_a_value_out_of_range_is_refused_as_in_a_file(explorer: Explorer) -> None:
    with pytest.raises(InputError, match=r"camera\.pitch_deg: input should be less than or equal to 45; got 80"):
        explorer.answer(Question(chosen={"pitch": 80.0}))
