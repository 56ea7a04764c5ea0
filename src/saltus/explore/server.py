"""The server of the explorer: the page's files by HTTP, one WebSocket a page, this machine alone.

Knows sockets, and nothing of systems: what a page asks is answered by its session.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
import socket
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from importlib import metadata, resources
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket
from uvicorn.protocols.websockets.auto import AutoWebSocketsProtocol

from saltus.errors import ParameterError
from saltus.explore.compression import MapsDeflatedFactory
from saltus.explore.frames import packed
from saltus.explore.questions import LONGEST, Hello, QuestionError, read
from saltus.explore.session import AnswersQuestions, Outbox, Session

#: Version of frames and questions; a page of another one is told to reload.
WIRE = 2
#: Most pages at once, and how long a page may take to say its token [s].
MOST_PAGES, HELLO = 8, 5.0
#: Codes of why a socket is closed: 4400 and the code of HTTP for the same.
WRONG_TOKEN, SLOW, OTHER_WIRE, TOO_MANY = 4403, 4408, 4409, 4429
#: Time for which the server goes on without a page where it shall end with them [s].
LINGER = 60.0

_FILES = {
    "index.html": "text/html; charset=utf-8",
    "main.js": "text/javascript; charset=utf-8",
    "style.css": "text/css; charset=utf-8",
    "favicon.svg": "image/svg+xml",
    "LICENSES": "text/plain; charset=utf-8",
}
_HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src 'self' blob:; base-uri 'none'; form-action 'none'; frame-ancestors "
)


class OnlyOurs:
    """ASGI application that answers requests to this very address only, whoever sends them.

    The Host must be ours: a foreign name may point to this machine. The Origin of what a page asks
    must be ours: other pages of the same browser can reach this machine too.

    Parameters
    ----------
    application : callable
        The application behind.
    port : int
        The server's port.
    headers : mapping of str to str
        Headers of every answer.
    """

    def __init__(self, application: Any, port: int, headers: Mapping[str, str]) -> None:
        self._application = application
        self._headers = [(name.lower().encode(), one.encode()) for name, one in headers.items()]
        self._hosts = {f"127.0.0.1:{port}".encode(), f"localhost:{port}".encode()}

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        """Answer, or refuse: 421 for a foreign host, 403 for a foreign origin."""

        async def answer(message: Any) -> None:
            if message["type"] == "http.response.start":
                message = {**message, "headers": [*message["headers"], *self._headers]}
            await send(message)

        named: dict[bytes, list[bytes]] = {}
        for name, value in scope["headers"]:
            named.setdefault(name, []).append(value)
        host, origin = named.get(b"host", []), named.get(b"origin", [])
        ours = len(host) == 1 and host[0] in self._hosts
        known = not origin or (ours and origin == [b"http://" + host[0]])
        if ours and known:
            await self._application(scope, receive, answer)
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
        else:
            await PlainTextResponse("Not here.", 403 if ours else 421)(scope, receive, answer)


class _PageSocket(AutoWebSocketsProtocol):  # type: ignore[misc, valid-type]
    """The protocol of a page's socket: maps are compressed."""

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        holder: Any = getattr(self, "conn", self)  # in older uvicorn the protocol itself
        holder.available_extensions = [MapsDeflatedFactory()]


