"""A lamp that is dead on one side: in the picture, in files, and by Python."""

from pathlib import Path

import numpy as np
import pytest

import fogsim
from fogsim import script as fs
from fogsim.lighting import own_head_lamps
from fogsim.scenario import build
from fogsim.scenario.timeline import actions_of
from fogsim.traffic import LampFailureEvent
from fogsim.values import Lamp
from fogsim.values.light import Side, dark_on
from fogsim.values.script import SetLamps
from tests.test_grades import look

NIGHT = ("light.illuminance_lx=0.05",)
REAR = Lamp.POSITION | Lamp.STOP


def picture(dark: int = 0) -> np.ndarray:
    """Luminance of a night frame with a car 30 m ahead that brakes, on the car's left and right half and between."""
    ids, _, radiance = look(0.0, *NIGHT, lamps=Lamp(int(REAR) | dark))
    rows, columns = np.nonzero(ids == 17)
    left, right = columns.min(), columns.max() + 1
    car = radiance.mean(axis=-1)[rows.min() : rows.max() + 1, left:right]
    third = car.shape[1] // 3
    return np.array([car[:, :third].max(), car[:, third:-third].max(), car[:, -third:].max()])


def test_a_lamp_that_is_dark_on_one_side_is_drawn_so() -> None:
    """Its disk and its glow go; the other one's stay, and the third stop lamp's."""
    whole, one_sided = picture(), picture(dark_on(int(REAR), Side.LEFT))
    assert one_sided[0] < 0.1 * whole[0]
    assert one_sided[1:] == pytest.approx(whole[1:], rel=0.1)
    without_third = picture(dark_on(int(REAR), Side.LEFT) | dark_on(int(REAR), Side.MIDDLE))
    assert without_third[1] < 0.3 * whole[1]
    assert without_third[2] == pytest.approx(whole[2], rel=0.1)


def test_the_own_head_lamp_that_is_dead_lights_nothing() -> None:
    lit = own_head_lamps(Lamp(int(Lamp.LOW_BEAM) | dark_on(int(Lamp.LOW_BEAM), Side.LEFT)), 1.3)
    assert [lamp.offset for lamp in lit] == [own_head_lamps(Lamp.LOW_BEAM, 1.3)[1].offset]


FILE = """
name: one_eyed
duration: 5 s
road: {template: motorway, length: 2 km}
actors:
  ego: {speed: 80 km/h}
  slow: {ahead_of: ego, gap: 60 m, lamps: {position: {left: failed}, low_beam: {right: failed}}}
fog: {visibility: 100 m}
timeline:
  - when: time > 1 s
    do: {slow: {lamps: {stop: {left: failed, middle: failed}, rear_fog: on}}}
"""


def written(folder: Path, text: str) -> fogsim.Scenario:
    path = folder / "one_eyed.fog.yaml"
    path.write_text(text, encoding="utf-8")
    return fogsim.load_scenario(path)


def test_files_say_it_of_actors_and_in_the_timeline(tmp_path: Path) -> None:
    scenario = written(tmp_path, FILE)
    (event,) = build.traffic_setup(scenario).events
    assert isinstance(event, LampFailureEvent)
    assert event.switches[1:] == (
        SetLamps("slow", failed=Lamp.POSITION, side=Side.LEFT),
        SetLamps("slow", failed=Lamp.LOW_BEAM, side=Side.RIGHT),
    )
    begun = actions_of(scenario.timeline[0], 0.03, {}, Anywhere())
    assert begun.traffic == (
        SetLamps("slow", lit=Lamp.REAR_FOG),
        SetLamps("slow", failed=Lamp.STOP, side=Side.LEFT),
        SetLamps("slow", failed=Lamp.STOP, side=Side.MIDDLE),
    )


class Anywhere:
    """Everybody drives somewhere."""

    def vehicle_id(self, vehicle: str) -> str:
        return vehicle

    def speed(self, vehicle: str) -> float | None:  # noqa: ARG002 - the protocol's parameters
        return 20.0

    position = speed

    def lane(self, vehicle: str) -> int | None:  # noqa: ARG002 - likewise
        return 0


def test_python_writes_the_same_file(tmp_path: Path) -> None:
    scenario = written(tmp_path, FILE)
    text = fs.to_yaml(scenario)
    assert written(tmp_path, text).model_dump() == scenario.model_dump()
    lamps = fs.LampActions(position=fs.LampSides(left="failed"), low_beam=fs.LampSides(right="failed"))
    assert fs.Actor(lamps=lamps).lamps == scenario.actors["slow"].lamps
    assert fs.LampActions(stop=fs.StopLampSides(left="failed", middle="failed"), rear_fog="on") == (
        scenario.timeline[0].do["slow"][0].lamps  # type: ignore[index, union-attr]
    )


def test_mistakes_are_told_at_their_place(tmp_path: Path) -> None:
    for old, new, told in [
        ("{left: failed}", "{lefft: failed}", "actors.slow.lamps.position.lefft: unknown key; did you mean 'left'"),
        ("{left: failed}", "broken", "actors.slow.lamps.position: must be on, off, failed, automatic, or a block of"),
        ("{left: failed}", "{}", "actors.slow.lamps.position: no action given; allowed: left, right"),
        ("{left: failed}", "{middle: failed}", "actors.slow.lamps.position.middle: unknown key"),
        ("{position: {left", "{indicator_left: {left", "actors.slow.lamps.indicator_left"),
        ("ahead_of", "type: motorcycle, ahead_of", "slow: lamps: position and low_beam of a motorcycle are single"),
        (
            "lamps: {position",
            "type: truck, lamps: {position",
            "timeline.0.do.slow: lamps.stop.middle: a truck has no third stop lamp; allowed: left, right",
        ),
        (
            "do: {slow:",
            "do: {new: {depart: {like: slow, gap: 30 m, type: truck}}}\n  - when: time > 2 s\n    do: {new:",
            "timeline.1.do.new: lamps.stop.middle: a truck has no third stop lamp",
        ),
        (
            "lamps: {position: {left: failed}, low_beam: {right: failed}}}\nfog: {visibility: 100 m}\ntimeline:\n"
            "  - when: time > 1 s\n    do: {slow:",
            "type: truck}\nfog: {visibility: 100 m}\ntimeline:\n  - when: time > 1 s\n"
            "    do: {new: {depart: {like: slow, gap: 30 m}}}\n  - when: time > 2 s\n    do: {new:",
            "timeline.1.do.new: lamps.stop.middle: a truck has no third stop lamp",
        ),
        ("{stop: {left: failed", "{stop: {lefft: failed", "timeline.0.do.slow.lamps.stop.lefft: unknown key"),
    ]:
        with pytest.raises(fogsim.InputError) as error:
            written(tmp_path, FILE.replace(old, new))
        assert told in str(error.value)
