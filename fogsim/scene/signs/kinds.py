"""Kinds of signs, each with its face."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from fogsim.scene.signs.faces import Face, disc_face, plate_face, regular, triangle, warning_face
from fogsim.scene.signs.symbols import (
    BLACK,
    BLUE,
    DIODES,
    FIELD,
    GREY,
    RED,
    RED_DIODES,
    YELLOW,
    bend,
    exclamation,
    flat,
    fog,
    line,
    motorway,
    queue_of_cars,
    skidding_car,
    text,
    two_cars,
    walking_figure,
)
from fogsim.scene.solids import Material, disc, merge
from fogsim.units import KMH_PER_MPS
from fogsim.values.road import Sign
from fogsim.values.scene import Instance, Mesh


@dataclass(frozen=True, slots=True)
class SignKind:
    """A kind of sign."""

    meaning: str  # What it says
    code: str  # Its number in the German catalogue (VzKat), by which OpenDRIVE files commonly name it
    face: Callable[[float], Face]  # Its face by its value [SI]


def _number(speed: float) -> str:
    """What a limit [m/s] says: km/h."""
    return str(round(speed * KMH_PER_MPS))


def _limit(speed: float) -> Face:
    digits = _number(speed)
    return disc_face(text(digits, 0.46 if len(digits) < 3 else 0.40, BLACK, widest=0.64))


def _end_of_limit(speed: float) -> Face:
    digits = _number(speed)
    grey = text(digits, 0.46 if len(digits) < 3 else 0.40, GREY, widest=0.64)
    return disc_face(merge((grey, _stripes())), frame=BLACK, ring=0.93)


def _stripes() -> Mesh:
    strokes = [line([(-0.3 + d, -0.3 - d), (0.3 + d, 0.3 - d)], 0.028, BLACK) for d in (-0.09, -0.045, 0, 0.045, 0.09)]
    return merge(strokes)


def _variable_limit(speed: float) -> Face:
    lit = text(_number(speed), 0.42 if len(_number(speed)) < 3 else 0.36, DIODES, widest=0.58)
    ring = disc((0, 0, 0), 0.45, (1, 0, 0), (0, 1, 0), RED_DIODES, sides=32, hole=0.36, instance=Instance.SIGN)
    housing = Material((0.012, 0.012, 0.013))
    return plate_face(merge((lit, ring)), field=housing, border=housing)


def _stop() -> Face:
    return Face(regular(8, 0.3927, 0.541), FIELD, RED, RED, (0.94, 0.9), text("STOP", 0.34, FIELD, widest=0.8))


def _yield() -> Face:
    nothing = text("", 1.0, BLACK)
    return Face(triangle(-1.0), FIELD, RED, FIELD, (0.965, 0.60), nothing)


def _no_entry() -> Face:
    bar = flat([(-0.37, -0.08), (0.37, -0.08), (0.37, 0.08), (-0.37, 0.08)], FIELD)
    return disc_face(bar, field=RED, ring=0.93)


def _priority() -> Face:
    nothing = text("", 1.0, BLACK)
    return Face(regular(4, 0.0), BLACK, FIELD, YELLOW, (0.97, 0.72), nothing)


def _plate(code: str) -> Face:
    """Blank plate with a sign's code written on it, for codes that have no face."""
    return plate_face(text(code, 0.24, BLACK, widest=0.84))


SIGN_KINDS: Mapping[str, SignKind] = {
    "speed_limit": SignKind("speed limit, any number of km/h", "274", _limit),
    "end_of_speed_limit": SignKind("end of a speed limit", "278", _end_of_limit),
    "end_of_limits": SignKind("end of all limits", "282", lambda _: disc_face(_stripes(), frame=BLACK, ring=0.93)),
    "variable_speed_limit": SignKind("speed limit of diodes on a black plate", "274.2", _variable_limit),
    "stop": SignKind("stop and give way", "206", lambda _: _stop()),
    "yield": SignKind("give way", "205", lambda _: _yield()),
    "priority_road": SignKind("priority road", "306", lambda _: _priority()),
    "no_entry": SignKind("no entry", "267", lambda _: _no_entry()),
    "no_overtaking": SignKind("no overtaking", "276", lambda _: disc_face(two_cars())),
    "pedestrian_crossing": SignKind(
        "pedestrian crossing", "350", lambda _: plate_face(walking_figure(), field=BLUE, border=FIELD)
    ),
    "motorway": SignKind("motorway", "330.1", lambda _: plate_face(motorway(), field=BLUE, border=FIELD)),
    "warning": SignKind("danger", "101", lambda _: warning_face(exclamation())),
    "fog_warning": SignKind("fog, reduced visibility", "101.fog", lambda _: warning_face(fog())),
    "slippery": SignKind("slippery road", "114", lambda _: warning_face(skidding_car())),
    "curve_left": SignKind("curve to the left", "103-10", lambda _: warning_face(bend(1))),
    "curve_right": SignKind("curve to the right", "103-20", lambda _: warning_face(bend(-1))),
    "queue": SignKind("queues", "124", lambda _: warning_face(queue_of_cars())),
}
"""Kinds by name. A kind may also be written as its code, plain or after ``xodr.``; any other gets a plate that says
its code. A sign over a lane hangs from a gantry, any other stands on a post."""

_LIMITS = [SIGN_KINDS[name] for name in ("speed_limit", "end_of_speed_limit", "variable_speed_limit")]
_BY_CODE = {kind.code: kind for kind in SIGN_KINDS.values()}


def face_of(sign: Sign) -> Face:
    """Face of a sign; that of an unknown kind is a plate with its code."""
    code = sign.kind.removeprefix("xodr.")
    kind = SIGN_KINDS.get(code) or _BY_CODE.get(code)
    speechless = kind in _LIMITS and sign.value <= 0
    return _plate(code) if kind is None or speechless else kind.face(sign.value)


def shape_name(sign: Sign) -> str:
    """Name of the shape of a sign's face; signs that look alike share it."""
    return f"sign {sign.kind} {_number(sign.value)}"
