"""Traffic lights and persons as they are drawn."""

import contextlib
import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from fogsim.render import make_renderer
from fogsim.render.photometry import lamp_radiance
from fogsim.scene import build_scene, light_sources
from fogsim.scene.road import KERB
from fogsim.scene.town import person_batches, person_shapes, signal_batches, signal_posts, signal_shapes
from fogsim.scene.town.persons import STANDING
from fogsim.scene.town.traffic_lights import directed_share
from fogsim.traffic.road.network import read_net, road_network
from fogsim.units import luminance_of
from fogsim.values import (
    Camera,
    CameraPose,
    LightSources,
    PersonState,
    SignalColour,
    SignalHead,
    SignalLight,
    SignalState,
    SignMap,
    Surface,
)
from fogsim.values.scene import Instance
from tests.recorders.synthetic import traffic

HEAD = SignalHead("C", "a_1", (0,), (0.0, -3.0, 5.5), 0.0, 0.3, (0.0, -6.0, 0.0))
CAMERA = Camera(320, 240, 300.0, (159.5, 119.5), 1.4)


def showing(*colours: SignalColour, diameter: float = 0.2) -> SignalState:
    """Heads at the origin that speak to those who drive east."""
    count = len(colours)
    places = np.tile((0.0, 0.0, 3.0), (count, 1))
    return SignalState(("C",) * count, ("a_0",) * count, places, np.zeros(count), np.full(count, diameter), colours)


def sources(signals: SignalState, x: float) -> LightSources:
    """What shines to an eye at a place along the road, of a road without vehicles."""
    state = dataclasses.replace(traffic(0.0, 10.0), signals=signals, ids=(), types=())
    return light_sources(state, None, (x, 0.0, 3.0), {})


def walking(*ids: str, speed: float = 1.4, x: float = 0.0, raised: bool = False) -> PersonState:
    """Persons who walk east."""
    count = len(ids)
    places = np.tile((x, 0.0, 0.0), (count, 1))
    return PersonState(ids, places, np.zeros(count), np.full(count, speed), ("f_0",) * count, np.full(count, raised))


def test_a_head_has_the_lenses_lit_that_it_shows_or_half_of_the_time() -> None:
    for colour, lit in [
        (SignalColour.RED, SignalLight.RED),
        (SignalColour.RED_YELLOW, SignalLight.RED | SignalLight.YELLOW),
        (SignalColour.YELLOW, SignalLight.YELLOW),
        (SignalColour.GREEN, SignalLight.GREEN),
        (SignalColour.OFF, SignalLight.DARK),
    ]:
        (batch,) = signal_batches(showing(colour), 0.0)
        assert batch.lamps.tolist() == [int(lit)]
        assert batch.instance.tolist() == [Instance.TRAFFIC_LIGHT]
    # What blinks is lit half of the time.
    lit = [int(signal_batches(showing(SignalColour.BLINKING), 0.1 * n)[0].lamps[0]) for n in range(20)]
    assert lit.count(int(SignalLight.YELLOW)) == lit.count(0) == 10


def test_lit_lenses_shine_200_cd_toward_those_who_approach_and_none_back() -> None:
    seen = sources(showing(SignalColour.RED, SignalColour.GREEN), -300.0)
    assert seen.intensity == pytest.approx([200.0, 200.0], rel=1e-3)
    # Red is above, green below.
    assert seen.position[0, 2] == pytest.approx(3.3)
    assert seen.position[1, 2] == pytest.approx(2.7)
    assert len(sources(showing(SignalColour.RED, SignalColour.GREEN), 300.0).intensity) == 0
    # ITE: 475 cd straight ahead are 0.953 · 0.678 of that, 309 cd, at 5 degrees down and 10 degrees left.
    share = directed_share(np.radians([10.0, 0.0, 120.0]), np.radians([5.0, 0.0, 0.0]))
    assert 475.0 * share[0] == pytest.approx(309.0, abs=3.0)
    assert share[1:].tolist() == [1.0, 0.0]


def test_large_lenses_are_as_luminous_as_small_ones_and_so_is_their_surface() -> None:
    for diameter in (0.2, 0.3):
        seen = sources(showing(SignalColour.GREEN, diameter=diameter), -500.0)
        luminance = seen.intensity[0] / seen.area[0]
        assert luminance == pytest.approx(luminance_of(lamp_radiance(Surface.LENS_GREEN)), rel=2e-3)


def test_heads_for_persons_have_two_figures_that_shine_less() -> None:
    shown = showing(SignalColour.RED, SignalColour.GREEN, SignalColour.GREEN)
    shown = dataclasses.replace(shown, on_foot=np.array([True, True, False]))
    head, walk = signal_batches(shown, 0.0)
    assert (head.shape, walk.shape) == ("signal_head", "signal_walk")
    assert walk.lamps.tolist() == [int(SignalLight.RED), int(SignalLight.GREEN)]
    assert head.lamps.tolist() == [int(SignalLight.GREEN)]
    seen = sources(shown, -300.0)
    red, green, full = seen.intensity.tolist()
    assert full == pytest.approx(200.0, rel=1e-3)
    assert red == pytest.approx(green) == pytest.approx(0.3 * full)
    assert seen.position[:, 2] == pytest.approx([3.15, 2.85, 2.7])
    # The figures' share of a lens is what is drawn of them.
    mesh = signal_shapes()["signal_walk"]
    green_faces = mesh.faces[(mesh.surface[mesh.faces] == Surface.LENS_GREEN).all(axis=1)]
    corners = mesh.positions[green_faces]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    assert area / (0.25 * math.pi) == pytest.approx(0.3, abs=0.03)


