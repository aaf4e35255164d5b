"""gallen2014's evaluation, run small: every table has its rows, and what must differ does."""

from fogsim.reproduce import REPRODUCTIONS
from fogsim.reproduce.night.gallen2014 import Size, reproduce
from fogsim.values import Camera, Response

CAMERA = Camera(240, 160, 220.0, (119.5, 79.5), 1.38, pitch=0.035, response=Response.SRGB)


def test_the_evaluation_runs_small() -> None:
    steps = []
    found = reproduce(CAMERA, Size(2, 4, (25.0, 150.0), 1), watch=lambda done, total: steps.append((done, total)))
    assert steps[-1][0] == steps[-1][1] == 4 + 4 * 2 + 2
    halos, veil, bands, figure, limits = found.all_tables
    assert [row[0] for row in halos.rows[1:]] == ["clear 1", "clear 2", "fog 1", "fog 2", "the paper, right"]
    assert [row[0] for row in veil.rows[1:]] == ["25.0", "150.0"]
    assert len(bands.rows) == 5
    assert float(figure.rows[1][1]) > float(figure.rows[-1][1])
    assert limits.rows[1][-1] == "100 m"
    dense, thin = (record for record in found.records if "fog_class" in record)
    assert (dense["fog_class"], thin["fog_class"]) == (3, 2)
    assert 20.0 < float(dense["night_road_m"]) < 31.0
    assert float(dense["sight_by_low_beams_m"]) < float(thin["sight_by_low_beams_m"])
    assert found.picture.shape[2] == 3
    assert REPRODUCTIONS["gallen2014"]