class Server:
    """The explorer's server, on a thread.

    Parameters
    ----------
    desk : AnswersQuestions
        What answers.
    opened : callable, optional
        The desk of a model that a page opens, by the model's name.
    framed_by : iterable of str
        Origins whose pages may show this one in a frame; none by default.
    """

    def __init__(
        self,
        desk: AnswersQuestions,
        opened: Callable[[str], AnswersQuestions] | None = None,
        framed_by: Iterable[str] = (),
    ) -> None:
        self._desk, self._opened = desk, opened
        self.token, self.desk = secrets.token_urlsafe(24), secrets.token_hex(8)
        self.sessions: list[Session] = []
        self._sockets = 0
        self._alone_since = time.monotonic()
        self._socket = socket.socket()
        self._socket.bind(("127.0.0.1", 0))
        self.port: int = self._socket.getsockname()[1]
        routes = [
            WebSocketRoute("/socket", self._page),
            Route("/", self._file),
            Route("/{name}", self._file),
        ]
        application = Starlette(routes=routes)
        application.router.redirect_slashes = False
        policy = {"Content-Security-Policy": _POLICY + (" ".join(framed_by) or "'none'")}
        config = uvicorn.Config(
            OnlyOurs(application, self.port, _HEADERS | policy),
            lifespan="off",
            log_config=None,
            access_log=False,
            server_header=False,
            date_header=False,
            ws_max_size=LONGEST,
            ws=_PageSocket,
            timeout_graceful_shutdown=2,
        )
        self._uvicorn = uvicorn.Server(config)
        self._thread = threading.Thread(target=self._run, name="saltus-explore", daemon=True)

    @property
    def url(self) -> str:
        """The page's address. The token stands behind the #, which no browser sends."""
        return f"http://127.0.0.1:{self.port}/#token={self.token}"

    @property
    def idle(self) -> float:
        """Time for which no page has been there [s]."""
        return 0.0 if self.sessions else time.monotonic() - self._alone_since

    def start(self) -> None:
        """Listen. Returns when the address answers."""
        self._thread.start()
        while not self._uvicorn.started:
            if not self._thread.is_alive():
                raise ParameterError("the explorer's server didn't start; the terminal says why.")
            time.sleep(0.005)

    def stop(self) -> None:
        """End all pages' work, and the server."""
        log = logging.getLogger("uvicorn.error")
        log.disabled = True  # what is cut off at the end is no failure
        self._uvicorn.should_exit = True
        if self._thread.is_alive():
            self._thread.join()
        log.disabled = False
        self._socket.close()

    def wait(self, until_closed: bool = False) -> None:
        """Wait until the server ends: on Ctrl-C, or a minute after the last page went."""
        while self._thread.is_alive() and not (until_closed and self.idle > LINGER):
            self._thread.join(0.2)

    def _run(self) -> None:
        self._uvicorn.run(sockets=[self._socket])

    # -- HTTP --------------------------------------------------------------------------------------
    async def _file(self, request: Request) -> Response:
        name = request.path_params.get("name", "index.html")
        file = resources.files(__package__) / "page" / name if name in _FILES else None
        if file is None or not file.is_file():
            return PlainTextResponse("There is no such page.", 404)
        return Response(file.read_bytes(), media_type=_FILES[name])

    # -- WebSocket ---------------------------------------------------------------------------------
    async def _page(self, page: WebSocket) -> None:
        await page.accept()
        if self._sockets >= MOST_PAGES:
            await page.close(TOO_MANY)
            return
        self._sockets += 1
        try:
            if await self._known(page):
                await self._serve(page)
        finally:
            self._sockets -= 1

    async def _serve(self, page: WebSocket) -> None:
        """Hear a page's questions until it goes."""
        loop, ready = asyncio.get_running_loop(), asyncio.Event()

        def tell() -> None:
            with contextlib.suppress(RuntimeError):  # the loop has ended, and so has the page
                loop.call_soon_threadsafe(ready.set)

        outbox = Outbox(tell)
        session = Session(self._desk, outbox, self._opened)
        self.sessions.append(session)
        writer = asyncio.create_task(_write(page, outbox, ready))
        try:
            while (text := await _heard(page)) is not None:
                session.hear(text)
                ready.set()  # something may have been dropped
        finally:
            self.sessions.remove(session)
            self._alone_since = time.monotonic()
            writer.cancel()
            await asyncio.to_thread(session.close)

    async def _known(self, page: WebSocket) -> bool:
        """True if a page's first words are its token, in time, and it is of this version."""
        try:
            async with asyncio.timeout(HELLO):
                question: Any = read(await _heard(page) or "")
        except TimeoutError:
            await page.close(SLOW)
            return False
        except QuestionError:
            question = None
        if not isinstance(question, Hello) or not self._is_token(question.token):
            with contextlib.suppress(RuntimeError):  # it went by itself
                await page.close(WRONG_TOKEN)
            return False
        about = {"ask": "hello", "id": question.id, "wire": WIRE, "endian": "little"}
        if question.wire != WIRE:
            why = "saltus was updated: reload the page."
            await page.send_bytes(packed({**about, "kind": "reload", "why": why}, {}))
            await page.close(OTHER_WIRE)
            return False
        same = question.desk == self.desk
        about |= {"version": metadata.version("saltus"), "desk": self.desk, "same": same}
        await page.send_bytes(packed({**about, "kind": "hello"}, {}))
        return True

    def _is_token(self, given: str) -> bool:
        return secrets.compare_digest(given.encode("utf-8", "replace"), self.token.encode())


async def _heard(page: WebSocket) -> str | None:
    """The next text of a page; None when it has gone. Bytes are text that can't be read."""
    message = await page.receive()
    if message["type"] != "websocket.receive":
        return None
    return message.get("text") or ""


async def _write(page: WebSocket, outbox: Outbox, ready: asyncio.Event) -> None:
    """Send a page's frames as they come."""
    while True:
        await ready.wait()
        ready.clear()
        while (frame := outbox.take()) is not None:
            try:
                await page.send_bytes(frame)
            except Exception:  # the page has gone: its reader says so
                return
