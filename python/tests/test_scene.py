"""A scene from Python: the stored rollouts, equal bits on each way in, and every call of the ABI."""

from __future__ import annotations

import json
import sys
import threading
from types import SimpleNamespace

import numpy as np
import pytest
import upt
from conftest import FIXTURES, ROOT, push, tensors
from upt import _arrays, _library, bundles


def test_a_scene_follows_the_stored_rollout(name, scene):
    rollout = tensors(FIXTURES / f"{name}-rollout.safetensors")
    offsets = rollout["contact_offsets"]
    for t, expected in enumerate(rollout["displacement"]):
        rows = slice(offsets[t], offsets[t + 1])
        u = scene.step(contacts=(rollout["contact_nodes"][rows], rollout["contact_vectors"][rows]))
        np.testing.assert_allclose(u, expected, atol=1e-4, rtol=0)


def test_dense_fields_and_listed_contacts_give_the_same_bits(model, scene):
    dense = model.scene(sleep=False)
    state = np.zeros((model.node_count, 3), np.float32)
    for t in range(5):
        nodes, vectors = push(model, t)
        collision = np.zeros_like(state)
        collision[nodes] = vectors
        np.testing.assert_array_equal(dense.step(collision=collision), scene.step(contacts=(nodes, vectors)))
    assert dense.step(displacement=state).shape == state.shape


def test_arrays_of_the_right_type_are_not_copied(model, scene):
    vectors = np.zeros((4, 3), np.float32)
    assert _arrays.vectors(vectors, "x") is vectors
    nodes = np.arange(4, dtype=np.uint32)
    assert np.shares_memory(_arrays.indices(nodes, "x"), nodes)
    out = np.empty((model.node_count, 3), np.float32)
    assert scene.step(out=out) is out
    # In place: the result over the input.
    collision = np.zeros_like(out)
    collision[model.domain_nodes[0]] = [0, 0, -1]
    expected = model.scene(sleep=False).step(displacement=np.zeros_like(out), collision=collision)
    out[:] = 0
    model.scene(sleep=False).step(displacement=out, collision=collision, out=out)
    np.testing.assert_array_equal(out, expected)


def test_contacts_are_the_same_bits_copied_or_not(model, scene):
    """The lists need not lie in one piece, and may come again with other values in them."""
    nodes, vectors = push(model, 3)
    other = model.scene(sleep=False)
    expected = other.step(contacts=(nodes.tolist(), vectors.tolist()))
    apart = np.repeat(nodes, 2)[::2], np.repeat(vectors, 2, axis=1)[:, ::2]
    np.testing.assert_array_equal(scene.step(contacts=apart), expected)
    np.testing.assert_array_equal(scene.step(contacts=(nodes, vectors)), other.step(contacts=apart))
    # The same arrays again, with other values in them.
    vectors = vectors.copy()
    for depth in (1.0, 1.5, 2.0, 2.5):
        vectors[:, 2] = -depth
        expected = other.step(contacts=(nodes, vectors.tolist()))
        np.testing.assert_array_equal(scene.step(contacts=(nodes, vectors)), expected)


@pytest.mark.parametrize("convert", [np.float64, list])
def test_other_types_are_converted(model, scene, convert):
    nodes, vectors = push(model, 1)
    expected = scene.step(contacts=(nodes, vectors))
    other = model.scene(sleep=False)
    given = vectors.tolist() if convert is list else vectors.astype(convert)
    np.testing.assert_array_equal(other.step(contacts=(nodes.astype(np.int64), given)), expected)


def test_region_decode_and_points(model, scene):
    nodes, vectors = push(model, 4)
    whole = scene.step(contacts=(nodes, vectors))
    chosen = model.surface_nodes[::3][::-1]
    np.testing.assert_allclose(scene.decode(chosen), whole[chosen], atol=1e-5)
    scene.attach_points(model.positions[chosen[:5]])
    scene.reset()
    scene.set_region(chosen)
    assert scene.out_count == len(chosen)
    np.testing.assert_allclose(scene.step(contacts=(nodes, vectors)), whole[chosen], atol=1e-5)
    assert scene.read(view="points").shape == (5, 3)
    np.testing.assert_array_equal(scene.read(view="points"), scene.sample(1.0, view="points"))
    scene.set_region(None)
    assert scene.read().shape == whole.shape
    scene.attach_points(None)
    with pytest.raises(upt.StateError, match="points"):
        scene.read(view="points")


