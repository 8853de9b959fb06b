"""Instruments: steps that they drive, what they read, and nodes and vectors for hosts that want them."""

from __future__ import annotations

import numpy as np
import pytest
import upt
from conftest import FIXTURES

CUBE = np.array([[x, y, z] for x in (-3, 3) for y in (-3, 3) for z in (-3, 3)], np.float32)


@pytest.fixture(scope="module")
def corrected() -> upt.Model:
    """A bundle whose steps correct."""
    return upt.Model(FIXTURES / "tiny-corrected")


def site(model: upt.Model) -> tuple[np.ndarray, np.ndarray]:
    """The middle of the domain's surface and the outward normal there."""
    places = model.positions[model.domain_nodes]
    place = places[np.argmin(np.linalg.norm(places - places.mean(axis=0), axis=1))]
    a, b, c = (model.positions[model.domain_faces[:, corner]] for corner in range(3))
    normal = np.cross(b - a, c - a).sum(axis=0)
    return place, normal / np.linalg.norm(normal)


def pressing(model: upt.Model, depth: float, radius: float = 3.0) -> np.ndarray:
    """The centre of a ball that lies so deep in the rest surface."""
    place, normal = site(model)
    return place + (radius - depth) * normal


def test_a_sphere_is_a_capsule_without_length(corrected):
    pressed = []
    for made in (upt.Instrument.sphere, upt.Instrument.capsule):
        with corrected.scene() as scene:
            ball = made(3.0, position=pressing(corrected, 0.5))
            pressed.append(np.array(scene.step([ball])))
    assert np.abs(pressed[0]).max() > 0.1 and np.array_equal(*pressed)


def test_a_press_is_read_and_a_lift_ends_it(corrected):
    _, normal = site(corrected)
    with corrected.scene() as scene:
        ball, other = upt.Instrument.capsule(3.0, friction=0.2), upt.Instrument.box((1, 1, 1), position=(500, 0, 0))
        assert scene.readings() == []
        for depth in (0.3, 0.6, 0.9):
            ball.position = pressing(corrected, depth)
            out = np.empty((corrected.node_count, 3), np.float32)
            assert scene.step([ball, other], out=out) is out and np.abs(out).max() > 0.1
        touched, free = scene.readings()
        force = np.array(touched.force)
        assert touched.contact_count > 0 and force @ normal > 0.7 * np.linalg.norm(force)
        assert touched.penetration_mm < 0.1 and touched.torn is False and len(touched.torque) == 3
        assert free.contact_count == 0 and free.force == (0.0, 0.0, 0.0)
        contacts = scene.instrument_contacts()
        assert [contact.instrument for contact in contacts] == [0] * touched.contact_count
        np.testing.assert_allclose(np.sum([contact.force for contact in contacts], axis=0), force, rtol=1e-3, atol=1e-2)
        assert scene.timing.contact_ms > 0
        ball.position = pressing(corrected, -30.0)
        scene.step([ball, other])
        assert scene.readings()[0].force == (0.0, 0.0, 0.0) and scene.instrument_contacts() == []
        scene.step([])
        assert scene.readings() == []
        scene.step([ball])
        scene.step()
        assert scene.readings() == []
        scene.step([ball])
        scene.reset()
        assert scene.readings() == []


def staple() -> tuple[np.ndarray, np.ndarray]:
    """Points and faces of two legs of 4 mm, 12 mm apart, which hang from a bridge; they end at z = 0."""
    outline = [(-10, 0), (-6, 0), (-6, 6), (6, 6), (6, 0), (10, 0), (10, 10), (-10, 10)]
    cap = np.array([(0, 1, 2), (0, 2, 7), (2, 3, 6), (2, 6, 7), (3, 4, 5), (3, 5, 6)])
    points = np.array([(x, y, z) for y in (-4, 4) for x, z in outline], np.float32)
    around = [(k, (k + 1) % 8) for k in range(8)]
    sides = [side for a, b in around for side in ((a, a + 8, b), (b, a + 8, b + 8))]
    return points, np.concatenate([cap, cap[:, ::-1] + 8, np.array(sides)])


