"""A static host for pages under test: it compresses nothing and knows ranges, can break off, and can isolate pages."""

from __future__ import annotations

import os
import re
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path


class Files(SimpleHTTPRequestHandler):
    """Says nothing, and notes what it is asked for."""

    sent = 0  # bytes
    asked: list[tuple[str, str | None]] = []  # name of the file, and the range
    breaks: set[str] = set()  # files whose next answer ends in the middle
    may_end = threading.Event()  # and does so when this is set: what has come before may be lost with it

    def log_message(self, *_: object) -> None:
        pass

    def do_GET(self) -> None:
        path = Path(self.translate_path(self.path))
        name = path.name
        Files.asked.append((name, self.headers.get("range")))
        wanted = re.fullmatch(r"bytes=(\d+)-", self.headers.get("range", ""))
        if not path.is_file() or (not wanted and name not in Files.breaks):
            super().do_GET()
            return
        data = path.read_bytes()
        first = int(wanted[1]) if wanted else 0
        self.send_response(206 if wanted else 200)
        self.send_header("Content-Type", self.guess_type(str(path)))
        self.send_header("Content-Length", str(len(data) - first))
        if wanted:
            self.send_header("Content-Range", f"bytes {first}-{len(data) - 1}/{len(data)}")
        self.end_headers()
        breaks = name in Files.breaks
        end = (first + len(data)) // 2 if breaks else len(data)
        Files.sent += end - first
        self.wfile.write(data[first:end])
        if breaks:
            Files.breaks.remove(name)
            Files.may_end.wait(60)
            self.close_connection = True

    def end_headers(self) -> None:
        # What is asked for is the page's choice, not that of the browser's cache, which keeps files by their age.
        self.send_header("Cache-Control", "no-store")
        super().end_headers()

    def copyfile(self, source, outputfile) -> None:
        Files.sent += os.fstat(source.fileno()).st_size
        super().copyfile(source, outputfile)


class Isolated(Files):
    """Its pages may share memory with their workers."""

    def end_headers(self) -> None:
        self.send_header("Cross-Origin-Opener-Policy", "same-origin")
        self.send_header("Cross-Origin-Embedder-Policy", "require-corp")
        super().end_headers()


def serve(folder: str, kind: type[Files] = Files) -> tuple[ThreadingHTTPServer, str]:
    """A host of a folder, in a thread, and its address."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(kind, directory=folder))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return server, f"http://127.0.0.1:{server.server_address[1]}/"
