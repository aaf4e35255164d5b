"""Structures that additional files tell of."""

from pathlib import Path

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.traffic.road.structures import structures
from fogsim.values import StructureKind

WALL = """<additional>
    <poly id="p" type="park" shape="0,0 1,0 1,1"/>
    <poly id="w" type="fogsim.structure.wall" shape="0,0,1.5 10,0,2">
        <param key="width" value="0.3"/><param key="top" value="3"/>
    </poly>
</additional>
"""


def test_a_polygon_is_a_structure_by_its_type(tmp_path: Path) -> None:
    file = tmp_path / "a.add.xml"
    # A corner that is there twice counts once.
    file.write_text(WALL.replace("0,0,1.5 10", "0,0,1.5 0,0,1.5 10"), encoding="utf-8")
    (wall,) = structures([file, tmp_path / "map.xodr"])
    assert (wall.structure_id, wall.kind, wall.width, wall.bottom, wall.top) == ("w", StructureKind.WALL, 0.3, 0.0, 3.0)
    np.testing.assert_array_equal(wall.line, [[0.0, 0.0, 1.5], [10.0, 0.0, 2.0]])


def test_mistakes_in_structures_are_told(tmp_path: Path) -> None:
    for old, new, told in [
        ("structure.wall", "structure.wal", "poly 'w': unknown kind of structure 'wal'; did you mean 'wall'"),
        ('key="top"', 'key="height"', "poly 'w': <param key=.top. value=.…./> is missing"),
        ('"3"', '"high"', "poly 'w': top must be a number within .*, got 'high'"),
        ('"3"', '"0"', "a top over its bottom"),
        (".wall", '.wall" geo="yes', "poly 'w': geo: expected corners x,y of the network"),
    ]:
        file = tmp_path / "a.add.xml"
        file.write_text(WALL.replace(old, new, 1), encoding="utf-8")
        with pytest.raises(InputError, match=told):
            structures([file])
