"""A study is watched while it runs: the page is served to this machine alone, and follows the finished runs."""

import http.client
import json
import re
import signal
import socket
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path

import pytest

import tuckerl
from tests.cli.test_train import status_of
from tests.studies.comparisons import SMALL
from tuckerl.cli.compare import config_of
from tuckerl.reports import watch_server
from tuckerl.reports.watch_server import WatchServer
from tuckerl.reports.watched import page_of, stamp_of

watching = import_module("tuckerl.cli.watch")  # the package has the command of this name

STUDY = """
runs = 3
episodes = 5
[[problem]]
env = "FrozenLake-v1"
name = "<b>lake</b>"
[[algorithm]]
algorithm = "q-learning"
"""


def fetched(port: int, path: str = "/", method: str = "GET", host: str = "") -> tuple[int, str]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    connection.request(method, path, headers={"Host": host or f"127.0.0.1:{port}"})
    answer = connection.getresponse()
    return answer.status, answer.read().decode()


def until(holds: Callable[[], bool]) -> None:
    end = time.monotonic() + 60
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.05)


def test_the_page_follows_the_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(watching, "_SECONDS_BETWEEN_LOOKS", 0.1)
    monkeypatch.setattr(watching, "_SHARE", 1.0)
    study, lake, ports = tuckerl.Study.from_text(STUDY), tmp_path / "lake", list[int]()
    study.run(lake, workers=1, runs=1)
    before = {path: path.read_bytes() for path in lake.rglob("*") if path.is_file()}

    def look() -> None:
        try:
            until(lambda: bool(ports))
            (port,) = ports
            until(lambda: "2 runs of 3 are not finished yet" in fetched(port)[1])
            assert {path: path.read_bytes() for path in lake.rglob("*") if path.is_file()} == before
            page, version = fetched(port)[1], fetched(port, "/version")[1]
            assert f"<script data-version='{version}'>" in page
            assert "&lt;b&gt;lake&lt;/b&gt;" in page
            assert "<b>lake</b>" not in page
            study.run(lake, workers=1)
            until(lambda: fetched(port, "/version")[1] != version)
            until(lambda: "not finished yet" not in fetched(port)[1])  # the last two are stored one after the other
        finally:
            signal.raise_signal(signal.SIGINT)

    def made(port: int) -> WatchServer:
        server = WatchServer(port)
        ports.append(server.port)
        return server

    monkeypatch.setattr(watch_server, "WatchServer", made)
    with ThreadPoolExecutor(1) as others:
        looked = others.submit(look)
        assert status_of("watch", str(lake)) == 0
        looked.result()
    assert capsys.readouterr() == (
        f"Watching {lake} at http://127.0.0.1:{ports[0]}/ (Ctrl-C ends it)\nNot watched any more.\n",
        "",
    )