def test_a_tool_with_a_hollow_touches_beside_it_only(corrected):
    place, normal = site(corrected)
    assert normal[2] > 0.99
    points, faces = staple()
    between = []
    for shape in (upt.Hull(points, faces), upt.Hull(points)):
        with corrected.scene(corrections=5) as scene:
            tool = upt.Instrument.hull(shape)
            for depth in (0.3, 0.6, 0.9):
                tool.position = place - depth * normal
                scene.step([tool])
            assert scene.readings()[0].force[2] > 0
            across = np.array([contact.position[0] for contact in scene.instrument_contacts()]) - place[0]
            between.append(int((np.abs(across) < 5).sum()))
            assert (across < -5.5).any() and (across > 5.5).any()
    assert between[0] == 0 and between[1] > 0, between
    with pytest.raises(upt.ArgumentError, match="not closed"):
        upt.Hull(points, faces[:-1])
    with pytest.raises(upt.ArgumentError, match="thick at"):
        upt.Hull(points * (1, 0.02, 1), faces)
    with pytest.raises(ValueError, match="triangles"):
        upt.Hull(points, [0, 1])


@pytest.mark.parametrize("shape", ["capsule", "box", "spatula", "hull"])
def test_each_shape_pushes_the_same_when_submitted(corrected, shape):
    half, place = (3, 3, 3), pressing(corrected, 0.5)
    made = {
        "capsule": lambda: upt.Instrument.capsule(3.0, 2.0, position=place),
        "box": lambda: upt.Instrument.box(half, position=place),
        "spatula": lambda: upt.Instrument.spatula(half, 0.5, position=place),
        "hull": lambda: upt.Instrument.hull(CUBE, position=place),
    }
    tool = made[shape]()
    own, submitted = corrected.scene(), corrected.scene()
    expected = own.step([tool])
    submitted.submit([tool])
    assert submitted.wait()
    np.testing.assert_array_equal(submitted.read(), expected)
    (reading,) = submitted.readings()
    assert reading.contact_count > 0 and reading.as_dict() == own.readings()[0].as_dict()


def test_a_grasp_pulls_and_tears_off(corrected):
    _, normal = site(corrected)
    with corrected.scene(corrections=5) as scene:
        tool = upt.Instrument.capsule(3.0)
        for depth in (0.3, 0.6, 0.9):
            tool.position = pressing(corrected, depth)
            scene.step([tool])
        tool.grasp = True
        for depth in (0.9, 0.6, 0.3, 0.0, -0.3, -0.6):
            tool.position = pressing(corrected, depth)
            scene.step([tool])
        pull = np.array(scene.readings()[0].force) @ normal
        assert pull < 0
        tool.position, tool.tear_off = pressing(corrected, -1.2), -0.5 * pull
        scene.step([tool])
        assert scene.readings()[0].torn is True


def test_bad_instruments_are_refused(corrected):
    scene = corrected.scene()
    with pytest.raises(upt.ArgumentError, match="friction"):
        scene.step([upt.Instrument.capsule(2.0, friction=-1.0)])
    with pytest.raises(upt.ArgumentError, match=r"instruments\[1\]"):
        scene.step([upt.Instrument.capsule(2.0), upt.Instrument.capsule(-2.0)])
    with pytest.raises(ValueError, match="rotation has 4 numbers"):
        scene.step([upt.Instrument.capsule(2.0, rotation=(0, 0, 1))])
    with pytest.raises(upt.ArgumentError, match="volume|plane|flat"):
        upt.Hull(CUBE * [1, 1, 0])
    hull = upt.Hull(CUBE)
    tool = upt.Instrument.hull(hull)
    hull.close()
    with pytest.raises(upt.StateError, match="HANDLE"):
        scene.step([tool])
    without = upt.Model(FIXTURES / "tiny-upt").scene()
    with pytest.raises(upt.UnsupportedError, match="linear response"):
        without.step([upt.Instrument.capsule(2.0)])


