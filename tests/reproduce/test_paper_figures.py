"""Every figure in a "paper" column is one that the paper prints: its text is quoted here with its place."""

import json
import math
import re
from collections.abc import Iterable

import pytest

from fogsim.calibration.veil_references import PUBLISHED_VISIBILITIES
from fogsim.estimators.night.halos import WINDOW
from fogsim.reproduce import belaroussi2015, huang2015, huang2015_figures, negru2013, zhu2015
from fogsim.reproduce.night import gallen2014
from fogsim.reproduce.result import PaperCell
from fogsim.values import Estimate

Quotes = dict[str, tuple[str, ...]]
"""Sentences and rows of a paper, by place."""

NEGRU2013: Quotes = {
    "section V": (
        "The synthetic images have a resolution of 688 x 515 pixels and the average processing time on i7 based PC is"
        " of 21 ms.",
        "The resolution of the real time images is of 512 x 383 pixels and the average processing time of our fog"
        " detection algorithm is of 12 ms.",
    )
}

ZHU2015: Quotes = {
    "table 2": (
        "晴天 19,031 17,607 92.52%",
        "薄雾 16,354 15,004 91.75%",
        "中雾 10,675 9937 93.09%",
        "浓雾 18,587 17,498 94.15%",
        "仿真结果表明，本文的雾天检测算法对视频样本的正确检测率达到 90% 以上。",
    ),
    "figure 7": ("图 7 给出了本文算法对能见度测量的误差，结果表明，误差距离控制在 (-10 m, 10 m) 之间。",),
}

BELAROUSSI2015: Quotes = {
    "section 5.2": (
        "Now going into accuracy of visibility distance estimation, the maximal error is less than 28 meters.",
        r"with an error of less than 25 meters: $\delta d_{vis} < 25m$. On the set of data with fog density"
        r" $d_{vis}^* = 300m$, the estimation is very close: $d_{vis}^e = 285m$.",
        r"Estimation over a moderate fog is the more accurate with an error $\delta d_{vis} < 18m$. The estimation is"
        r" $d_{vis}^e = 245m$ for $d_{vis}^* = 250m$, and $d_{vis}^e = 218m$ for $d_{vis}^* = 200m$.",
        r"with an error of up to 28 m: $\delta d_{vis} < 28m$. The proposed algorithm overestimate the density of fog"
        r" with an estimation at $d_{vis}^e = 72m$ for $d_{vis}^* = 100m$, and slightly underestimate it with"
        r" $d_{vis}^e = 172m$ for $d_{vis}^* = 150m$.",
    )
}

HUANG2015: Quotes = {
    "table 4.1": (
        "Ground Truth Estimation without Optimization Estimation with Optimization",
        "50m 46m 59m",
        "100m 88m 103m",
        "200m 140m 222m",
        "350m 193m 279m",
        "400m 255m 288m",
        "500m Infinity Infinity",
    ),
    "table 4.2": (
        "Ratio 25m 30m 35m 40m 45m",
        "0m 100 100 100 100 100",
        "5m 84.9044 92.1565 77.1763 92.0751",
        "10m 78.2449 71.1230 71.0602",
        "15m 60.3865 65.4866",
        "20m 55.6010",
    ),
    "table 4.3": (
        "Ground Truth New Approach of Estimation Old Approach of Estimation",
        "50m 60m 59m",
        "100m 95m 103m",
        "200m 180m 222m",
        "350m 340m 279m",
        "400m 380m 288m",
        "500m 480m Infinity",
    ),
    "table 5.1": (
        "Tracking Distance of Ground Truth Visible Range 100m 200m 300m 400m 500m",
        "10 % 106 247 417 INF INF",
        "20 % 99 205 402 895 INF",
        "30 % 103 189 364 691 714",
        "40 % 95 205 342 459 512",
        "50 % 91 201 298 388 523",
        "60 % 94 392",
    ),
    "table 5.2": (
        "Distance Difference 50m 100m 200m 400m",
        "1.25m 61 94.9 202",
        "2.50m 59 93 186",
        "3.75m 58 94 178",
        "5.00m 61 96 200 409",
        "7.50m 57 91 181",
        "10.00m 59 95 180 376",
        "15.00m 62 93 181",
        "20.00m 55 94 188 409",
        "30.00m 95",
        "40.00m 402",
    ),
    "table 5.3": (
        "Position of Reference Image 100m 200m 300m 400m 500m",
        "25m 97 200 298 388 512",
        "30m 95 198 296 380 484",
        "35m 95 203 281 362 479",
        "40m 91 203 290 373 429",
        "50m 97 203 267 344 434",
        "60m 102 228 316 349 437",
        "70m 112 310 323 373 470",
    ),
}
"""The tables of the thesis, in order; INF and Infinity are infinite."""

