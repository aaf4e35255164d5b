"""A person's own map of signs and track: what is read, what is refused, and what images show."""

import json
import math
import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from fogsim.errors import InputError
from fogsim.offline import ImageFiles, SignWatch, estimate_images, record_lines, summary_rows, watch_signs
from fogsim.offline.drive.sign_watch import USUAL_DIAMETER, USUAL_HEIGHT, load_sign_file
from fogsim.offline.drive.track_file import load_track, metres_per_radian
from fogsim.offline.overlay import Overlay
from fogsim.offline.video_source import VideoFile
from fogsim.recorders.sign_marks import NET, write_sign_map
from fogsim.recorders.style import ADVICE, MUTED
from fogsim.values import Camera, Sign, SignMap

CAMERA = Camera(320, 240, 800.0, (159.5, 119.5), 1.3, pitch=0.01)
LONGITUDE, LATITUDE = 24.9, 60.2
SPEED, HEADING = 10.0, math.radians(30.0)
"""Of the drive [m/s], and clockwise from north [rad]."""
IMAGES = 6
"""A second apart."""


def degrees(x: float, y: float) -> tuple[float, float]:
    """Longitude and latitude [deg] of a place x m east and y m north of the start."""
    east, north = metres_per_radian(math.radians(LATITUDE))
    return LONGITUDE + math.degrees(x / east), LATITUDE + math.degrees(y / north)


def ahead(distance: float, left: float) -> tuple[float, float]:
    """Longitude and latitude [deg] of what lies ahead of the drive's start [m]."""
    return degrees(
        distance * math.sin(HEADING) - left * math.cos(HEADING), distance * math.cos(HEADING) + left * math.sin(HEADING)
    )


def feature(place: tuple[float, float], **properties: object) -> dict[str, Any]:
    told = {"kind": "stop", "height_m": 2.4, "diameter_m": 0.9, "heading_deg": 30.0, **properties}
    return {"type": "Feature", "geometry": {"type": "Point", "coordinates": list(place)}, "properties": told}


def geojson(path: Path, *features: object, **members: object) -> Path:
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features, **members}), encoding="utf-8")
    return path


def csv_track(path: Path, times: range = range(IMAGES + 1), heading: str = "") -> Path:
    rows = [",".join(map(repr, (float(time), *ahead(SPEED * time, 0.0)))) for time in times]
    rows = [f"{row},{heading}" if heading else row for row in rows]
    path.write_text("\n".join(["time_s,longitude,latitude" + (",heading_deg" if heading else ""), *rows]), "utf-8")
    return path


def gpx_track(path: Path) -> Path:
    places = [(time, ahead(SPEED * time, 0.0)) for time in range(IMAGES + 1)]
    points = [
        f'<trkpt lat="{place[1]!r}" lon="{place[0]!r}"><time>2026-05-04T07:08:{time:02d}Z</time></trkpt>'
        for time, place in places
    ]
    head = '<gpx version="1.1" xmlns="http://www.topografix.com/GPX/1/1"><trk><trkseg>'
    path.write_text(f"{head}{''.join(points)}</trkseg></trk></gpx>", encoding="utf-8")
    return path


def image(distance: float, *, standing: bool = True) -> NDArray[np.uint8]:
    """A disc 4 m to the right and 2.4 m above the road, in even grey with a little noise."""
    noise = np.random.default_rng(5).normal(0.0, 1.0, (240, 320, 3))
    pixels = np.full((240, 320, 3), 170.0)
    scale = 800.0 / (distance * math.cos(0.01) - 1.1 * math.sin(0.01))
    middle = (159.5 + 4.0 * scale, 119.5 - scale * (distance * math.sin(0.01) + 1.1 * math.cos(0.01)))
    if standing:
        centre = tuple(round(16 * side) for side in middle)
        cv2.circle(pixels, centre, round(16 * 0.45 * scale), (90.0, 40.0, 40.0), -1, cv2.LINE_8, 4)
    return np.clip(pixels + noise, 0, 255).round().astype(np.uint8)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    geojson(tmp_path / "map.geojson", {**feature(ahead(80.0, -4.0)), "id": "a"})
    csv_track(tmp_path / "track.csv")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def watch(signs: str = "map.geojson", track: str = "track.csv", offset: float = 0.0) -> SignWatch:
    source = ImageFiles(tuple(Path(f"{index}.png") for index in range(IMAGES)), True, 1.0)
    return watch_signs(signs, track, source, CAMERA, offset)[0]


