"""`upt view`: what is refused, and its page and that of `cargo xtask study report` in headless Chromium.

    python3 tests/view/run.py

Reads UPT_COMMAND (the command `upt`), UPT_STUDY (the study), UPT_BUNDLES (default onnx/), UPT_BUILD_DIR (pictures go
to view/ there) and ORT_DYLIB_PATH. The last line is `N passed, N failed, N skipped`.
"""

from __future__ import annotations

import base64
import json
import math
import os
import re
import struct
import subprocess
import sys
import tempfile
import traceback
import urllib.error
import urllib.request
from pathlib import Path

from breathing import an_organ_breathes_with_what_hangs_on_it, the_button_breathes
from client import Browser, RawClient, Refused
from running import COMMAND, ROOT, TOOL, connect_when_free, frame, pressing, server, take, tip_of_the_phantom
from surgery import a_blade_cuts_and_undo_heals, the_mouse_operates

STUDY = os.environ.get("UPT_STUDY", str(ROOT / "target/release/upt-study"))
BUNDLES = Path(os.environ.get("UPT_BUNDLES", ROOT / "onnx"))
PICTURES = Path(os.environ.get("UPT_BUILD_DIR", ROOT / "target")) / "view"


def status_of(port: int, path: str, host: str | None = None) -> int:
    request = urllib.request.Request(f"http://127.0.0.1:{port}{path}")
    if host:
        request.add_header("Host", host)
    try:
        with urllib.request.urlopen(request, timeout=30) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        return error.code


def only_the_token_opens_the_page():
    with server(ROOT / "tests/fixtures/tiny-reduced") as (port, token):
        assert status_of(port, f"/?token={token}") == 200
        assert status_of(port, "/") == 403
        assert status_of(port, f"/?token={token[:-1]}") == 403
        assert status_of(port, f"/?token={token}", "evil.example") == 403
        assert status_of(port, "/view.js") == 200
        assert status_of(port, f"/../Cargo.toml?token={token}") == 404


def the_length_of_a_step_is_asked_for():
    phantom = ROOT / "tests/fixtures/tiny-reduced"
    for wrong in ("5", "nan", "60"):
        refused = subprocess.run([COMMAND, "view", str(phantom), "--step-ms", wrong], capture_output=True, text=True)
        assert refused.returncode != 0 and "10 to 50 ms" in refused.stderr, (wrong, refused)
    # Without corrections there are only the bundle's own steps.
    refused = subprocess.run([COMMAND, "view", str(phantom), "--step-ms", "20"], capture_output=True, text=True)
    assert refused.returncode != 0 and "step_s is 0.02" in refused.stderr, refused
    with server(phantom, "--step-ms", "50") as (port, token):
        client = RawClient(port, f"/socket?token={token}")
        hello = json.loads(client.read()[1])
        assert abs(hello["dt"] - 0.05) < 1e-6, hello["dt"]


def a_socket_of_another_origin_is_refused():
    """Verifies REQ-091."""
    with server(ROOT / "tests/fixtures/tiny-reduced") as (port, token):
        target = f"/socket?token={token}"
        for origin, host in [("http://evil.example", None), (None, None), ("same", "evil.example")]:
            try:
                RawClient(port, target, origin, host)
            except Refused:
                continue
            raise AssertionError(f"origin {origin}, host {host}")
        try:
            RawClient(port, "/socket?token=0")
            raise AssertionError("wrong token")
        except Refused:
            pass
        RawClient(port, target).close()


def a_second_client_is_refused_and_the_first_goes_on():
    with server(ROOT / "tests/fixtures/tiny-reduced") as (port, token):
        first = RawClient(port, f"/socket?token={token}")
        first.read(), first.read()
        try:
            RawClient(port, f"/socket?token={token}")
            raise AssertionError("two clients")
        except Refused as refused:
            assert "409" in str(refused)
        assert [frame(first, None, at).sequence for at in range(1, 6)] == [1, 2, 3, 4, 5]