def test_heads_above_the_road_hang_on_an_arm_of_a_post_and_face_those_who_approach() -> None:
    beside = dataclasses.replace(HEAD, lane_id="a_0", position=(0.0, -6.0, 2.75), diameter=0.2)
    posts, arms = signal_posts([beside, HEAD])
    assert posts.transforms.shape[0] == arms.transforms.shape[0] == 1
    assert posts.transforms[0, 1, 3] == pytest.approx(-6.0)
    assert posts.transforms[0, 2, 3] + posts.transforms[0, 2, 2] > 5.5
    # It reaches over the road to the left of those who approach, and behind the heads.
    tip = arms.transforms[0] @ (1.0, 0.0, 0.0, 1.0)
    assert tip[1] > -3.0
    assert tip[0] > 0.2
    for name, shape in signal_shapes().items():
        lenses = shape.surface == Surface.LENS_GREEN
        assert lenses.any() == name.startswith(("signal_head", "signal_walk"))
        assert (shape.normals[lenses, 0] < -0.99).all()


def test_persons_are_as_high_as_people_and_stand_on_what_they_walk_on() -> None:
    shapes = person_shapes()
    for raised, ground in ((False, 0.0), (True, KERB)):
        low, high = math.inf, -math.inf
        for batch in person_batches(walking("anna", raised=raised)):
            points = shapes[batch.shape].positions @ batch.transforms[0, :3, :3].T + batch.transforms[0, :3, 3]
            low, high = min(low, points[:, 2].min()), max(high, points[:, 2].max())
            assert (batch.instance == Instance.PERSON).all()
        assert ground - 0.03 < low < ground + 0.06
        assert ground + 1.5 < high < ground + 1.9


def test_persons_stride_by_the_way_they_go_and_clothes_stay_and_differ() -> None:
    def poses(speed: float) -> list[str]:
        return [
            next(batch.shape for batch in person_batches(walking("anna", speed=speed, x=x)) if "legs" in batch.shape)
            for x in np.arange(0.0, 1.4, 0.05)
        ]

    assert len(set(poses(1.4))) == 8
    assert set(poses(0.0)) == {f"person_legs_{STANDING}"}
    crowd = tuple(f"p.{n}" for n in range(40))
    once, again = person_batches(walking(*crowd, speed=0.0)), person_batches(walking(*crowd, speed=0.0))
    for one, other in zip(once, again, strict=True):
        np.testing.assert_array_equal(one.paint, other.paint)
    jackets = next(batch.paint for batch in once if batch.shape.startswith("person_trunk"))
    assert len(np.unique(jackets, axis=0)) > 6


def test_a_picture_of_a_crossing_shows_its_light_and_who_walks_there() -> None:
    net = read_net(Path(__file__).parents[1] / "data" / "crossing" / "lights.net.xml")
    network = road_network(net, ["WC", "CE"])
    scene = build_scene(network, SignMap(), np.random.default_rng(0))
    head = next(head for head in network.signal_heads if head.lane_id == "WC_1")
    x, y, _ = head.position
    places = {"position": np.array([head.position]), "heading": np.array([head.heading])}
    signals = dataclasses.replace(showing(SignalColour.RED, diameter=head.diameter), **places)
    persons = dataclasses.replace(walking("anna"), position=np.array([[x - 2.0, y + 3.0, 0.0]]))
    pose = CameraPose((x - 25.0, y + 3.0, 1.4), 0.0)
    with contextlib.closing(make_renderer("cpu", scene, 1e4)) as renderer:
        view = renderer.render((*signal_batches(signals, 0.0), *person_batches(persons)), CAMERA, pose)
        bare = renderer.render((), CAMERA, pose)
    lit = (view.instance == Instance.TRAFFIC_LIGHT) & (view.radiance[..., 0] > 4.0 * view.radiance[..., 1])
    assert lit.sum() >= 3
    assert view.radiance[lit].max() == pytest.approx(lamp_radiance(Surface.LENS_RED)[0], rel=0.05)
    figure = np.argwhere(view.instance == Instance.PERSON)
    assert 15 < np.ptp(figure[:, 0]) < 30
    untouched = (view.instance != Instance.PERSON) & (view.instance != Instance.TRAFFIC_LIGHT)
    # Texture is interpolated along the pixels that see one surface, and figures cut these short.
    np.testing.assert_allclose(view.radiance[untouched], bare.radiance[untouched], rtol=0.01)