def test_metres_of_a_degree() -> None:
    # The usual table of WGS 84 at 45°: 111.132 km and 78.847 km; at the equator 111.320 km of longitude.
    east, north = (math.radians(1.0) * metres for metres in metres_per_radian(math.radians(45.0)))
    assert (east, north) == (pytest.approx(78_847, abs=1), pytest.approx(111_132, abs=1))
    assert math.radians(1.0) * metres_per_radian(0.0)[0] == pytest.approx(111_320, abs=1)


def test_signs_are_found_where_map_and_track_have_them(folder: Path) -> None:
    for index in range(IMAGES):
        Image.fromarray(image(80.0 - SPEED * index)).save(folder / f"{index}.png", compress_level=0)
    results = list(
        estimate_images(
            folder, CAMERA, "negru2013", sequence=True, rate=1.0, signs=Path("map.geojson"), track=Path("track.csv")
        )
    )
    for index, result in enumerate(results):
        (look,) = result.signs
        assert look.detected
        assert look.distance == pytest.approx(math.hypot(80.0 - SPEED * index, 4.0, 1.1), abs=0.1)
        assert look.first_seen == (None if index == 0 else pytest.approx(80.1, abs=0.1))
    record = json.loads(list(record_lines(results[1]))[-1])
    assert record["frame"].endswith("1.png")
    assert record["signs"][0]["sign_id"] == "a"
    assert record["signs"][0]["first_seen_m"] == pytest.approx(80.1, abs=0.1)
    drawn = np.asarray(Overlay(CAMERA, ["negru2013"]).draw(results[1]))
    middle = np.argwhere((drawn == ADVICE).all(axis=2)).mean(axis=0)
    look = results[1].signs[0]
    assert abs(middle[1] - 2 * look.u) < 20
    assert abs(middle[0] - 2 * look.v) < 30
    assert not (drawn[:480] == MUTED).all(axis=2).any()


def test_images_of_16_bits_show_signs_as_those_of_8_do(folder: Path) -> None:
    looks = []
    for pixels in (image(80.0), image(80.0).astype(np.uint16) * 257):
        watching = watch()
        looks.append(watching.look(pixels, 0.0, watching.sightings(0.0) or ()))
    assert looks[0][0].detected
    assert looks[0] == looks[1]


def test_gpx_and_csv_with_headings_tell_the_same(folder: Path) -> None:
    tracks = [load_track(one) for one in (csv_track(folder / "a.csv", heading="30"), gpx_track(folder / "b.gpx"))]
    for track in tracks:
        pose = track.pose_at(2.5)
        assert pose.heading == pytest.approx(math.radians(60.0), abs=1e-5)
        assert math.degrees(pose.longitude) == pytest.approx(ahead(25.0, 0.0)[0], abs=1e-7)
        assert track.pose_at(-0.1) is None
        assert track.pose_at(6.1) is None
    assert load_track(csv_track(folder / "gap.csv", range(0, 20, 10))).pose_at(3.0) is None


def test_a_missing_heading_leaves_the_others(folder: Path) -> None:
    rows = csv_track(folder / "turned.csv", heading="40").read_text("utf-8").splitlines()
    rows[1] = rows[1].removesuffix("40")
    (folder / "turned.csv").write_text("\n".join(rows), "utf-8")
    heading = load_track(folder / "turned.csv").heading
    assert np.degrees(heading) == pytest.approx([60.0] + [50.0] * IMAGES, abs=1e-3)


def test_times_without_a_zone_are_no_clock_times_of_this_computer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (track := tmp_path / "track.csv").write_text(
        "time,lat,lon,heading_deg\n2026-03-29T02:59:59,48,11,0\n2026-03-29T03:00:00,48,11,0\n", "utf-8"
    )
    monkeypatch.setenv("TZ", "Europe/Berlin")
    time.tzset()
    try:
        assert load_track(track).time.tolist() == [0.0, 1.0]
    finally:
        monkeypatch.undo()
        time.tzset()


