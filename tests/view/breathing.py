"""What holds the organ in `upt view` goes up and down, with a ball that hangs on it: by messages, and by the button."""

from __future__ import annotations

from pathlib import Path

from client import Browser, RawClient
from running import ROOT, TOOL, Frame, frame, server, tip_of_the_phantom


def an_organ_breathes_with_what_hangs_on_it() -> None:
    with server(ROOT / "onnx/liver-coarse") as (port, token):
        client = RawClient(port, f"/socket?token={token}")
        tip_of_the_phantom(client)
        at = 0

        def go(until, tool=None) -> Frame:
            nonlocal at
            for _ in range(4000):
                at += 1
                now = frame(client, tool, at)
                if until(now):
                    return now
            raise AssertionError(now)

        assert go(lambda now: now.steps > 3).height == 0
        client.send(b'{"breathe":true}')
        high = go(lambda now: now.height > 14)
        # The organ lags and swings behind what holds it, the ball hangs on, and no tie tears.
        low = go(lambda now: now.height < 1)
        assert 0 < low.largest < 3 and high.largest < 3 and high.torn == 0, (low, high)
        far = TOOL | {"position": [0.0, 0.0, 900.0]}
        steps = go(lambda now: True).steps
        assert go(lambda now: now.steps > steps + 5, far).torn == 0
        client.send(b'{"breathe":false}')
        assert go(lambda now: now.height == 0).torn == 0
        client.send(b'{"breathe":true}')
        go(lambda now: now.height > 2)
        client.send(b'{"reset":true}')
        assert go(lambda now: now.height == 0).largest < 1e-3


def the_button_breathes(browser: Browser, bundle: Path, pictures: Path) -> None:
    with server(bundle) as (port, token):
        browser.open(f"http://127.0.0.1:{port}/?token={token}")
        browser.wait("window.uptView && uptView.shown > 10")
        browser.click("#breathe")
        browser.wait("uptView.height > 12 && uptView.ball > 0")
        browser.screenshot(str(pictures / f"{bundle.name}-breathes.png"))
        x, y = browser.run("return uptView.middle")
        browser.drag([(x, y), (x + 5, y)], release=False)
        browser.wait("uptView.contacts > 0 && uptView.largest > 2")
        browser.release()
        browser.click("#breathe")
        browser.wait("uptView.height === 0 && uptView.ball === 0")