GALLEN2014: Quotes = {
    "table I": ("1 - light fog > 300", "2 - fog 100 to 300", "3 - dense fog <100"),
    "equation 11": ("we are able to compute the corresponding Vmet threshold as Vhigh|fog = Vlow|fog ≈ 100 m.",),
    "equation 12": ("we are able to compute the corresponding Vmet threshold as Vhigh|fog = Vlow|nofog ≈ 300 m.",),
    "section III-B": ("The optimal threshold on Br50 in our database was estimated to be 9.",),
    "section IV-A": ("using a video of resolution 1280×800 at 10 frames/s",),
    "section IV-B": (
        "the proposed algorithm produced a fog detection rate of 98.4%.",
        "on 1 s of video (25 images), the fog detection rate reached 99.86%.",
        "A high correlation score (greater than 0.6) is obtained when the measured and reference images correspond to"
        " dense fog (see Table I). In the presence of fog, this score becomes smaller (around 0.4). In the presence of"
        " light fog, it becomes very small (less than 0.2).",
    ),
    "figure 12": (
        "the six simulated reference images (15, 50, 100, 200, 500 m, and ∞).",
        "The highest correlation score corresponds to the reference image having a visibility of 500 m, which is quite"
        " consistent with the output of the dedicated LIDAR of 368 m.",
    ),
    "section IV-C": (
        "the following measured visibility distances: 12.6, 51.4, 91.8, 167.8, 415.6, and 2000 m.",
        "about 10 m of accuracy when Vmet < 50 m; about 20 m of accuracy when Vmet < 100 m; about 40 m of accuracy when"
        " Vmet < 200 m; Less than 100 m of accuracy when Vmet > 200 m.",
    ),
}

QUOTES: dict[str, Quotes] = {
    "huang2015": HUANG2015,
    "negru2013": NEGRU2013,
    "zhu2015": ZHU2015,
    "belaroussi2015": BELAROUSSI2015,
    "gallen2014": GALLEN2014,
}


def zhu2015_cells() -> Iterable[PaperCell]:
    forms = {f"{name}_visibility_m": 1.0 for name in zhu2015.VARIANTS} | {
        f"{name}_state": None for name in zhu2015.VARIANTS
    }
    records = [
        {"weather": one.name, "category": one.category.value, "visibility_m": one.low, **forms}
        for one in zhu2015.WEATHERS
    ]
    return zhu2015.paper_cells(records)


def belaroussi2015_cells() -> Iterable[PaperCell]:
    records = [
        {"camera": "1400 px", "visibility_m": fog, "ours_m": fog, "cubic_m": None} for fog in belaroussi2015.PUBLISHED
    ]
    return belaroussi2015.paper_cells("1400 px", records)


def huang2015_cells() -> Iterable[PaperCell]:
    figures = huang2015_figures.figures(huang2015_figures.TABLES)
    nothing = Estimate.invalid("huang2015", "not run")
    variants = dict.fromkeys(huang2015_figures.VARIANTS, nothing)
    after = {figure.after: nothing for figure in figures}
    results = {figure.case: dict.fromkeys(variants, after) for figure in figures if figure.case}
    return huang2015_figures.cells(figures, results, dict.fromkeys(huang2015.TABLE_4_1, variants))


