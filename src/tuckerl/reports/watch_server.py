"""A report served on the loopback address while its study runs: one page, which renews itself in place."""

import base64
import hashlib
import re
import sys
import threading
from http import HTTPStatus
from http.client import HTTP_PORT  # which browsers leave out of the name that they ask for
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from tuckerl.checks import check_int
from tuckerl.errors import OutputError

_LOOPBACK = "127.0.0.1"
_NAMES = (_LOOPBACK, "localhost")  # a page elsewhere whose name leads here is not answered
_SCRIPT = (Path(__file__).parent / "scripts" / "watch.js").read_text("utf-8")
_HEADERS = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
}


class _Server(ThreadingHTTPServer):
    """Answers each request in a thread, for which nobody waits."""

    daemon_threads = True

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of a browser that has gone before it had its answer."""
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)


class WatchServer:
    """Serves one page on 127.0.0.1 from a thread of its own, until its block is left.

    ``/`` is the page, ``/version`` a word that changes with it, and there is nothing else.

    Parameters
    ----------
    port : int
        0 for any that is free.

    Raises
    ------
    ParameterError, ParameterTypeError
        If that is no port.
    OutputError
        If it is taken.
    """

    def __init__(self, port: int = 0) -> None:
        check_int("port", port, 0, 65535)
        self._shown = b"", ""  # the page and its version, changed at once
        try:
            self._server = _Server((_LOOPBACK, port), self._handler())
        except OSError as error:
            raise OutputError(
                f"cannot serve on port {port} of {_LOOPBACK}: {error.strerror}; leave --port out for a free one"
            ) from error
        self.port: int = self._server.server_address[1]
        self._thread = threading.Thread(target=self._server.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True)

    @property
    def address(self) -> str:
        """Where the page is."""
        return f"http://{_LOOPBACK}:{self.port}/"

    def show(self, page: Path) -> None:
        """Serve what stands in a file now, with the script that renews it."""
        content = page.read_text("utf-8")
        version = hashlib.sha256(content.encode()).hexdigest()
        self._shown = renewing(content, version).encode(), version

    def __enter__(self) -> "WatchServer":
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def _handler(self) -> type[BaseHTTPRequestHandler]:
        served = self

        class Handler(BaseHTTPRequestHandler):
            server_version, sys_version = "tuckerl", ""

            def do_GET(self) -> None:  # the name that http.server calls
                hosts = _NAMES if served.port == HTTP_PORT else [f"{name}:{served.port}" for name in _NAMES]
                if self.headers.get("Host") not in hosts:
                    self._answer(HTTPStatus.FORBIDDEN, f"ask for {served.address}".encode())
                elif self.path == "/":
                    self._answer(HTTPStatus.OK, served._shown[0], "text/html; charset=utf-8")
                elif self.path == "/version":
                    self._answer(HTTPStatus.OK, served._shown[1].encode())
                else:
                    self._answer(HTTPStatus.NOT_FOUND, b"there is only the page")

            def _refuse(self) -> None:
                self._answer(HTTPStatus.METHOD_NOT_ALLOWED, b"only GET is answered")

            do_HEAD = do_POST = do_PUT = do_PATCH = do_DELETE = do_OPTIONS = _refuse  # noqa: N815

            def _answer(self, status: HTTPStatus, content: bytes, kind: str = "text/plain; charset=utf-8") -> None:
                self.send_response(status)
                allow = {"Allow": "GET"} if status == HTTPStatus.METHOD_NOT_ALLOWED else {}
                for name, value in (_HEADERS | allow).items():
                    self.send_header(name, value)
                self.send_header("Content-Type", kind)
                self.send_header("Content-Length", str(len(content)))
                self.end_headers()
                if self.command != "HEAD":
                    self.wfile.write(content)

            def log_message(self, *message: Any) -> None:
                """Say nothing of single requests."""

        return Handler


def renewing(page: str, version: str) -> str:
    """Return a page of a version with the script that renews it, which its own policy lets run and ask this server."""
    digest = base64.b64encode(hashlib.sha256(_SCRIPT.encode()).digest()).decode()
    policy = r"(Content-Security-Policy\" content=\"[^\"]*?)"
    page = re.sub(f"{policy}script-src ", rf"\1script-src 'sha256-{digest}' ", page)
    page = re.sub(r"(Content-Security-Policy\" content=\")", r"\1connect-src 'self'; ", page)
    head, end, tail = page.rpartition("</body>")
    return f"{head}<script data-version='{version}'>{_SCRIPT}</script>\n{end}{tail}"
