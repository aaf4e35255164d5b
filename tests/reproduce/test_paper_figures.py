"""Every figure in a "paper" column is one that the paper prints: its text is quoted here with its place."""

import re
from collections.abc import Iterable

import pytest

from fogsim.reproduce import belaroussi2015, negru2013, zhu2015
from fogsim.reproduce.paper_cells import PaperCell

Quotes = dict[str, tuple[str, ...]]
"""Sentences and rows of a paper, by place."""

NEGRU2013: Quotes = {
    "section V": (
        "The synthetic images have a resolution of 688 x 515 pixels and the average processing time on i7 based PC is"
        " of 21 ms.",
        "The resolution of the real time images is of 512 x 383 pixels and the average processing time of our fog"
        " detection algorithm is of 12 ms.",
    ),
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
    ),
}

QUOTES: dict[str, Quotes] = {"negru2013": NEGRU2013, "zhu2015": ZHU2015, "belaroussi2015": BELAROUSSI2015}


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


CELLS = {
    "negru2013": negru2013.paper_cells,
    "zhu2015": zhu2015_cells,
    "belaroussi2015": belaroussi2015_cells,
}
"""Cells of each paper, of records that need no frames."""


def numbers(quotes: Iterable[str]) -> set[float]:
    """Every number of some quotes; commas between digits part thousands."""
    return {float(found.replace(",", "")) for quote in quotes for found in re.findall(r"\d[\d,]*(?:\.\d+)?", quote)}


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