def test_rows_before_a_receiver_has_its_position_are_passed_over(folder: Path) -> None:
    rows = csv_track(folder / "late.csv").read_text("utf-8").splitlines()
    rows[1:3] = ["0.0,0,0", "1.0,0.000000,-0.0"]
    (folder / "late.csv").write_text("\n".join(rows), "utf-8")
    track = load_track(folder / "late.csv")
    assert track.pose_at(1.0) is None
    assert track.way_at(4.0) == pytest.approx(2.0 * SPEED, rel=1e-4)


def test_a_heading_column_of_another_name_is_refused(folder: Path) -> None:
    path = csv_track(folder / "course.csv", heading="30")
    path.write_text(path.read_text("utf-8").replace("heading_deg", "Course"), "utf-8")
    with pytest.raises(InputError, match=r"expected headings in a column heading_deg, .* got 'Course'; rename it"):
        load_track(path)


def test_summary_and_remarks_of_what_came_of_it(folder: Path) -> None:
    found, missed = watch(), watch()
    for index in range(IMAGES):
        distance = 80.0 - SPEED * index
        for one, standing in ((found, True), (missed, False)):
            sightings = one.sightings(float(index))
            one.look(image(distance, standing=standing), float(index), sightings)
    (sign,) = found.summary()
    assert (sign.sign_id, sign.detections, sign.misses) == ("a", IMAGES, 0)
    assert list(found.remarks()) == []
    assert [row.split()[-4:] for row in summary_rows(found.summary())][1] == ["80", "m", "6", "0"]
    assert ["none of the 1 signs" in remark for remark in missed.remarks()] == [True]
    assert "not seen" in list(summary_rows(missed.summary()))[1]


def test_images_outside_the_track_and_signs_of_the_other_direction_are_told(folder: Path) -> None:
    late = watch(offset=4.0)
    told = [late.sightings(float(index)) is None for index in range(IMAGES)]
    assert told == [False, False, False, True, True, True]
    assert "3 of 6 images are not covered by the track, which has -4.0 … 2.0 s" in next(late.remarks())
    geojson(folder / "back.geojson", feature(ahead(80.0, -4.0), heading_deg=210.0))
    back = watch("back.geojson")
    assert back.sightings(0.0) == ()
    assert "do they face the other way" in next(back.remarks())
    with pytest.raises(InputError, match=r"covers -60\.0 … -54\.0 s from the first image, and the images 0 … 5\.0 s"):
        watch(offset=60.0)
    # A video that does not state its length may last until the track begins.
    watch_signs("map.geojson", "track.csv", VideoFile(Path("raw.h264"), True, (320, 240), 0.1, 0.0), CAMERA, -20.0)


def test_a_sign_behind_the_camera_is_none_that_is_looked_for(folder: Path) -> None:
    geojson(folder / "two.geojson", feature(ahead(-3.0, -4.0)), feature(ahead(80.0, -4.0)))
    sightings = watch("two.geojson").sightings(0.0)
    assert [sign.sign_id for sign in sightings] == ["1"]


def test_what_the_map_does_not_tell_is_assumed_and_said(folder: Path) -> None:
    path = geojson(
        folder / "bare.geojson",
        feature(ahead(80.0, -4.0), height_m=None, diameter_m=None, heading_deg=None, kind="parking"),
        {"type": "Feature", "geometry": {"type": "LineString", "coordinates": []}, "properties": {}},
    )
    signs = load_sign_file(path)
    assert (signs.signs[0].height, signs.signs[0].diameter) == (USUAL_HEIGHT, USUAL_DIAMETER)
    assert len(signs.remarks) == 5
    assert "1 sign with no height_m: 2.2 m above the road are assumed" in signs.remarks[0]
    assert "unknown kinds, searched as signs of any kind: parking" in signs.remarks[3]
    sightings = watch("bare.geojson").sightings(0.0)
    assert abs(sightings[0].facing) < 1e-6


def test_a_map_that_fogsim_wrote_can_be_read(folder: Path) -> None:
    signs = SignMap((Sign("a", "speed_limit", 25.0, (0.0, 0.0, 2.0), 0.5 * math.pi, 0.9),))
    write_sign_map(folder / "own.geojson", signs, "own", degrees)
    (sign,) = load_sign_file(folder / "own.geojson").signs
    assert (sign.sign_id, sign.kind, sign.value) == ("a", "speed_limit", pytest.approx(25.0))
    assert sign.heading == pytest.approx(0.5 * math.pi)
    write_sign_map(folder / "net.geojson", signs, "net")
    with pytest.raises(InputError, match="x and y of a SUMO network"):
        load_sign_file(folder / "net.geojson")


