import base64
import io
import itertools
import math
import re
from html.parser import HTMLParser
from pathlib import Path

from PIL import Image

from fogsim.metrics import RunMetrics, step_metrics
from fogsim.recorders import ReportRecorder, RunDirectory, RunInformation, versions
from fogsim.recorders.report import key_numbers, shown_metric
from fogsim.recorders.report_figures import MOST_PICTURES, Album, DecisiveFrames
from fogsim.values import Leader, Step
from tests.recorders.synthetic import METHODS, drive, make_step


class Page(HTMLParser):
    """Tags, attributes and text of a page; it must be well-formed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.images: list[str] = []
        self.tags: set[str] = set()
        self.links: list[str] = []
        self.text = ""
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        if tag not in {"meta", "img", "br"}:
            self.open.append(tag)
        for name, value in attrs:
            if name == "src":
                self.images.append(value or "")
            elif name in {"href", "action", "data"}:
                self.links.append(value or "")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def report(path: Path, steps: list[Step], *, complete: bool = True, title: str = "Bank", description: str = "") -> str:
    """Text of the report of a run; without figures, which take longest, if it is not complete."""
    metrics = RunMetrics()
    summary = metrics.summary
    with RunDirectory(path) as directory:
        directory.begin({})
        information = RunInformation(
            directory, title, description, 11, METHODS, 0.2, lambda: summary().to_json(), summary().meanings
        )
        recorder = ReportRecorder(information)
        for step in steps:
            metrics.update(step)
            recorder.record(step, step_metrics(step))
        recorder.close(complete)
        directory.finish({})
        assert directory.files() == ["manifest.json", "report.html"]
    return (path / "report.html").read_text(encoding="utf-8")


def test_a_report_is_whole_and_loads_nothing(tmp_path: Path) -> None:
    text = report(tmp_path, list(drive(50)), title='<script>alert("1")</script>', description="a < b & c")
    page = Page(text)
    assert "PARTIAL" not in text
    assert "script" not in page.tags
    assert "link" not in page.tags
    assert page.links == []
    assert re.search(r"https?://|url\(|@import", text) is None
    places = [text.index(part) for part in ('class="numbers"', "Timeline", "Decisive frames", "All metrics")]
    assert places == sorted(places)
    decisive = text[places[2] : text.index("What the camera saw")].count("<figure")
    assert decisive >= 1
    assert len(page.images) == 4 + decisive + MOST_PICTURES
    for number, source in enumerate(page.images):
        kind, data = source.split(",", 1)
        assert kind == f"data:image/{'png' if number < 4 else 'jpeg'};base64"
        assert Image.open(io.BytesIO(base64.b64decode(data, validate=True))).width > 100

    for shown in ("minimum time to collision", "km/h)", *METHODS, "seed 11", f"numpy {versions()['numpy']}"):
        assert shown in page.text
    for of_the_user in ('<script>alert("1")</script>', "a < b & c"):
        assert of_the_user in page.text


def test_it_opens_with_the_numbers_that_answer_a_run_in_fog() -> None:
    metrics = {"ego_collisions": 0, "minimum_time_to_collision_s": 2.5, "minimum_moving_time_to_collision_s": 42.2}
    metrics |= {"traffic_minimum_time_to_collision_s": 1.0, "belief_coverage_share": 0.9}
    shown = [(shown_metric(key, metrics[key]), words) for key, words in key_numbers(metrics)]
    assert shown == [
        ("0", "collisions of the ego"),
        ("2.5 s", "least time to collision of the ego"),
        ("90 %", "of its 90 % intervals hold the truth"),
    ]


def test_decisive_frames_are_those_of_the_extremes_in_order_of_time() -> None:
    steps = [
        make_step(0, time=0.0, visibility_ahead=900.0),
        make_step(1, time=1.0, visibility_ahead=150.0),
        make_step(2, time=2.0, visibility_ahead=100.0, acceleration=-4.0),
        make_step(3, time=3.0, visibility_ahead=90.0, acceleration=-2.0),
    ]
    frames = DecisiveFrames()
    for step, left in zip(steps, (9.0, 5.0, None, 3.0), strict=True):
        frames.add(step, {"time_to_collision_s": left})
    said = [(caption.partition(":")[0], one.time) for caption, one in frames.in_order()]
    assert said == [
        ("First frame with less than 200 m of visibility ahead", 1.0),
        ("Hardest braking", 2.0),
        ("Least time to collision", 3.0),
    ]


def test_a_leader_that_is_touched_is_no_minus_0_m_ahead() -> None:
    frames = DecisiveFrames()
    frames.add(make_step(0, leader=Leader("lead", gap=-0.3, speed=0.0)), {"time_to_collision_s": 0.0})
    assert frames.in_order()[0][0].endswith(", 0 m behind the leader")


def test_pictures_say_where_and_what_was_true_and_believed(tmp_path: Path) -> None:
    step = make_step(3, time=12.0, route_position=1500.0, visibility_ahead=80.0)
    text = Page(report(tmp_path, [step], complete=False)).text
    assert "t = 12.0 s at 1.50 km. Visibility ahead: true 80 m, believed 100 m" in text


def test_an_interrupted_run_says_when(tmp_path: Path) -> None:
    text = report(tmp_path, list(itertools.islice(drive(), 10)), complete=False)
    assert "PARTIAL: interrupted at t = 2.0 s" in Page(text).text
    assert "Figures are of whole runs" in Page(text).text  # drawing them takes longer than somebody waits


def test_a_run_without_steps_is_still_a_page(tmp_path: Path) -> None:
    page = Page(report(tmp_path, [], complete=False))
    assert "No step was recorded" in page.text
    assert "PARTIAL" in page.text


def test_clear_air_without_leader_can_be_drawn(tmp_path: Path) -> None:
    steps = [make_step(i, time=0.1 * i, visibility=math.inf) for i in range(5)]
    assert "true clear" in Page(report(tmp_path, steps)).text


def test_pictures_are_spread_evenly_from_the_first_to_the_last_step() -> None:
    for count in [1, 5, MOST_PICTURES, 17, 1000]:
        album = Album()
        for index in range(count):
            album.add(make_step(index, time=float(index)))
        times = [picture.time for picture in album.chosen()]
        assert len(times) == min(count, MOST_PICTURES)
        assert times[0] == 0.0
        assert times[-1] == count - 1
        gaps = [later - earlier for earlier, later in itertools.pairwise(times)]
        assert all(gap > 0 for gap in gaps)
        if count == 1000:
            assert max(gaps) < 3 * min(gaps)