def test_nodes_and_vectors_for_hosts_that_want_them(model, scene):
    node = model.domain_nodes[0]
    tool = upt.Instrument.capsule(2.0, 5.0, position=model.positions[node])
    nodes, vectors = scene.contacts([tool])
    assert node in nodes and vectors.shape == (len(nodes), 3) and np.abs(vectors).max() > 0.1
    scene.step(contacts=(nodes, vectors))
    assert scene.stats.contact_count == len(nodes)
    force = scene.contact_force()
    assert force.shape == vectors.shape and np.isfinite(force).all() and np.abs(force).max() > 0
    far = upt.Instrument(shape="box", position=(1e3, 0, 0), half_extents=(1, 1, 1))
    nodes, vectors = model.scene().contacts([far])
    assert len(nodes) == 0 and vectors.shape == (0, 3)


def test_a_frame_shows_the_tool_where_it_is(corrected):
    """Between steps the tissue follows the tool; at the step's own moment it is the step."""
    assert corrected.frame_step_s == pytest.approx(corrected.dt), "this one recommends none of its own"
    with corrected.scene(sleep=False, step_s=corrected.frame_step_s) as scene:
        ball = upt.Instrument.capsule(3.0, position=pressing(corrected, 0.3))
        scene.present(0.0)  # before the first step
        state = scene.step([ball])
        np.testing.assert_array_equal(scene.present(0.0, [ball]), state)
        ball.position = pressing(corrected, 1.2)
        out = np.empty_like(state)
        assert scene.present(0.02, [ball], out=out) is out
        assert np.abs(out).max() > 1.5 * np.abs(state).max()
        np.testing.assert_array_equal(scene.read(), state)
        scene.submit([ball])
        assert np.isfinite(scene.present(0.03, [ball])).all()
        assert scene.wait()
        scene.attach_points(corrected.positions[:5])
        assert scene.present(0.01, [ball], view="points").shape == (5, 3)
        with pytest.raises(upt.ArgumentError, match="when is -1"):
            scene.present(-1.0)
    with upt.Model(FIXTURES / "tiny-upt").scene() as scene, pytest.raises(upt.UnsupportedError, match="sample"):
        scene.present(0.0)


def test_a_collision_field_is_presented_too(corrected):
    """Listed nodes are where they are asked to be; points at nodes go with them."""
    nodes = corrected.domain_nodes[:4]
    with corrected.scene(sleep=False) as scene:
        scene.attach_points(corrected.positions[nodes])
        for depth in (0.2, 0.4):
            scene.step(contacts=(nodes, np.tile([0, 0, -depth], (4, 1))))
            scene.present(0.0, contacts=(nodes, np.tile([0, 0, -depth], (4, 1))))
        contact = np.tile(np.float32([0, 0, -0.5]), (4, 1))
        field = scene.present(0.025, contacts=(nodes, contact))
        np.testing.assert_allclose(field[nodes], contact, atol=2e-3)
        out = np.empty((4, 3), np.float32)
        assert scene.present(0.025, contacts=(nodes, contact), view="points", out=out) is out
        np.testing.assert_allclose(out, contact, atol=2e-3)
        with pytest.raises(upt.ArgumentError):
            scene.present(0.01, contacts=([10**6], contact[:1]), view="points")


def test_the_fast_way_to_a_struct_is_the_slow_one():
    """Byte for byte, for each shape; what does not fit is refused by the name of its field."""
    hull = upt.Instrument.hull(CUBE, position=(1, 2, 3), rotation=(0, 0.6, 0, 0.8), friction=0.3, tear_off=5)
    tools = [
        upt.Instrument.capsule(3.0, 7.0, position=np.array([1.5, -2, 3]), grasp=True),
        upt.Instrument.box((1, 2, 3), friction=0.25),
        upt.Instrument("spatula", (4, 5, 6), half_extents=(1, 2, 3), radius=0.5, sticking=True),
        hull,
    ]
    array, count = upt.instrument.records(tools)
    assert count == 4
    for packed, tool in zip(array, tools, strict=True):
        assert bytes(packed) == bytes(tool.record()), tool.shape
    assert upt.instrument.records([]) == (None, 0)
    for wrong in ({"position": (1, 2)}, {"rotation": (0, 0, 0, 0, 1)}):
        tool = upt.Instrument.capsule(1.0)
        for field, value in wrong.items():
            setattr(tool, field, value)
            with pytest.raises(ValueError, match=f"{field} has [34] numbers, not {len(value)}"):
                upt.instrument.records([tool])