POINT = feature((24.9, 60.2))


def test_maps_that_are_refused(tmp_path: Path) -> None:
    for features, members, told in [
        ([], {}, "the map has no signs"),
        ([{**POINT, "id": "a"}, {**POINT, "id": "a"}], {}, "two signs have the id 'a'"),
        ([feature((24.9, 60.2), kind=None)], {}, 'feature 0: a sign needs a property "kind"'),
        ([feature((385_000.0, 6_672_000.0))], {}, "another coordinate frame"),
        ([feature((24.9, 60.2), diameter_m="big")], {}, r"diameter_m must be a number within 0\.1 … 10, got 'big'"),
        ([feature((24.9, "north"))], {}, "latitude must be a number within .*, got 'north'"),
        ([POINT], {"crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::3067"}}}, "is in .urn.*3067"),
        ([POINT], {"coordinates": NET}, "x and y of a SUMO network"),
        ([POINT], {"features": None, "type": "Point"}, "expected a GeoJSON FeatureCollection .*got type 'Point'"),
    ]:
        with pytest.raises(InputError, match=told):
            load_sign_file(geojson(tmp_path / "map.geojson", *features, **members))


@pytest.mark.parametrize(("text", "told"), [("", ":1: not valid JSON"), ("[]", "got list"), (None, "cannot be read")])
def test_files_that_are_no_map(tmp_path: Path, text: str | None, told: str) -> None:
    if text is not None:
        (tmp_path / "map.geojson").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=told):
        load_sign_file(tmp_path / "map.geojson")


def test_tracks_that_are_refused(tmp_path: Path) -> None:
    for name, text, told in [
        ("a.csv", None, "cannot be read"),
        ("a.txt", "", r"ends in \.gpx or \.csv"),
        ("a.csv", "time_s,lat\n", "expected a column longitude or lon, got time_s, lat"),
        ("a.csv", "time_s,lat,lon\n0,1,2\n", "expected two positions"),
        ("a.csv", "time_s,lat,lon\n0,1,2\n1,x,2\n", "line 3: latitude must be a number within .*, got 'x'"),
        ("a.csv", "time_s,lat,lon\n0,48,1,11,5\n", "line 2: more cells than columns"),
        ("a.csv", "time_s,lat,lon,lat\n0,48,11,49\n", "two columns are named 'lat'"),
        ("a.csv", "time,lat,lon\nnoon,1,2\n", "expected a time as 2026"),
        ("a.csv", "time_s,lat,lon\n0,91,2\n", "within ±90°"),
        ("a.csv", "time_s,lat,lon\n0,1,2\n2,1,2\n1,1,2\n", "time goes back after position 2 of 3"),
        ("a.csv", "time_s,lat,lon\n0,1,2\n1,1,2\n", "never moves"),
        ("a.gpx", "<gpx", ":1: not XML"),
        ("a.gpx", '<gpx><trk><trkseg><trkpt lat="1" lon="2"/></trkseg></trk></gpx>', "point 0 has no <time>"),
    ]:
        if text is not None:
            (tmp_path / name).write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=told):
            load_track(tmp_path / name)


@pytest.mark.parametrize(
    ("place", "told"),
    [
        (ahead(0.0, 0.0)[::-1], "swapped in the map"),
        ((0.0, 0.0), "6.* km away: map and track are in different coordinate frames"),
        (degrees(3000.0, 0.0), r"the nearest is 29\d\d m away"),
    ],
)
def test_a_map_of_elsewhere_is_refused(folder: Path, place: tuple[float, float], told: str) -> None:
    geojson(folder / "else.geojson", feature(place))
    with pytest.raises(InputError, match=told):
        watch("else.geojson")


def test_uses_that_are_refused(folder: Path) -> None:
    for asked, told in [
        (lambda source: watch_signs(Path("map.geojson"), Path("track.csv"), source, CAMERA), "these images are stills"),
        (lambda _: watch(offset=math.inf), "--track-offset must be a number"),
        (lambda _: estimate_images("0.png", CAMERA, signs=Path("map.geojson")), "signs and track go together"),
    ]:
        with pytest.raises(InputError, match=told):
            asked(ImageFiles((Path("0.png"), Path("1.png")), False, 1.0))
