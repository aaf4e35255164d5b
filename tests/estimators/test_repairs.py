"""Repairs of the papers' methods: each can be switched off, and matters on some picture; no two methods are one."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.estimators import make
from fogsim.estimators.huang2015_medians import Huang2015Repair
from fogsim.estimators.negru2013 import Negru2013Repair
from fogsim.estimators.zhu2015_road import Zhu2015Repair
from fogsim.scenario import load_scenario
from fogsim.values import LeadMeasurement, Observation, Response

REPAIRS = {"negru2013": Negru2013Repair, "zhu2015": Zhu2015Repair, "huang2015_rough": Huang2015Repair}
READERS_OF_THE_ROAD = (*REPAIRS, "joint_road")


def read(method, frames, camera, lead=None, **options):
    estimator = make(method, camera, **options)
    for image in frames:
        found = estimator.update(Observation(image, lead=lead))
    return found


def said(found):
    return found.valid, found.extinction, found.standard_deviation


@pytest.fixture(scope="module")
def pictures(render, road):
    """Frames, told camera and lead by the repairs that matter on them."""
    gamma = replace(road.camera, response=Response.GAMMA)
    off = replace(road.camera, pitch=road.camera.pitch + np.radians(0.15))
    plain = [render(road.but(visibility=150.0))]
    wooded, horizon = render(road.but(visibility=1e6, terrain=70.0)), int(road.camera.horizon_row)
    wooded[horizon - 45 : horizon] = 20

    def drawn(lead=None, seed=0, **changes):
        ahead = None if lead is None else LeadMeasurement(lead, 0.0)
        return [render(road.but(lead_distance=lead, **changes), seed)], road.camera, ahead

    verge = drawn(visibility=120.0, verge=True)
    thin = drawn(visibility=1000.0)
    return {
        "linear_luminance": ([render(road.but(camera=gamma))], gamma, None),
        "fog_draws_no_edges": drawn(visibility=300.0),
        "subpixel_horizon": ([render(road.but(visibility=200.0, camera=off))], road.camera, None),
        "growth_by_fog": thin,
        "last_row": ([wooded], road.camera, None),
        "own_lane": verge,
        "band_ahead": verge,
        "lead_left_out": drawn(visibility=200.0, lead=25.0),
        "negru2013.lead_left_out": drawn(visibility=200.0, lead=40.0),
        "own_luminance": drawn(visibility=50.0),
        "relative_search": drawn(visibility=30.0, drift=0.15, seed=3),
        "single_frames": ([*plain, render(road.but(visibility=60.0, patch_contrast=0.08), 1)], road.camera, None),
    } | dict.fromkeys(
        ("signs", "subpixel_inflection", "steepest_row", "scaled_rows", "confirmed"), (plain, road.camera, None)
    )


@pytest.mark.parametrize(
    ("method", "repair"), [(method, one) for method, kind in REPAIRS.items() for one in kind], ids=str
)
def test_each_repair_can_be_switched_off_and_matters(pictures, method, repair):
    frames, camera, lead = pictures.get(f"{method}.{repair}", pictures[repair])
    others = [one.value for one in REPAIRS[method] if one is not repair]
    whole = read(method, frames, camera, lead)
    without = read(method, frames, camera, lead, repairs=others)
    assert whole.valid
    assert said(without) != said(whole)


@pytest.mark.parametrize("method", REPAIRS)
def test_all_is_the_default_and_a_list_of_all_is_the_same(render, road, method):
    image = render(road)
    whole = read(method, [image], road.camera)
    for repairs in ("all", [one.value for one in REPAIRS[method]], tuple(REPAIRS[method])):
        assert said(read(method, [image], road.camera, repairs=repairs)) == said(whole)


@pytest.mark.parametrize("method", ["zhu2015", "huang2015_rough"])
def test_as_published_is_without_repairs(render, road, method):
    image = render(road.but(visibility=50.0))
    published = read(method, [image], road.camera, as_published=True)
    assert said(read(method, [image], road.camera, repairs="none")) == said(published)


def test_as_published_negru2013_has_the_signs_set_right_alone(render, road):
    image = render(road.but(visibility=50.0))
    published = read("negru2013", [image], road.camera, as_published=True)
    assert said(read("negru2013", [image], road.camera, repairs=["signs"])) == said(published)
    printed = read("negru2013", [image], road.camera, as_published=True, printed_signs=True)
    assert said(read("negru2013", [image], road.camera, repairs="none")) == said(printed)


@pytest.mark.parametrize("method", REPAIRS)
def test_an_unknown_repair_is_told_with_the_nearest(road, method):
    repairs = ["linear_luminence"]
    with pytest.raises(InputError, match=r"repairs: must be 'all' or .*did you mean 'linear_luminance'"):
        make(method, road.camera, repairs=repairs)
    with pytest.raises(InputError, match=r"estimators.0.parameters.repairs: must be .*did you mean 'linear_luminance'"):
        load_scenario(
            "motorway_fog_bank",
            [f"estimators=[{{method: {method}, parameters: {{repairs: [linear_luminence]}}}}]"],
        )


@pytest.mark.parametrize("method", REPAIRS)
def test_as_published_with_repairs_is_a_contradiction(road, method):
    with pytest.raises(InputError, match="as_published"):
        make(method, road.camera, as_published=True, repairs=["linear_luminance"])


def test_no_two_methods_say_the_same(render, road):
    """What is compared must differ: each reads the road by its own mechanism, and none is the joint fit."""
    for seed, visibility in enumerate((40.0, 90.0, 150.0, 250.0)):
        image = render(road.but(visibility=visibility), seed)
        found = {method: read(method, [image], road.camera) for method in READERS_OF_THE_ROAD}
        assert all(one.valid for one in found.values())
        for one, other in combinations(READERS_OF_THE_ROAD, 2):
            assert found[one].extinction != pytest.approx(found[other].extinction, rel=1e-6), (one, other)
            assert found[one].extinction == pytest.approx(found[other].extinction, rel=0.25), (one, other)