def a_bad_message_closes_its_client_alone():
    def tool(**fields):
        return json.dumps({"tool": TOOL | fields}).encode()

    bad = {
        "no JSON": (b"{", {}),
        "not UTF-8": (b"\xff\xfe", {}),
        "unknown field": (b'{"explode":true}', {}),
        "NaN": (tool(position=[float("nan"), 0, 0]), {}),
        "infinite": (b'{"tool":' + json.dumps(TOOL).replace("[0, 0, 0]", "[1e999,0,0]").encode() + b"}", {}),
        "no rotation": (tool(rotation=[0, 0, 0, 0]), {}),
        "friction below zero": (tool(friction=-1), {}),
        "binary": (b"\0" * 16, {"opcode": 2}),
        "oversized": (b" " * 5000 + b"{}", {}),
        "a length of a terabyte": (b"", {"length": 1 << 40}),
        "not masked": (b'{"reset":true}', {"masked": False}),
        "reserved opcode": (b"x", {"opcode": 5}),
    }
    with server(ROOT / "tests/fixtures/tiny-reduced") as (port, token):
        for what, (payload, how) in bad.items():
            client = connect_when_free(port, token)
            client.read()
            client.send(payload, **how)
            assert client.closes(), what
            client.close()
        # The server still serves, and a good message moves the tissue of the phantom.
        client = connect_when_free(port, token)
        top = tip_of_the_phantom(client)
        largest = 0.0
        for at in range(1, 2000):
            largest = max(largest, frame(client, pressing(top, 4.0), at).largest)
            if largest > 1.0:
                break
        assert largest > 1.0, f"{largest} mm"


def a_flood_of_messages_gets_one_answer_for_many():
    with server(ROOT / "tests/fixtures/tiny-reduced") as (port, token):
        client = RawClient(port, f"/socket?token={token}")
        client.read(), client.read()
        count = 2000
        for at in range(1, count + 1):
            client.send(json.dumps({"tool": None, "sequence": at}).encode())
        answers = 1
        while (last := take(client).sequence) < count:
            answers += 1
        assert last == count and answers < count / 4, f"{answers} frames"


def a_replay_makes_the_steps_of_the_recording_again():
    """To the bit: the largest displacement and the force after each step."""
    with server(ROOT / "tests/fixtures/tiny-corrected", "--exact") as (port, token):
        client = RawClient(port, f"/socket?token={token}")
        top = tip_of_the_phantom(client)
        at = 0

        def steps(count: int, tool) -> list[tuple]:
            """What is new after each of the next steps, with the tool at its place after so many of them."""
            nonlocal at
            seen: dict[int, tuple] = {}
            while len(seen) < count + 1:
                at += 1
                now = frame(client, tool(len(seen)), at)
                seen[now.steps] = (now.largest, now.force)
            return list(seen.values())[1:]

        client.send(b'{"reset":true}')
        client.send(b'{"record":true}')
        recorded = steps(30, lambda done: pressing(top, min(0.25 * done, 5.0)))
        client.send(b'{"record":false}')
        assert recorded[-1][0] > 1.0, recorded[-1]
        client.send(b'{"replay":true}')
        replayed = steps(30, lambda done: None)
        # Where a step was not seen because two came between frames, both lists still hold the same states in order.
        moving = [state for state in recorded if state[0] > 0.0]
        again = [state for state in replayed if state[0] > 0.0]
        common = [state for state in moving if state in again]
        assert len(common) >= 15, f"{len(common)} of {len(moving)} states came again"
        order = [again.index(state) for state in common]
        assert order == sorted(order)