def gallen2014_cells() -> Iterable[PaperCell]:
    counts = dict.fromkeys(("published_each", "published_of_25", "largest_each", "largest_of_25"), 1)
    drives = [{"visibility_m": 80.0, "with_halos": 1, **counts}]
    scores = {f"score_{one:g}": 0.5 for one in gallen2014.REFERENCES}
    fogs = [{"visibility_m": fog, "as_published_m": fog, "corrected_m": None, **scores} for fog in (20.0, 150.0, 500.0)]
    road = {f"{form}_score_{one:g}": 0.5 for form in ("as_published", "corrected") for one in PUBLISHED_VISIBILITIES}
    yield from gallen2014.drive_cells(drives, 9.0)
    yield from gallen2014.fog_cells([*fogs, {**fogs[0], "visibility_m": 70.0}])
    yield gallen2014.road_cell(road)
    yield from gallen2014.limit_cells()


CELLS = {
    "huang2015": huang2015_cells,
    "negru2013": negru2013.paper_cells,
    "zhu2015": zhu2015_cells,
    "belaroussi2015": belaroussi2015_cells,
    "gallen2014": gallen2014_cells,
}
"""Cells of each paper, of records that need no frames."""


def numbers(quotes: Iterable[str]) -> set[float]:
    """Every number of some quotes; commas between digits part thousands."""
    pattern = r"\d[\d,]*(?:\.\d+)?|\bINF(?:INITY)?\b"
    return {float(found.replace(",", "")) for quote in quotes for found in re.findall(pattern, quote, re.IGNORECASE)}


@pytest.mark.parametrize("paper", CELLS)
def test_every_figure_of_a_paper_column_stands_in_the_text_of_its_place(paper: str) -> None:
    cells = tuple(CELLS[paper]())
    assert cells
    for cell in cells:
        assert cell.paper in numbers(QUOTES[paper][cell.place]), cell


def test_every_estimate_and_limit_of_belaroussi2015_is_compared() -> None:
    # Section 5.2's other numbers are true visibilities.
    left = numbers(BELAROUSSI2015["section 5.2"]) - {cell.paper for cell in belaroussi2015_cells()}
    assert left == {100.0, 150.0, 200.0, 250.0, 300.0}


def test_every_share_of_zhu2015_is_compared() -> None:
    shares = {float(row.split()[-1].rstrip("%")) for row in ZHU2015["table 2"][:4]}
    assert shares == {cell.paper for cell in zhu2015_cells() if cell.place == "table 2"} - {90.0}


def test_every_figure_of_huang2015_is_compared_in_the_order_of_the_thesis() -> None:
    for place, (_, *rows) in HUANG2015.items():
        found = [cell.paper for cell in huang2015_cells() if cell.place == place]
        texts = [row.replace("%", "").split() for row in rows]
        printed = [float(text.removesuffix("m").removesuffix("inity").lower()) for row in texts for text in row[1:]]
        if place == "table 4.2":
            # Its first row is each picture over itself.
            printed = [figure for figure in printed if figure != 100.0]
        assert found == printed, place


def test_gallen2014_is_run_with_the_figures_of_its_paper() -> None:
    assert set(gallen2014.REFERENCES) < numbers(GALLEN2014["section IV-C"])
    assert {gallen2014.LIDAR, *PUBLISHED_VISIBILITIES[:-1]} == numbers(GALLEN2014["figure 12"])
    assert {gallen2014.CAMERA.width, gallen2014.CAMERA.height} < numbers(GALLEN2014["section IV-A"])
    assert WINDOW in numbers(GALLEN2014["section IV-B"])


def test_a_figure_is_reached_or_bold() -> None:
    for ours, options, reached in [
        (78.0, {}, True),
        (80.0, {}, False),
        (None, {}, False),
        (math.inf, {}, False),
        (107.0, {"truth": 100.0}, True),
        (129.0, {"truth": 100.0}, False),
        (math.inf, {"truth": 100.0}, False),
        (72.1, {"claim": "at_most"}, False),
        (71.0, {"claim": "at_most"}, True),
        (71.0, {"claim": "at_least"}, False),
        (74.0, {"tolerance": 1.5, "absolute": True}, False),
    ]:
        cell = PaperCell("table 1", "row", "column [m]", 72.0, 107.0, ours, **options)
        # As published, only agreement counts: it should have the paper's errors.
        assert cell.reached == (cell.claim == "at_least", reached)
        assert cell.shown()[4].startswith("**") is not cell.reached[0]
        assert cell.shown()[5].startswith("**") is not reached
        assert json.dumps(cell.record(), allow_nan=False)
