"""The two ways in: a plain WebSocket client that may misbehave, and a browser by the WebDriver protocol."""

from __future__ import annotations

import base64
import glob
import json
import os
import select
import shutil
import socket
import struct
import subprocess
import time
import urllib.error
import urllib.request


class Refused(Exception):
    """The server answered the handshake with something else than a WebSocket."""


class RawClient:
    """A WebSocket over a bare socket; frames are sent as they are told, right or wrong."""

    def __init__(self, port: int, target: str, origin: str | None = "same", host: str | None = None) -> None:
        own = f"127.0.0.1:{port}"
        lines = [f"GET {target} HTTP/1.1", f"Host: {host or own}", "Upgrade: websocket", "Connection: Upgrade"]
        lines += [f"Sec-WebSocket-Key: {base64.b64encode(os.urandom(16)).decode()}", "Sec-WebSocket-Version: 13"]
        if origin:
            lines.append(f"Origin: {f'http://{own}' if origin == 'same' else origin}")
        self.told: list[tuple[dict, bytes]] = []  # what came before frames
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=30)
        self.socket.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        self.data = b""
        head = self._until(b"\r\n\r\n").decode()
        if " 101 " not in head.split("\r\n")[0]:
            self.socket.close()
            raise Refused(head.split("\r\n")[0])

    def _until(self, mark: bytes) -> bytes:
        while mark not in self.data:
            more = self.socket.recv(65536)
            if not more:
                break
            self.data += more
        head, _, self.data = self.data.partition(mark)
        return head

    def _take(self, count: int) -> bytes:
        while len(self.data) < count:
            more = self.socket.recv(65536)
            if not more:
                raise ConnectionError("closed")
            self.data += more
        taken, self.data = self.data[:count], self.data[count:]
        return taken

    def read(self) -> tuple[int, bytes]:
        """Opcode and payload of the next frame."""
        first, second = self._take(2)
        length = second & 0x7F
        if length == 126:
            (length,) = struct.unpack(">H", self._take(2))
        elif length == 127:
            (length,) = struct.unpack(">Q", self._take(8))
        return first & 0x0F, self._take(length)

    def send(self, payload: bytes, opcode: int = 1, masked: bool = True, length: int | None = None) -> None:
        size = len(payload) if length is None else length
        mask = os.urandom(4) if masked else b""
        bit = 0x80 if masked else 0
        if size < 126:
            head = struct.pack(">BB", 0x80 | opcode, bit | size)
        elif size < 65536:
            head = struct.pack(">BBH", 0x80 | opcode, bit | 126, size)
        else:
            head = struct.pack(">BBQ", 0x80 | opcode, bit | 127, size)
        body = bytes(b ^ mask[i % 4] for i, b in enumerate(payload)) if masked else payload
        self.socket.sendall(head + mask + body)

    def closes(self) -> bool:
        """Whether the server ends the connection, whatever it still had to say."""
        try:
            while True:
                opcode, _ = self.read()
                if opcode == 8:
                    return True
        except (ConnectionError, OSError) as error:
            return not isinstance(error, TimeoutError)

    def close(self) -> None:
        self.socket.close()


def drawing() -> list[str]:
    """How 3D is drawn without a graphics card: by Mesa where it is there, twice as fast as Chromium's SwiftShader."""
    if glob.glob("/usr/lib/*/libEGL_mesa.so.0") and glob.glob("/usr/lib/*/dri/swrast_dri.so"):
        return ["--use-gl=angle", "--use-angle=gl-egl", "--ignore-gpu-blocklist", "--disable-gpu-compositing"]
    return ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


class Mouse:
    """The mouse by Chromium's own protocol, as real ones are: events come when they come, whether or not the page has
    had the last one. (WebDriver sends the next one only then, which ties the mouse to the page's pictures.)"""

    def __init__(self, port: int, target: str) -> None:
        self.client = RawClient(port, target, origin=None)
        self.client.socket.settimeout(None)
        self.sent = 0

    def event(self, kind: str, x: float, y: float, held: bool = True) -> None:
        """`mousePressed`, `mouseMoved` or `mouseReleased` at a place of the page, in pixels."""
        self.sent += 1
        button = {"button": "left", "buttons": int(held), "clickCount": int(kind != "mouseMoved")}
        event = {"type": kind, "x": x, "y": y} | button
        call = {"id": self.sent, "method": "Input.dispatchMouseEvent", "params": event}
        self.client.send(json.dumps(call).encode())
        while select.select([self.client.socket], [], [], 0.0)[0]:
            self.client.read()

    def close(self) -> None:
        self.client.close()


