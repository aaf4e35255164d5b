"""The own bonnet: where it is by its geometry, what it mirrors, and what it leaves as it is."""

import math
from itertools import islice

import numpy as np
import pytest

import fogsim
from fogsim.estimators import make
from fogsim.render.bonnet import REFLECTANCE, Bonnet, with_bonnet
from fogsim.values import Camera, View
from fogsim.values.scene import Instance

CAMERA = Camera(320, 240, 260.0, (159.5, 100.0), 1.38, math.radians(2.0))
BONNET = Bonnet(1.6)
LABEL = 21


def drawn(camera: Camera = CAMERA, illuminance: float = 1000.0, bonnet: Bonnet = BONNET) -> View:
    size = (camera.height, camera.width)
    lit = np.full((*size, 3), 0.01, np.float32)
    view = View(np.full((*size, 3), 50.0, np.float32), np.full(size, 30.0, np.float32), np.zeros(size, np.int32), lit)
    return with_bonnet(view, camera, bonnet, LABEL, illuminance)


def test_its_edge_is_where_the_camera_projects_it() -> None:
    found = drawn().instance == LABEL
    # Below the optical axis by the angle to the edge less the camera's pitch.
    edge = 100.0 + 260.0 * math.tan(math.atan2(1.38 - 0.75, 1.6) - math.radians(2.0))
    middle = np.flatnonzero(found[:, 160])
    assert middle[0] == pytest.approx(edge, abs=1.0)
    assert middle[-1] == 239
    # It is widest at the bottom, and its corners are rounded.
    widths = found.sum(axis=1)[middle[0] : 239]
    assert np.all(np.diff(widths) >= 0)
    assert widths[0] < 0.5 * widths[20]


def test_it_is_lit_by_the_sky_hides_what_is_behind_and_own_lamps_do_not_reach_it() -> None:
    view, plain = drawn(), drawn(bonnet=Bonnet(0.1))
    there = view.instance == LABEL
    assert np.array_equal(view.radiance[~there], plain.radiance[~there])
    assert view.distance[there].max() < 1.8
    assert view.lamp_response is not None
    assert view.lamp_response[there].max() == 0.0
    light = view.radiance[there, 0] * math.pi / 1000.0
    assert light.min() > REFLECTANCE + 0.04
    assert light.max() < 0.5
    # At the front edge it is seen at a more grazing angle than near by, so it mirrors more.
    column = view.radiance[:, 160, 0][there[:, 160]]
    assert column[0] > column[-1]
    assert drawn(illuminance=0.0).radiance[there].max() == 0.0


def test_a_drive_has_it_if_asked_and_methods_of_the_road_do_not_mind() -> None:
    told = {}
    for bonnet in (False, True):
        settings = ["camera.width=320", "camera.height=240", f"camera.bonnet={str(bonnet).lower()}", "duration_s=1"]
        settings += ["sensors.faults=[]", "vary={}", "expect={}", "estimators=[negru2013]"]
        scenario = fogsim.load_scenario("dirty_lens", settings)
        step = list(islice(fogsim.run(scenario, seed=1), 2))[-1]
        own = (step.view.instance == Instance.FIRST_VEHICLE + step.ego).mean()
        assert (own > 0.02) == bonnet
        told[bonnet] = make("joint_road", step.observation.frame.camera).update(step.observation)
    assert told[True].valid
    assert told[True].extinction == pytest.approx(told[False].extinction, rel=0.03)
