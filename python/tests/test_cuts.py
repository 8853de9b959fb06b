"""Cuts from Python: outputs grow with the body, the surface stays closed and follows, undo by a snapshot."""

from __future__ import annotations

import numpy as np
import pytest
import upt
from conftest import ROOT
from test_instruments import pressing, site


@pytest.fixture(scope="module")
def liver() -> upt.Model:
    """A bundle whose mesh has room for a slit."""
    return upt.Model(ROOT / "onnx" / "liver-coarse")


def slit(model: upt.Model, aside: float, depth: float) -> np.ndarray:
    """A straight blade 40 mm long beside the site, from above the surface to a depth."""
    place, normal = site(model)
    along = np.cross(normal, [0.3, 0.5, 0.8])
    along /= np.linalg.norm(along)
    across = np.cross(normal, along)
    ends = np.outer([-20.0, 20.0], along)
    return np.array([place + aside * across + ends + height * normal for height in (6.0, -depth)], np.float32)


def open_edges(triangles: np.ndarray) -> int:
    """Edges that a surface does not pass as often in one direction as in the other."""
    whole = triangles[triangles.any(axis=1)].astype(np.int64)
    edges = np.concatenate([whole[:, [0, 1]], whole[:, [1, 2]], whole[:, [2, 0]]])
    there, back = (np.unique(ends, axis=0, return_counts=True) for ends in (edges, edges[:, ::-1]))
    return 0 if np.array_equal(there[0], back[0]) and np.array_equal(there[1], back[1]) else 1


def test_a_scene_is_cut_and_its_surface_follows(liver):
    with liver.scene(corrections=5) as scene:
        ball = upt.Instrument.sphere(3.0, position=pressing(liver, 3.0))
        scene.step([ball])
        saved = scene.save()
        whole = scene.surface()
        assert whole.is_new and not whole.inside.any() and len(whole.changed) == len(whole.triangles)
        with pytest.raises(ValueError, match="poses"):
            scene.cut([[0, 0, 0]])
        done = scene.cut(slit(liver, 6.0, 12.0))
        assert done.copied_count > 0 and done.area_mm2 > 100
        assert scene.node_count == scene.out_count == done.node_count == liver.node_count + done.copied_count
        with pytest.raises(upt.StateError):
            scene.surface_positions()
        now = scene.surface()
        assert not now.is_new and now.first_vertex == len(whole.rest) and now.inside.sum() > 20
        np.testing.assert_array_equal(now.rest[: len(whole.rest)], whole.rest)
        uploaded = np.zeros_like(now.triangles)
        uploaded[: len(whole.triangles)] = whole.triangles
        uploaded[now.changed] = now.triangles[now.changed]
        np.testing.assert_array_equal(uploaded, now.triangles)
        assert open_edges(whole.triangles) == open_edges(now.triangles) == 0
        u = scene.step([ball])
        assert u.shape == (scene.node_count, 3)
        at = scene.surface_positions()
        np.testing.assert_allclose(at[: liver.node_count], liver.positions + u[: liver.node_count], atol=1e-4)
        frame = scene.present(0.0, [ball], view="surface")
        np.testing.assert_allclose(now.rest + frame, at, atol=1e-3)
        ball.position = pressing(liver, 8.0)
        assert scene.remove(ball, 30.0).removed_mm3 == pytest.approx(30.0, rel=0.2)
        with pytest.raises(upt.ArgumentError, match="above 1"):
            scene.tear(1.0)
        torn = scene.tear(1.05, most=2)
        assert torn.area_mm2 > 0 and torn.is_changed
        assert scene.scale_stiffness([0, 1], 2.0).node_count == scene.node_count
        assert scene.drop_fragments().fragment_count == 0
        cut = scene.save()
        scene.restore(saved)
        assert scene.node_count == liver.node_count and scene.read().shape == (liver.node_count, 3)
        assert scene.surface().is_new
        scene.restore(cut)
        assert scene.node_count > liver.node_count and scene.step().shape == (scene.node_count, 3)
        scene.reset()
        assert scene.step(displacement=np.zeros((liver.node_count, 3), np.float32)).shape == (liver.node_count, 3)


def test_a_blade_feels_what_it_lays_open(liver):
    with liver.scene(corrections=5) as scene:
        blade = upt.Blade(fracture_energy=25.0)
        done = scene.cut(slit(liver, 6.0, 12.0), blade=blade)
        assert 25.0 * done.area_mm2 / 18.0 == pytest.approx(float(np.linalg.norm(done.force)), rel=0.3)
        assert [name for name in upt.__all__ if not hasattr(upt, name)] == []


def test_what_cannot_be_cut_says_so(liver):
    with (
        liver.scene(corrections="none") as scene,
        pytest.raises(upt.UnsupportedError, match="corrections"),
    ):
        scene.cut(slit(liver, 6.0, 12.0))