class Browser:
    """Headless Chromium by chromedriver."""

    def __init__(self, width: int = 1000, height: int = 700, phone: bool = False) -> None:
        driver = shutil.which("chromedriver")
        browser = shutil.which("chromium") or shutil.which("google-chrome")
        if not driver or not browser:
            raise FileNotFoundError("chromium and chromium-driver are needed")
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        command = [driver, f"--port={self.port}"]
        self.driver = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.STDOUT)
        arguments = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars"]
        arguments += [*drawing(), f"--window-size={width},{height}"]
        options: dict = {"binary": browser, "args": arguments}
        self.pointer = "touch" if phone else "mouse"
        if phone:
            metrics = {"width": width, "height": height, "pixelRatio": 2, "touch": True, "mobile": True}
            options["mobileEmulation"] = {"deviceMetrics": metrics}
        wanted = {"capabilities": {"alwaysMatch": {"goog:chromeOptions": options}}}
        for _ in range(100):
            try:
                made = self._call("POST", "/session", wanted)
                break
            except (urllib.error.URLError, ConnectionError):
                time.sleep(0.1)
        else:
            raise RuntimeError("chromedriver does not answer")
        self.session = made["sessionId"]
        self.debugger = made["capabilities"]["goog:chromeOptions"]["debuggerAddress"]

    def _call(self, method: str, path: str, body: object = None) -> object:
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(f"http://127.0.0.1:{self.port}{path}", data, method=method)
        request.add_header("Content-Type", "application/json")
        with urllib.request.urlopen(request, timeout=120) as answer:
            return json.load(answer)["value"]

    def open(self, address: str) -> None:
        self._call("POST", f"/session/{self.session}/url", {"url": address})

    def run(self, script: str) -> object:
        return self._call("POST", f"/session/{self.session}/execute/sync", {"script": script, "args": []})

    def wait(self, condition: str, seconds: float = 240) -> object:
        """The value of a JavaScript expression once it is true."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            value = self.run(f"return {condition}")
            if value:
                return value
            time.sleep(0.05)
        short = "(_, value) => (Array.isArray(value) ? value.slice(0, 3) : value)"
        state = self.run(f"return JSON.stringify(window.uptView, {short})")
        raise TimeoutError(f"{condition}: {state}")

    def drag(self, points: list[tuple[int, int]], release: bool) -> None:
        """The left button pressed at the first point, moved through the others, 100 ms each."""
        move = self._moves(points)
        actions = [move[0], {"type": "pointerDown", "button": 0}, *move[1:]]
        if release:
            actions.append({"type": "pointerUp", "button": 0})
        self._act(actions)

    def move(self, points: list[tuple[int, int]], each_ms: int = 100) -> None:
        """On through more points with the button as it is, so many milliseconds each."""
        self._act(self._moves(points, each_ms))

    def _moves(self, points: list[tuple[int, int]], each_ms: int = 100) -> list[dict]:
        return [{"type": "pointerMove", "duration": each_ms, "x": x, "y": y, "origin": "viewport"} for x, y in points]

    def _act(self, actions: list[dict]) -> None:
        mouse = {"type": "pointer", "id": "mouse", "parameters": {"pointerType": self.pointer}, "actions": actions}
        self._call("POST", f"/session/{self.session}/actions", {"actions": [mouse]})

    def release(self) -> None:
        self._call("DELETE", f"/session/{self.session}/actions")

    def click(self, selector: str) -> None:
        self.run(f"document.querySelector({json.dumps(selector)}).click()")

    def screenshot(self, path: str) -> None:
        with open(path, "wb") as file:
            file.write(base64.b64decode(self._call("GET", f"/session/{self.session}/screenshot")))

    def mouse(self) -> Mouse:
        """A mouse that waits for nothing, on the page that is open."""
        with urllib.request.urlopen(f"http://{self.debugger}/json/list", timeout=30) as answer:
            page = next(target for target in json.load(answer) if target["type"] == "page")
        address = page["webSocketDebuggerUrl"].removeprefix("ws://")
        place, path = address.split("/", 1)
        return Mouse(int(place.rsplit(":", 1)[1]), "/" + path)

    def close(self) -> None:
        try:
            self._call("DELETE", f"/session/{self.session}")
        finally:
            self.driver.terminate()
            self.driver.wait()
