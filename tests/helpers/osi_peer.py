"""A stand-in for a controller in a process of its own."""

import contextlib
import socketserver
import struct
import threading
from collections.abc import Callable, Iterable, Iterator

Answer = Callable[[bytes], Iterable[bytes] | None]
"""From the content of a message to what is sent, part by part; None closes the connection."""


class _Server(socketserver.ThreadingTCPServer):
    daemon_threads = True


@contextlib.contextmanager
def osi_peer(answer: Answer) -> Iterator[int]:
    """Port on which messages are answered."""

    class Peer(socketserver.StreamRequestHandler):
        def handle(self) -> None:
            with contextlib.suppress(ConnectionError):
                while length := self.rfile.read(4):
                    parts = answer(self.rfile.read(*struct.unpack("<L", length)))
                    if parts is None:
                        return
                    for part in parts:
                        self.wfile.write(part)

    with _Server(("127.0.0.1", 0), Peer) as server:
        serving = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        serving.start()
        try:
            yield server.server_address[1]
        finally:
            server.shutdown()
            serving.join()


def framed(content: bytes) -> bytes:
    """A message after its length."""
    return struct.pack("<L", len(content)) + content
