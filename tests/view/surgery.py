"""A blade, an aspirator and a coagulator in `upt view`: by its messages, and by the mouse."""

from __future__ import annotations

import json
import struct
from collections import Counter
from pathlib import Path

from client import Browser, RawClient
from running import ROOT, TOOL, Frame, frame, server, tip_of_the_phantom


def edges_balance(corners: list[tuple[int, int, int]]) -> bool:
    """A closed, oriented surface has each edge as often in one direction as in the other."""
    edges: Counter = Counter()
    for a, b, c in corners:
        if a == b:
            continue
        for start, end in ((a, b), (b, c), (c, a)):
            edges[min(start, end), max(start, end)] += 1 if start < end else -1
    return not any(edges.values())


class Surface:
    """What a page keeps of the surface."""

    def __init__(self) -> None:
        self.corners: list[tuple[int, int, int]] = []
        self.inside: list[int] = []
        self.vertices = 0
        self.hardened = 0

    def take(self, said: dict, data: bytes) -> None:
        news = said["surface"]
        added, changed = news["vertices"] - news["first_vertex"], news["changed"]
        assert len(data) == 4 * (4 * added + 5 * changed + news["hardened"]), said
        at = 16 * added
        slots = struct.unpack_from(f"<{changed}I", data, at)
        corners = struct.unpack_from(f"<{3 * changed}I", data, at + 4 * changed)
        inside = struct.unpack_from(f"<{changed}I", data, at + 16 * changed)
        if news["is_new"]:
            self.corners, self.inside = [], []
        self.corners += [(0, 0, 0)] * (news["slots"] - len(self.corners))
        self.inside += [0] * (news["slots"] - len(self.inside))
        for i, slot in enumerate(slots):
            self.corners[slot] = corners[3 * i : 3 * i + 3]
            self.inside[slot] = inside[i]
        self.vertices, self.hardened = news["vertices"], news["hardened"]
        assert edges_balance(self.corners), "the surface is open"


def upright(top: list[float], aside: float, depth: float, **fields) -> dict:
    """A tool on its axis, its tip so deep below the upper side and so far from its middle."""
    x, y, z = top
    tool = TOOL | {"rotation": [0.70710678, 0, 0, 0.70710678]} | fields
    return tool | {"position": [x + aside, y, z + tool["half_length"] + tool["radius"] - depth]}


def a_blade_cuts_and_undo_heals():
    with server(ROOT / "tests/fixtures/tiny-corrected", "--exact") as (port, token):
        client = RawClient(port, f"/socket?token={token}")
        top = tip_of_the_phantom(client)
        surface, at = Surface(), 0

        def go(tool, until) -> Frame:
            """Frames with the tool at its place in each step, until one is as it should be."""
            nonlocal at
            begun, done = None, 0
            for _ in range(3000):
                at += 1
                now = frame(client, tool(done), at)
                begun = now.steps if begun is None else begun
                done = now.steps - begun
                for said, data in client.told:
                    assert "surface" in said, said
                    surface.take(said, data)
                client.told.clear()
                assert now.places == surface.vertices or not surface.vertices, (now, surface.vertices)
                if until(now):
                    return now
            raise AssertionError(f"never: {now}")

        blade = {"kind": "blade", "radius": 1.5}
        cut = go(
            lambda done: upright(top, min(0.6 * done - 9, 9), 12, **blade),
            lambda now: now.area > 150 and any(now.force),
        )
        assert cut.copies > 0 and cut.undos == 1, cut
        gone = go(lambda done: None, lambda now: now.force == (0, 0, 0))
        # What a step has changed is told before the next frame.
        assert sum(surface.inside) > 3, (surface.inside, cut)
        suck = {"kind": "aspirator", "radius": 4}
        less = go(lambda done: upright(top, 0, 5, **suck), lambda now: now.removed > 20)
        assert less.undos == 2 and less.area == gone.area, less
        go(lambda done: None, lambda now: True)
        hard = {"kind": "coagulator", "radius": 12}
        go(lambda done: upright(top, 5, 5, **hard), lambda now: surface.hardened > 0)
        # Each undo is the body before its stroke, the last one the intact body.
        for undos, area, removed in ((2, cut.area, less.removed), (1, cut.area, 0), (0, 0, 0)):
            client.send(b'{"undo":true}')
            back = go(lambda done: None, lambda now, undos=undos: now.undos == undos)
            assert back.area >= area and back.removed >= removed, (back, area, removed)
        assert back.copies == back.area == back.removed == surface.hardened == sum(surface.inside) == 0, back
        # The intact body steps on.
        steps = back.steps
        go(lambda done: None, lambda now: now.steps > steps + 3)
        # A press tears nothing, unless that is asked for.
        steps = back.steps
        deep = go(lambda done: upright(top, 0, min(done, 12), radius=2), lambda now: now.steps > steps + 40)
        assert deep.area == 0, deep
        client.send(b'{"tear":1.2}')
        torn = go(lambda done: upright(top, 0, 12, radius=2), lambda now: now.area > 0 and now.copies > 0)
        assert torn.undos == 1, torn
        go(lambda done: None, lambda now: True)
        client.send(b'{"tear":0}')
        client.send(b'{"undo":true}')
        go(lambda done: None, lambda now: now.area == 0 and now.undos == 0)