def test_nothing_but_the_page_is_served(tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    page.write_text(
        '<meta http-equiv="Content-Security-Policy" content="script-src \'sha256-x\' ; img-src data:"></body>'
    )
    with WatchServer() as server:
        server.show(page)
        status, text = fetched(server.port)
        assert status == 200
        assert re.search(r"content=\"connect-src 'self'; script-src 'sha256-[\w+/]+=*' 'sha256-x'", text)
        for path in ("/report.html", "/../report.html", "/version/", "/%2e%2e/", "/figures/curves-1.svg"):
            assert fetched(server.port, path)[0] == 404
        for method in ("HEAD", "POST", "PUT", "DELETE", "OPTIONS"):
            assert fetched(server.port, "/", method)[0] == 405
        for host in ("example.org", f"example.org:{server.port}", "127.0.0.1", "127.0.0.1:1"):
            assert fetched(server.port, host=host)[0] == 403
            assert fetched(server.port, "/version", host=host)[0] == 403
        assert fetched(server.port, host=f"localhost:{server.port}")[0] == 200


def test_a_browser_that_goes_away_is_no_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = tmp_path / "report.html"
    page.write_text("x" * 20_000_000)
    with WatchServer() as server:
        server.show(page)
        with socket.create_connection(("127.0.0.1", server.port)) as gone:
            gone.sendall(f"GET / HTTP/1.0\r\nHost: 127.0.0.1:{server.port}\r\n\r\n".encode())
            assert gone.recv(1)
        until(lambda: not any("process_request" in thread.name for thread in threading.enumerate()))
        assert fetched(server.port, "/version")[0] == 200
    assert capsys.readouterr().err == ""


def test_the_port_that_browsers_do_not_name_is_answered(tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    page.write_text("</body>")
    with WatchServer() as server:
        server.show(page)
        real, server.port = server.port, 80
        assert fetched(real, host="127.0.0.1")[0] == 200
        assert fetched(real, host="example.org")[0] == 403


@pytest.mark.slow
def test_a_comparison_is_watched_by_its_request(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    small = [part for key, value in SMALL.items() for part in ("--env-set", f"{key}={value}")]
    words = [
        "compare",
        "sarsa",
        "q-learning",
        "--env",
        "tuckerl/DynaMaze-v0",
        *small,
        "--episodes",
        "5",
        "--out",
        "maze",
    ]
    words += ["--set", "epsilon=Linear(0.2,0,4)", "--workers", "1", "--runs"]
    assert status_of(*words, "2") == 0
    write = page_of(Path("maze"), config_of)
    text = write(tmp_path / "page").read_text()
    assert "2 runs" in text
    assert text == Path("maze/report.html").read_text()
    stamp = stamp_of(Path("maze"))
    assert status_of(*words, "3") == 0
    assert stamp_of(Path("maze")) != stamp
    assert "3 runs" in page_of(Path("maze"), config_of)(tmp_path / "page").read_text()


@pytest.mark.parametrize(
    ("folder", "message"),
    [
        ("nowhere", "there is no folder nowhere: name that of a `study run`, a `reproduce` or a `compare`"),
        ("study.toml", "study.toml is a file: name the folder that its study is run into, as `--out` gave it"),
        ("empty", "empty holds no study, as neither study.toml nor study.json is in it"),
        ("torn", "cannot read torn/study.json"),
        ("old", "written by an older or newer tuckerl, in format 1 and not 2"),
        ("tuned", "tuned holds a study of lake, but neither study.toml nor request.json"),
        ("part", "a part of a reproduction (scenarios.dyna-maze"),
        ("wrong", "unknown algorithm 'nobody'"),
        ("other", "other/request.json lacks something: give the `tuckerl compare` again that made it"),
    ],
)
def test_other_folders_are_refused_in_one_sentence(
    folder: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    maze = {"environment": {}, "instances": 1, "runs": 1, "episodes": 1, "variants": {"mine": {}}}
    request: dict[str, object] = {
        "base": "nobody",
        "candidate": "sarsa",
        "env": "FrozenLake-v1",
        "settings": [],
        "env_settings": [],
    }
    request |= {"measure": "return", "agents": None, "runs": 1, "episodes": 1, "seed": 0}
    studies = {
        "empty": None,
        "torn": "{",
        "old": json.dumps({"format": 1, "seed": 0, "scenarios": {"dyna-maze": maze}}),
        "tuned": json.dumps({"format": 2, "seed": 0, "scenarios": {"lake": maze}}),
        "part": json.dumps({"format": 2, "seed": 0, "scenarios": {"dyna-maze": maze}}),
        "wrong": "{}",
        "other": "{}",
    }
    for name, content in studies.items():
        Path(name).mkdir()
        if content is not None:
            (Path(name) / "study.json").write_text(content)
    Path("study.toml").write_text(STUDY)
    Path("wrong/request.json").write_text(json.dumps(request))
    Path("other/request.json").write_text("{}")
    assert status_of("watch", folder) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert message in err


def test_a_port_that_is_taken_or_none_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "study.toml").write_text(STUDY)
    with WatchServer() as server:
        assert status_of("watch", str(tmp_path), "--port", str(server.port)) == 2
        assert "leave --port out for a free one" in capsys.readouterr().err
    assert status_of("watch", str(tmp_path), "--port", "70000") == 2
    assert "port must be a whole number from 0 to 65535; got 70000" in capsys.readouterr().err
