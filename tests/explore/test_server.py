"""The server of ``fogsim explore``: for this computer and its own page alone."""

import http.client
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest
from early_motorway import EARLY

from fogsim.cli.explore import explore_command
from fogsim.errors import InputError
from fogsim.explore import server as module
from fogsim.explore.answering import Question
from fogsim.explore.server import PageServer

Response = tuple[int, Mapping[str, str], str]


@pytest.fixture
def server() -> Iterator[PageServer]:
    server = PageServer()
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    yield server
    server.shutdown()
    thread.join()
    server.server_close()


def get(server: PageServer, path: str = "/", **headers: str) -> Response:
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=10)
    connection.request("GET", path, headers={name.replace("_", "-"): value for name, value in headers.items()})
    response = connection.getresponse()
    found = response.status, dict(response.getheaders()), response.read().decode()
    connection.close()
    return found


def test_it_listens_on_the_loopback_interface_alone(server: PageServer) -> None:
    assert server.socket.getsockname()[0] == "127.0.0.1"
    assert server.url == f"http://127.0.0.1:{server.server_port}/"


@pytest.mark.parametrize("path", ["/", "/page.css", "/page.js"])
def test_the_page_names_no_other_place_and_may_ask_none(server: PageServer, path: str) -> None:
    status, headers, text = get(server, path)
    assert status == 200
    assert "//" not in text.replace("// ", "").replace("data:,", "")
    policy = dict(part.strip().partition(" ")[::2] for part in headers["Content-Security-Policy"].split(";"))
    assert policy["default-src"] == policy["form-action"] == policy["frame-ancestors"] == "'none'"
    assert {policy["script-src"], policy["style-src"], policy["connect-src"]} == {"'self'"}
    assert headers["Cache-Control"] == "no-store"
    assert headers["X-Content-Type-Options"] == "nosniff"


def test_other_sites_get_nothing(server: PageServer) -> None:
    # A name of another site that leads here (DNS rebinding), and a page of another site that asks here.
    for headers in (
        {"Host": "evil.example"},
        {"Host": f"evil.example:{server.server_port}"},
        {"Sec_Fetch_Site": "cross-site"},
    ):
        for path in ("/", "/answer?time=1"):
            status, _, text = get(server, path, **headers)
            assert status == 403, headers
            assert "<html" not in text
    assert get(server, Host=f"localhost:{server.server_port}", Sec_Fetch_Site="same-origin")[0] == 200
    assert server.jobs.empty()


def test_what_is_not_there_and_what_is_wrong_is_said(server: PageServer) -> None:
    status, _, text = get(server, "/../server.py")
    assert (status, text) == (404, '{"error": "there is nothing at /../server.py"}')
    status, _, text = get(server, "/answer?vis=80")
    assert status == 400
    assert "unknown vis" in text


def test_questions_are_given_up_for_newer_ones_of_the_same_page(server: PageServer) -> None:
    jobs = []
    for page in ("one", "other", "one"):
        threading.Thread(target=server.ask, args=(Question(), page)).start()
        jobs.append(server.jobs.get())
    assert [is_outdated() for _, is_outdated, _ in jobs] == [True, False, False]
    for *_, answer in jobs:
        answer.set_result(None)


def test_at_the_usual_port_browsers_name_none(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
    monkeypatch.setattr(module, "_USUAL_PORT", port)
    server = PageServer(port)
    assert {"127.0.0.1", f"127.0.0.1:{port}", "localhost"} <= server.hosts
    server.server_close()


def test_ctrl_c_during_an_answer_is_for_the_main_thread_alone() -> None:
    class Interrupted:
        def answer(self, *_: object) -> None:
            raise KeyboardInterrupt

    server, answer = PageServer(), Future[dict[str, Any] | None]()
    server.jobs.put((Question(), lambda: False, answer))
    with pytest.raises(KeyboardInterrupt):
        module._do(server.jobs.get(), Interrupted())  # type: ignore[arg-type]
    assert answer.result(timeout=0) is None
    server.server_close()


def test_mistakes_are_told_before_the_drive() -> None:
    with pytest.raises(InputError, match="did you mean 'motorway_fog_bank'"):
        explore_command("motorway_fog_bnk")
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(InputError, match=rf"--port {port}: cannot be used \(Address already in use\); leave"):
            explore_command("motorway_fog_bank", port=port)
    with pytest.raises(InputError, match="renderer: none draws no frames"):
        explore_command("motorway_fog_bank", port=port, settings=["renderer=none", "estimators=[]"])
    socket.create_server(("127.0.0.1", port)).close()
    with pytest.raises(InputError, match=r"--at 60: the run ends after 0\.2 s \(time\)"):
        explore_command("motorway_fog_bank", at=60.0, settings=[EARLY, "duration_s=0.2"])


def test_it_answers_until_ctrl_c(tmp_path: Path) -> None:
    small = [EARLY, "renderer=cpu", "camera.width=160", "camera.height=120"]
    command = [sys.executable, "-m", "fogsim", "explore", "motorway_fog_bank", "--at", "0.5", "--no-browser"]
    command += [f"--set={one}" for one in small]
    with subprocess.Popen(
        command,
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "COLUMNS": "200"},
    ) as process:
        port = int(process.stdout.readline().partition("http://127.0.0.1:")[2].partition("/")[0])
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
        connection.request("GET", "/answer?time=0.5&visibility=80")
        assert b'"visibility": 80.0' in connection.getresponse().read()
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=20)
    assert process.returncode == 130
    assert errors.endswith("interrupted\n")
    assert "Traceback" not in errors
    assert list(tmp_path.iterdir()) == []