# Pictures whose button of undo says something else than the frame: a click on it does nothing then.
STALE = """
uptView.stale = 0;
(function look() {
  if (uptView.undos > 0 === document.getElementById("undo").disabled) uptView.stale += 1;
  requestAnimationFrame(look);
})()"""


def the_mouse_operates(browser: Browser, bundle: Path, pictures: Path) -> None:
    with server(bundle) as (port, token):
        browser.open(f"http://127.0.0.1:{port}/?token={token}")
        browser.wait("window.uptView && uptView.shown > 10")
        x, y = browser.run("return uptView.middle")
        before = browser.run("return uptView.surfaces")
        browser.run(STALE)
        browser.click("[data-kind=blade]")
        browser.drag([(x - 45, y - 10), (x - 44, y - 10)], release=False)
        browser.move([(x - 44, y - 10)] * 4)
        browser.move([(x - 44 + 6 * i, y - 10 + i) for i in range(16)])
        browser.wait("uptView.copies > 10 && uptView.area > 100")
        browser.release()
        # On a slow machine the whole way of the blade may be one change.
        browser.wait(f"uptView.surfaces > {before}")
        browser.screenshot(str(pictures / f"{bundle.name}-cut.png"))
        browser.click("[data-kind=press]")
        browser.run("document.getElementById('radius').value = 3")
        browser.drag([(x - 10, y + 6), (x - 10, y + 14), (x - 10, y + 22)], release=False)
        browser.wait("uptView.largest > 2 && uptView.contacts > 0")
        # Of the whole way of the blade, whose last step may have been on its way when it was let go.
        area = browser.run("return uptView.area")
        browser.screenshot(str(pictures / f"{bundle.name}-opened.png"))
        browser.release()
        browser.click("[data-kind=aspirator]")
        browser.run("document.getElementById('radius').value = 6")
        browser.drag([(x + 10, y - 30), (x + 11, y - 30)], release=False)
        browser.wait("uptView.removed > 300")
        browser.screenshot(str(pictures / f"{bundle.name}-aspirated.png"))
        browser.release()
        browser.wait("uptView.undos === 2")
        browser.click("[data-kind=coagulator]")
        browser.drag([(x - 20, y + 40), (x - 5, y + 40)], release=False)
        browser.wait("uptView.undos === 3")
        browser.release()
        surface = json.loads(browser.run("return uptView.gltf()"))
        assert surface["accessors"][2]["count"] % 3 == 0
        browser.screenshot(str(pictures / f"{bundle.name}-operated.png"))
        for undos in (2, 1, 0):
            browser.click("#undo")
            browser.wait(f"uptView.undos === {undos}")
            assert browser.run("return uptView.area") == (area if undos else 0)
        assert browser.run("return uptView.copies + uptView.removed") == 0
        browser.wait("document.getElementById('undo').disabled")
        browser.click("[data-kind=press]")
        browser.click("#tear")
        browser.run("document.getElementById('radius').value = 1; document.getElementById('depth').value = 12")
        browser.drag([(x - 10, y + 6), (x - 8, y + 8)], release=False)
        browser.wait("uptView.area > 0 && uptView.undos === 1")
        browser.screenshot(str(pictures / f"{bundle.name}-torn.png"))
        browser.release()
        browser.click("#undo")
        browser.wait("uptView.area === 0")
        assert browser.run("return uptView.stale") == 0