def a_drag_moves_the_surface(browser: Browser, bundle: str):
    with server(BUNDLES / bundle) as (port, token):
        browser.open(f"http://127.0.0.1:{port}/?token={token}")
        browser.wait("window.uptView && uptView.shown > 10")
        browser.screenshot(str(PICTURES / f"{bundle}-rest.png"))
        x, y = browser.run("return uptView.middle")
        browser.click("#record")
        browser.wait("uptView.recording")
        browser.drag([(x, y), (x + 10, y), (x + 30, y + 10)], release=False)
        browser.wait("uptView.largest > 2 && uptView.contacts > 0")
        browser.wait("uptView.latency.length > 0")
        browser.screenshot(str(PICTURES / f"{bundle}-pressed.png"))
        assert browser.run("return uptView.force") > 0
        steps = browser.run("return uptView.steps")
        browser.wait(f"uptView.steps > {steps + 60}")
        assert browser.run("return uptView.latency.every((ms) => ms >= 0)")
        surface = json.loads(browser.run("return uptView.gltf()"))
        check_gltf(surface)
        browser.release()
        browser.wait("uptView.contacts == 0")
        browser.click("#record")
        browser.wait("!uptView.recording")
        browser.click("#reset")
        browser.wait("uptView.largest < 0.01")
        browser.click("#replay")
        browser.wait("uptView.replaying && uptView.largest > 2")
        browser.wait("!uptView.replaying")


def check_gltf(surface: dict) -> None:
    """The file holds what it says: as many bytes, indices in range, the stated bounds."""
    data = base64.b64decode(surface["buffers"][0]["uri"].split(",", 1)[1])
    assert len(data) == surface["buffers"][0]["byteLength"]
    positions, _, indices = surface["accessors"]
    places = [surface["bufferViews"][i] for i in range(3)]
    values = struct.unpack_from(f"<{3 * positions['count']}f", data, places[0]["byteOffset"])
    for axis in range(3):
        assert abs(min(values[axis::3]) - positions["min"][axis]) < 1e-6
    numbers = struct.unpack_from(f"<{indices['count']}I", data, places[2]["byteOffset"])
    assert max(numbers) < positions["count"] and indices["count"] % 3 == 0


def a_report_plays_its_first_case(browser: Browser, bundle: str) -> None:
    """The page is one file; the organ in it moves as the solver says, and stands where it is told to."""
    mesh = str(BUNDLES / bundle / "mesh.safetensors")
    material = json.loads((BUNDLES / bundle / "bundle.json").read_text(encoding="utf-8"))["material"]
    with tempfile.TemporaryDirectory() as folder:
        case = os.path.join(folder, "case.trajectory.safetensors")
        simulate = [COMMAND, "simulate", "--mesh", mesh, "--scheme", "4", "--seed", "5", "--out", case]
        simulate += ["--young", str(material["young_pa"]), "--density", str(material["density_kg_m3"])]
        said = subprocess.run(simulate, check=True, capture_output=True, text=True).stdout
        largest = float(re.search(r"largest displacement ([0-9.]+) mm", said)[1])
        report = [STUDY, "report", "--bundle", str(BUNDLES / bundle), "--trajectory", case, "--plain", "zero"]
        report += ["--threads", "1", "--corrections", "3", "--out", folder]
        subprocess.run(report, check=True, capture_output=True)
        text = Path(folder, "report.html").read_text(encoding="utf-8")
        assert not re.search(r"(src|href)=.?https?:", text)
        browser.open(Path(folder, "report.html").as_uri())
        page = "document.querySelector('iframe').contentWindow"
        frames = browser.wait(f"{page}.uptPreview && {page}.uptPreview.frames")
        assert frames == 160, frames
        time_shown = f"{page}.document.getElementById('time').textContent"
        first = browser.wait(time_shown)
        browser.wait(f"{time_shown} !== '{first}'")
        deepest = 0.0
        for frame in range(0, frames, 4):
            browser.run(f"{page}.uptPreview.stopAt({frame})")
            browser.wait(f"{time_shown} === '{frame * 0.05:.2f} s'")
            deepest = max(deepest, browser.run(f"return {page}.uptPreview.deepest()"))
            if frame == 40:
                browser.screenshot(str(PICTURES / f"{bundle}-report.png"))
        # The largest component of any node; the solver's line has the largest length.
        assert 0.55 * largest < deepest < 1.02 * largest, (deepest, largest)