def test_a_snapshot_resumes_to_the_bit(model, scene):
    for t in range(3):
        scene.step(contacts=push(model, t))
    snapshot = scene.save()
    after = [scene.step(contacts=push(model, t)) for t in range(3, 6)]
    other = model.scene(sleep=False)
    other.restore(snapshot)
    for t, expected in zip(range(3, 6), after, strict=True):
        np.testing.assert_array_equal(other.step(contacts=push(model, t)), expected)
    with pytest.raises(upt.BundleError, match="SNAPSHOT"):
        other.restore(snapshot[: len(snapshot) // 2])


def test_a_submitted_step_is_the_same_step(model, scene):
    nodes, vectors = push(model, 2)
    scene.submit(contacts=(nodes, vectors))
    assert scene.wait()
    expected = model.scene(sleep=False).step(contacts=(nodes, vectors))
    np.testing.assert_array_equal(scene.read(), expected)
    np.testing.assert_allclose(scene.sample(0.5), expected / 2, atol=1e-6)
    with pytest.raises(upt.StateError):
        model.scene().poll()


def test_statistics_are_typed(model, scene):
    scene.step(contacts=push(model, 120))
    stats = scene.stats
    assert stats.step_count == 1 and stats.contact_count == 3 and stats.sleeping is False
    assert stats.flags & upt.Flag.PUSH, "a push of 24 mm is longer than the bundle was made for"
    assert isinstance(stats.kernel, upt.Kernel)
    assert set(stats.as_dict()) >= {"max_displacement_mm", "threads"}
    assert scene.timing.step_ms > 0 and scene.timing.step_count == stats.step_count


def test_the_gil_is_free_during_a_call():
    """With switching by time turned off, another thread runs during a call only where the call lets go of the GIL."""
    interval = sys.getswitchinterval()
    sys.setswitchinterval(3600.0)
    try:
        seen = []
        for _ in range(50):
            inside, done = threading.Event(), []

            def load(inside=inside, done=done):
                inside.set()
                upt.Model(FIXTURES / "tiny-reduced")
                done.append(True)

            thread = threading.Thread(target=load)
            thread.start()
            inside.wait()
            seen.append(not done)
            thread.join()
            if any(seen):
                break
        assert any(seen)
    finally:
        sys.setswitchinterval(interval)
    assert isinstance(_library.lib, __import__("ctypes").CDLL)


def test_scenes_outlive_their_model(name, model):
    own = upt.Model(FIXTURES / name)
    scene = own.scene(sleep=False)
    own.close()
    expected = model.scene(sleep=False).step(contacts=push(model, 1))
    np.testing.assert_array_equal(scene.step(contacts=push(model, 1)), expected)
    scene.close()
    scene.close()
    with pytest.raises(upt.StateError, match="HANDLE"):
        scene.step()


def test_a_mesh_of_the_hosts_own():
    """Only a bundle without a linear response takes one."""
    model = upt.Model(FIXTURES / "tiny-upt")
    scene = model.scene(mesh_path=FIXTURES / "tiny-upt" / "mesh.safetensors")
    assert scene.node_count == model.node_count
    assert scene.step().shape == (model.node_count, 3)
    with pytest.raises(upt.UnsupportedError, match="mesh_path"):
        upt.Model(FIXTURES / "tiny-reduced").scene(mesh_path=FIXTURES / "tiny-reduced" / "mesh.safetensors")


def test_a_bundle_that_ships_is_found_from_any_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # What pip keeps of `pip install ./python`; a wheel came from no clone.
    kept = json.dumps({"url": (ROOT / "python").as_uri(), "dir_info": {}})
    monkeypatch.setattr(bundles, "distribution", lambda name: SimpleNamespace(read_text=lambda file: kept))
    assert (upt.bundle("brain-coarse-reduced") / "bundle.json").is_file()
    with pytest.raises(FileNotFoundError, match="brain-coarse-reduced"):
        upt.bundle("no-such-brain")
