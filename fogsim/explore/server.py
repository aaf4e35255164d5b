"""A web server for one page and this computer alone: HTTP on the loopback interface, answered in the main thread."""

import json
import queue
import threading
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Future
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl, urlsplit

from fogsim.errors import FogSimError, InputError
from fogsim.explore.answering import Explorer, Question, question

ADDRESS = "127.0.0.1"
"""The loopback interface: no other computer reaches it."""

_USUAL_PORT = 80
"""Browsers leave it out of a page's address."""

_PAGE = {
    "/": ("page.html", "text/html; charset=utf-8"),
    "/page.css": ("page.css", "text/css; charset=utf-8"),
    "/page.js": ("page.js", "text/javascript; charset=utf-8"),
}

_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}
"""The page may ask only the server that it comes from, and no other page may use its answers."""

_Job = tuple[Question, Callable[[], bool], Future[dict[str, Any] | None]]


class PageServer(ThreadingHTTPServer):
    """Serves the page; questions wait in `jobs` until the main thread answers, as methods' time limits need."""

    daemon_threads = True
    # Another program's port must not be shared.
    allow_reuse_port = False

    def __init__(self, port: int = 0) -> None:
        self.jobs: queue.SimpleQueue[_Job] = queue.SimpleQueue()
        self._newest, self._lock = Counter[str](), threading.Lock()
        try:
            super().__init__((ADDRESS, port), _Handler)
        except OSError as error:
            raise InputError(
                f"--port {port}: cannot be used ({error.strerror}); leave --port out for any that is free"
            ) from error
        ports = (f":{self.server_port}", *([""] if self.server_port == _USUAL_PORT else []))
        self.hosts = {f"{name}{port}" for name in (ADDRESS, "localhost") for port in ports}

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{ADDRESS}:{self.server_port}/"

    def ask(self, asked: Question, page: str) -> dict[str, Any] | None:
        """Have a question of a page answered; None if a newer one of the same page came meanwhile."""
        with self._lock:
            self._newest[page] += 1
            number = self._newest[page]
        answer: Future[dict[str, Any] | None] = Future()
        self.jobs.put((asked, lambda: number != self._newest[page], answer))
        return answer.result()


class _Handler(BaseHTTPRequestHandler):
    server: PageServer
    timeout = 60.0  # Of a connection on which nothing comes [s]

    def do_GET(self) -> None:
        """Answer one request."""
        # A page of another site may reach this server under a name of its own (DNS rebinding), or send requests to it.
        if self.headers.get("Host") not in self.server.hosts:
            self._send_json(403, {"error": f"this page is at {self.server.url}"})
            return
        if self.headers.get("Sec-Fetch-Site", "none") not in {"same-origin", "none"}:
            self._send_json(403, {"error": "requests of other sites are refused"})
            return
        address = urlsplit(self.path)
        if address.path in _PAGE:
            name, kind = _PAGE[address.path]
            self._send(200, kind, Path(__file__).with_name("page").joinpath(name).read_bytes())
        elif address.path == "/answer":
            self._answer(address.query)
        else:
            self._send_json(404, {"error": f"there is nothing at {address.path}"})

    def _answer(self, query: str) -> None:
        try:
            given = dict(parse_qsl(query))
            page = given.pop("page", "")
            answer = self.server.ask(question(given), page)
        except FogSimError as error:
            self._send_json(400, {"error": str(error)})
        else:
            self._send_json(200, {"outdated": True} if answer is None else answer)

    def _send_json(self, status: int, content: dict[str, Any]) -> None:
        self._send(status, "application/json", json.dumps(content, allow_nan=False).encode())

    def _send(self, status: int, kind: str, content: bytes) -> None:
        self.send_response(status)
        for name, value in {**_HEADERS, "Content-Type": kind, "Content-Length": str(len(content))}.items():
            self.send_header(name, value)
        self.end_headers()
        try:
            self.wfile.write(content)
        except OSError:
            # The page has been closed.
            self.close_connection = True

    def log_message(self, *_: object) -> None:
        """Log nothing: each move of a slider is a request."""


def serve(server: PageServer, explorer: Explorer) -> None:
    """Answer questions until interrupted; in between the drive is recorded on, so that later moments are ready."""
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        while True:
            try:
                job = server.jobs.get(block=explorer.drive.is_over)
            except queue.Empty:
                explorer.drive.go_on()
            else:
                _do(job, explorer)
    finally:
        server.shutdown()
        server.server_close()


def _do(job: _Job, explorer: Explorer) -> None:
    asked, is_outdated, answer = job
    try:
        answer.set_result(None if is_outdated() else explorer.answer(asked, is_outdated))
    except FogSimError as error:
        answer.set_exception(error)
    except BaseException:
        # The error, or Ctrl-C, is for this thread alone.
        answer.set_result(None)
        raise
