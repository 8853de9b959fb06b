"""What a caller can do wrong is an exception that says so, and changes nothing."""

from __future__ import annotations

import logging
import os
import subprocess
import sys

import numpy as np
import pytest
import upt
from conftest import FIXTURES, push


def test_a_missing_bundle(tmp_path):
    with pytest.raises(upt.BundleError, match="bundle.json") as caught:
        upt.Model(tmp_path / "nothing")
    assert caught.value.status == upt.Status.IO


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"colour": 1}, "has no field 'colour'"),
        ({"kernel": "fast"}, "kernel: 'fast' is not one of auto, native"),
        ({"reserved": (1, 0)}, "has no field 'reserved'"),
    ],
)
def test_unknown_options(model, options, message):
    with pytest.raises((TypeError, ValueError), match=message):
        model.scene(**options)


def test_the_librarys_own_checks_are_value_errors(model):
    with pytest.raises(ValueError, match="threads"):
        model.scene(threads=5000)
    assert issubclass(upt.ArgumentError, ValueError)


@pytest.mark.parametrize(
    ("nodes", "vectors", "message"),
    [
        ([0], [[0, 0]], "contact has shape"),
        ([0, 1], [[0, 0, 0]], r"expected \(2, 3\)"),
        ([-1], [[0, 0, 0]], "negative"),
        ([0.5], [[0, 0, 0]], "node indices"),
        ([[0]], [[0, 0, 0]], "nodes has shape"),
        ([10**6], [[0, 0, 0]], "1000000"),
        ([0], [[0, 0, np.nan]], "NON_FINITE"),
    ],
)
def test_bad_contacts(model, scene, nodes, vectors, message):
    before = scene.step(contacts=push(model, 2))
    with pytest.raises((ValueError, TypeError), match=message):
        scene.step(contacts=(nodes, vectors))
    np.testing.assert_array_equal(scene.read(), before)


@pytest.mark.parametrize(
    "spoil", [lambda o: o.astype(np.float64), lambda o: o[:-1], lambda o: o[:, ::-1], lambda o: o.tolist()]
)
def test_an_output_that_would_need_a_copy_is_refused(model, scene, spoil):
    out = np.zeros((model.node_count, 3), np.float32)
    with pytest.raises((ValueError, TypeError), match="out must be"):
        scene.step(out=spoil(out))


def test_a_read_only_output_is_refused(model, scene):
    with pytest.raises(ValueError, match="writeable"):
        scene.read(model.positions)


def test_an_array_that_comes_again_is_still_checked(model, scene):
    """Its address is remembered, not what it was."""
    nodes, vectors = push(model, 2)
    out = np.zeros((model.node_count, 3), np.float32)
    for _ in range(2):
        scene.step(contacts=(nodes, vectors), out=out)
    before = out.copy()
    out.setflags(write=False)
    with pytest.raises(ValueError, match="writeable"):
        scene.step(contacts=(nodes, vectors), out=out)
    out.setflags(write=True)
    scene.set_region(model.surface_nodes)
    with pytest.raises(ValueError, match=r"shape \(\d+, 3\)"):
        scene.step(contacts=(nodes, vectors), out=out)
    np.testing.assert_array_equal(out, before)
    # What the scene writes to cannot be moved from under it.
    with pytest.raises(ValueError, match="resize"):
        out.resize((7, 3))


def test_messages_go_to_logging(caplog):
    upt.set_log("info")
    try:
        with caplog.at_level(logging.DEBUG, logger="upt"):
            upt.Model(FIXTURES / "tiny-reduced").scene().step()
    finally:
        upt.set_log("off")
    assert any(record.name == "upt" for record in caplog.records)


def test_a_start_with_other_options_is_refused(model):
    with pytest.raises(upt.StateError):
        upt.init(threads=7)


def test_a_missing_library_says_what_to_do(tmp_path):
    code = "import upt"
    environment = os.environ | {"UPT_LIBRARY": str(tmp_path / "libupt.so")}
    run = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True)
    assert run.returncode != 0 and "libupt.so" in run.stderr


def test_onnx_runtime_comes_from_its_package():
    """Without ORT_DYLIB_PATH a fresh process finds the one of the package `onnxruntime`."""
    code = "import upt; print([p['reason'] for p in upt.providers() if p['name'] == 'cpu'])"
    environment = {key: value for key, value in os.environ.items() if key != "ORT_DYLIB_PATH"}
    run = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True)
    assert "onnxruntime" in run.stdout and "capi" in run.stdout, run.stdout + run.stderr


def test_a_bundle_with_a_network_says_which_package_is_missing():
    """The wheel does not ask for ONNX Runtime; a bundle that needs it says what to install."""
    code = f"import sys, upt; sys.modules['onnxruntime'] = None; upt.Model({str(FIXTURES / 'tiny-reduced')!r})"
    environment = os.environ | {"ORT_DYLIB_PATH": str(FIXTURES / "no-such-library")}
    run = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True)
    assert "RuntimeLibraryError" in run.stderr and 'pip install "libupt[learned]"' in run.stderr, run.stderr


def test_a_process_may_end_with_scenes_alive():
    code = f"import upt; s = upt.Model({str(FIXTURES / 'tiny-reduced')!r}).scene(); s.step(); s.submit()"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert run.returncode == 0 and not run.stderr, run.stderr


@pytest.mark.parametrize(
    ("call", "argument"),
    [
        (lambda m, s: upt.Model(5), "path"),
        (lambda m, s: m.scene(threads="two"), "threads"),
        (lambda m, s: m.scene(kernel=[1]), "kernel"),
        (lambda m, s: m.scene(mesh_path=7), "mesh_path"),
        (lambda m, s: m.indices("tets"), "which"),
        (lambda m, s: s.step(displacement="field"), "displacement"),
        (lambda m, s: s.step(collision={}), "collision"),
        (lambda m, s: s.step(out=[1.0]), "out"),
        (lambda m, s: s.step(contacts=("ab", [[0, 0, 0]])), "nodes"),
        (lambda m, s: s.step(contacts=([0], "there")), "contact"),
        (lambda m, s: s.step(5), "instruments"),
        (lambda m, s: s.step(upt.Instrument.capsule(1.0)), "instruments"),
        (lambda m, s: s.step([1]), r"instruments\[0\]"),
        (lambda m, s: s.step([upt.Instrument.capsule("six")]), r"instruments\[0\].radius"),
        (lambda m, s: s.step([upt.Instrument.capsule(6, position=3)]), r"instruments\[0\].position"),
        (lambda m, s: s.step([upt.Instrument.capsule(6, position="abc")]), r"instruments\[0\].position"),
        (lambda m, s: s.sample("half"), "alpha"),
        (lambda m, s: s.present("now"), "when"),
        (lambda m, s: s.step(contacts=3), "contacts"),
        (lambda m, s: s.step(time_s="now"), "time_s"),
        (lambda m, s: s.wait("long"), "timeout"),
        (lambda m, s: s.restore("bytes"), "snapshot"),
        (lambda m, s: s.attach_points("here"), "points"),
        (lambda m, s: s.set_region("all"), "nodes"),
        (lambda m, s: upt.Haptics(s, 5), "tool"),
        (lambda m, s: upt.BatchedScenes(m, "3"), "count"),
        (lambda m, s: upt.Hull("cube"), "points"),
    ],
)
def test_a_wrong_type_is_a_type_error_that_names_the_argument(model, scene, call, argument):
    with pytest.raises(TypeError, match=rf"^{argument}"):
        call(model, scene)