def a_report_of_tools_shows_them(browser: Browser, bundle: str) -> None:
    """The first case plays in tools.html too, and its tool goes where the case says."""
    mesh = str(BUNDLES / bundle / "mesh.safetensors")
    material = json.loads((BUNDLES / bundle / "bundle.json").read_text(encoding="utf-8"))["material"]
    with tempfile.TemporaryDirectory() as folder:
        case = os.path.join(folder, "case.trajectory.safetensors")
        simulate = [COMMAND, "simulate", "--mesh", mesh, "--tool", "two", "--seed", "5", "--out", case]
        simulate += ["--young", str(material["young_pa"]), "--density", str(material["density_kg_m3"])]
        subprocess.run(simulate, check=True, capture_output=True)
        report = [STUDY, "report", "--tools", case, "--bundle", str(BUNDLES / bundle), "--out", folder]
        subprocess.run(report, check=True, capture_output=True)
        browser.open(Path(folder, "tools.html").as_uri())
        page = "document.querySelector('iframe').contentWindow"
        frames = browser.wait(f"{page}.uptPreview && {page}.uptPreview.frames")
        assert browser.run(f"return {page}.uptPreview.tools") == 2
        time_shown = f"{page}.document.getElementById('time').textContent"
        ways, deepest = [], 0.0
        for frame in range(0, frames, 4):
            browser.run(f"{page}.uptPreview.stopAt({frame})")
            browser.wait(f"{time_shown} === '{frame * 0.05:.2f} s'")
            deepest = max(deepest, browser.run(f"return {page}.uptPreview.deepest()"))
            ways.append(browser.run(f"return {page}.uptPreview.place(0)"))
            if frame == frames // 8 * 4:
                browser.run("document.querySelector('iframe').scrollIntoView()")
                browser.screenshot(str(PICTURES / f"{bundle}-tools.png"))
        assert 1.0 < deepest < 20.0, deepest
        # In by 3 mm or more, and out again.
        far = max(math.dist(ways[0], place) for place in ways)
        assert 2.0 < far < 20.0, far


def main() -> int:
    PICTURES.mkdir(parents=True, exist_ok=True)
    tests = [
        only_the_token_opens_the_page,
        the_length_of_a_step_is_asked_for,
        a_socket_of_another_origin_is_refused,
        a_second_client_is_refused_and_the_first_goes_on,
        a_bad_message_closes_its_client_alone,
        a_flood_of_messages_gets_one_answer_for_many,
        a_replay_makes_the_steps_of_the_recording_again,
        a_blade_cuts_and_undo_heals,
        an_organ_breathes_with_what_hangs_on_it,
    ]
    passed = failed = skipped = 0
    try:
        browser = Browser()
    except FileNotFoundError as missing:
        browser = None
        skipped = 1
        print(f"skipped: the page: {missing}")
    runs = [(test.__name__, test) for test in tests]
    if browser:
        runs.append(("a_drag_moves_the_surface", lambda: a_drag_moves_the_surface(browser, "brain-reduced")))
        runs.append(("the_mouse_operates", lambda: the_mouse_operates(browser, BUNDLES / "brain-reduced", PICTURES)))
        runs.append(("the_button_breathes", lambda: the_button_breathes(browser, BUNDLES / "liver-coarse", PICTURES)))
        runs.append(("a_report_plays_its_first_case", lambda: a_report_plays_its_first_case(browser, "liver-coarse")))
        runs.append(("a_report_of_tools_shows_them", lambda: a_report_of_tools_shows_them(browser, "liver-coarse")))
    try:
        for name, test in runs:
            try:
                test()
                passed += 1
                print(f"passed: {name}")
            except Exception:
                failed += 1
                print(f"FAILED: {name}\n{traceback.format_exc()}")
    finally:
        if browser:
            browser.close()
    print(f"{passed} passed, {failed} failed, {skipped} skipped")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
