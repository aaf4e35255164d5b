"""Figures of the papers that reproductions compare with: each stands in a sentence of the paper."""

import re

from fogsim.calibration.veil_references import PUBLISHED_VISIBILITIES
from fogsim.estimators.night.gallen2014 import DENSE, LIGHT
from fogsim.estimators.night.gallen2014_veil import BANDS
from fogsim.estimators.night.halos import PUBLISHED, WINDOW
from fogsim.reproduce.night.gallen2014 import CAMERA, LIDAR, REFERENCES

GALLEN2014 = {
    "table I": ("1 - light fog > 300", "2 - fog 100 to 300", "3 - dense fog <100"),
    "equation 11": ("≈ 100 m",),
    "equation 12": ("≈ 300 m",),
    "section III-B": ("The optimal threshold on Br50 in our database was estimated to be 9.",),
    "section IV-A": ("using a video of resolution 1280×800 at 10 frames/s",),
    "section IV-B": (
        "the proposed algorithm produced a fog detection rate of 98.4%",
        "on 1 s of video (25 images), the fog detection rate reached 99.86%",
        "A high correlation score (greater than 0.6) is obtained when the measured and reference images correspond to"
        " dense fog",
        "In the presence of fog, this score becomes smaller (around 0.4).",
        "In the presence of light fog, it becomes very small (less than 0.2).",
        "the reference image having a visibility of 500 m",
        "the output of the dedicated LIDAR of 368 m",
    ),
    "figure 12": ("the six simulated reference images (15, 50, 100, 200, 500 m, and ∞)",),
    "section IV-C": (
        "the following measured visibility distances: 12.6, 51.4, 91.8, 167.8, 415.6, and 2000 m",
        "about 10 m of accuracy when Vmet < 50 m",
        "about 20 m of accuracy when Vmet < 100 m",
        "about 40 m of accuracy when Vmet < 200 m",
        "Less than 100 m of accuracy when Vmet > 200 m",
    ),
}
"""Sentences of Gallen et al. (2014) by their place."""


def numbers_of(sentences: dict[str, tuple[str, ...]]) -> set[float]:
    """All numbers in the sentences, infinity among them."""
    text = " ".join(part for parts in sentences.values() for part in parts)
    return {float(one.replace("∞", "inf")) for one in re.findall(r"\d+(?:\.\d+)?|∞", text)}


def test_gallen2014_has_the_figures_of_its_paper() -> None:
    used = {DENSE, LIGHT, PUBLISHED, WINDOW, LIDAR, CAMERA.width, CAMERA.height, *REFERENCES, *PUBLISHED_VISIBILITIES}
    used |= {one for band in BANDS for one in band}
    assert used - numbers_of(GALLEN2014) == set()
