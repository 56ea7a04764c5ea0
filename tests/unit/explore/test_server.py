"""The server: who may speak to it, what it serves, and that nothing a page says upsets it."""

import http.client
import json
import random
import socket
import threading

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.extensions.permessage_deflate import PerMessageDeflate
from websockets.frames import Opcode
from websockets.sync.client import connect

import saltus as sl
from mad_page import mad_message
from saltus.explore import server as servers
from saltus.explore import session as sessions
from saltus.explore.desk import Desk
from saltus.explore.frames import unpacked
from saltus.explore.opening import Opening
from saltus.explore.questions import LONGEST
from saltus.explore.server import MOST_PAGES, WIRE, Server

RIG = sl.models.delangre("b", force="4 N", frequency="15 Hz")
OPENING = Opening(
    RIG, sl.Taylor(), {"x": (-5e-3, 5e-3), "v": (-1.0, 1.0)}, turn=1 / 15,
    ranges={name: (0.5 * value, 2 * value) for name, value in RIG.values.items()},
)  # fmt: skip


@pytest.fixture(scope="module")
def server():
    before = set(threading.enumerate())
    one = Server(Desk(OPENING, 1))
    one.start()
    yield one
    one.stop()
    left = [one for one in threading.enumerate() if one.is_alive() and one not in before]
    assert left == []


def get(server, path="/", method="GET", **headers):
    """Status, headers and body of an answer; a Host of None leaves it out."""
    line = http.client.HTTPConnection("127.0.0.1", server.port, timeout=30)
    line.putrequest(method, path, skip_host=True)
    host = headers.pop("Host", f"127.0.0.1:{server.port}")
    for name, value in {**({} if host is None else {"Host": host}), **headers}.items():
        line.putheader(name, value)
    line.endheaders()
    answer = line.getresponse()
    found = answer.status, dict(answer.getheaders()), answer.read()
    line.close()
    return found


def page(server, **more):
    """A page's socket."""
    return connect(f"ws://127.0.0.1:{server.port}/socket", max_size=None, legacy=True, **more)


def hello(server, token=None, wire=WIRE, **more):
    return json.dumps(
        {"ask": "hello", "id": 0, "token": token or server.token, "wire": wire, **more}
    )


def heard(line):
    return unpacked(line.recv(timeout=60))[0]


def closed_with(line):
    with pytest.raises(ConnectionClosed) as closed:
        line.recv(timeout=60)
    return closed.value.rcvd.code


@pytest.fixture
def known(server):
    """The socket of a page that has said its token."""
    line = page(server, origin=f"http://127.0.0.1:{server.port}")
    line.send(hello(server))
    assert heard(line)["kind"] == "hello"
    yield line
    line.close()


# -- HTTP ------------------------------------------------------------------------------------------
def test_it_listens_on_this_machine_alone(server):
    assert server._socket.getsockname()[0] == "127.0.0.1"
    assert server.url == f"http://127.0.0.1:{server.port}/#token={server.token}"
    assert len(server.token) * 6 >= 192


@pytest.mark.parametrize(
    "host",
    [
        None, "", "evil.example", "127.0.0.1", "localhost", "127.0.0.1:80.evil.example",
        "127.0.0.1:{port}.evil.example", "127.0.0.1:{port}@evil.example", "127.0.0.2:{port}",
        "[::1]:{port}", "0.0.0.0:{port}", "LOCALHOST:{port}", "127.0.0.1:0{port}", "127.1:{port}",
    ],
)  # fmt: skip
def test_a_foreign_host_is_refused(server, host):
    told = host and host.format(port=server.port)
    status, _, body = get(server, Host=told)
    assert status in (400, 421)
    assert b"evil" not in body


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost"])
def test_our_own_names_are_served(server, host):
    assert get(server, "/nothing", Host=f"{host}:{server.port}")[0] == 404


@pytest.mark.parametrize(
    "origin",
    [
        "null", "http://evil.example", "https://127.0.0.1:{port}", "http://127.0.0.1",
        "http://localhost:{port}", "http://127.0.0.1:{port}/", "http://127.0.0.1:{port} ",
    ],
)  # fmt: skip
def test_a_foreign_origin_is_refused_by_both(server, origin):
    origin = origin.format(port=server.port)
    if origin.endswith(" "):  # blanks at the end are no part of a header
        return
    assert get(server, Origin=origin)[0] == 403
    with pytest.raises(InvalidStatus) as refused:
        page(server, origin=origin)
    assert refused.value.response.status_code == 403


def test_a_foreign_host_gets_no_socket(server):
    with pytest.raises((InvalidStatus, ConnectionClosed)):
        page(server, additional_headers={"Host": "evil.example"})


@pytest.mark.parametrize(
    "path",
    [
        "/nothing", "/../server.py", "/..%2fserver.py", "/%2e%2e/server.py", "/page/index.html",
        "/index.html/", "//etc/passwd", "/main.js%00", "/server.py", "/.", "/socket",
        "/?token=x/..",
    ],
)  # fmt: skip
def test_only_the_files_of_the_page_are_served(server, path):
    status, headers, body = get(server, path)
    if status == 200:  # the page itself, whatever stands behind the question mark
        assert path.startswith("/?")
        return
    assert status == 404
    assert b"python" not in body.lower()
    assert "passwd" not in body.decode()
    assert "default-src 'none'" in headers["content-security-policy"]


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS", "PATCH", "TRACE"])
def test_other_methods_are_refused(server, method):
    assert get(server, "/", method)[0] == 405


def test_a_page_is_kept_to_itself(server, tmp_path, monkeypatch):
    (tmp_path / "page").mkdir()
    (tmp_path / "page" / "index.html").write_text("<p>here</p>")
    (tmp_path / "page" / "notes.txt").write_text("not for pages")
    monkeypatch.setattr(servers.resources, "files", lambda package: tmp_path)
    status, headers, body = get(server)
    assert (status, body) == (200, b"<p>here</p>")
    assert get(server, "/index.html")[0] == 200
    assert get(server, "/notes.txt")[0] == 404
    policy = dict(part.split(" ", 1) for part in headers["content-security-policy"].split("; "))
    assert policy["default-src"] == policy["frame-ancestors"] == "'none'"
    assert policy["script-src"] == policy["connect-src"] == policy["style-src"] == "'self'"
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["cache-control"] == "no-store"
    assert headers["cross-origin-opener-policy"] == "same-origin"
    assert headers["cross-origin-resource-policy"] == "same-origin"
    assert "server" not in headers


# -- the first words -------------------------------------------------------------------------------
@pytest.mark.parametrize(
    "words",
    [
        "", "{}", '{"ask": "about", "id": 1}', '{"ask": "hello", "id": 0, "wire": 2}',
        '{"ask": "hello", "id": 0, "wire": 2, "token": ""}',
        '{"ask": "hello", "id": 0, "wire": 2, "token": "\\ud800é"}', b"\x00\xff",
    ],
)  # fmt: skip
def test_who_does_not_know_the_token_is_not_answered(server, words):
    line = page(server)
    line.send(words)
    assert closed_with(line) == 4403
    assert server.sessions == []


def test_who_says_nothing_is_not_waited_for(server, monkeypatch):
    monkeypatch.setattr(servers, "HELLO", 0.0)
    assert closed_with(page(server)) == 4408


def test_a_page_of_another_version_is_told_to_reload(server):
    line = page(server)
    line.send(hello(server, wire=WIRE + 1))
    assert heard(line)["kind"] == "reload"
    assert closed_with(line) == 4409


def test_a_page_learns_whether_the_desk_is_the_one_that_it_knew(server):
    for desk, same in (("", False), (server.desk, True)):
        with page(server) as line:
            line.send(hello(server, desk=desk))
            told = heard(line)
            assert (told["same"], told["desk"], told["endian"]) == (same, server.desk, "little")


def test_no_more_pages_than_fit(server):
    lines = [page(server) for _ in range(MOST_PAGES)]
    for line in lines:
        line.send(hello(server))
        assert heard(line)["kind"] == "hello"
    assert closed_with(page(server)) == 4429
    for line in lines:
        line.close()


# -- a page ----------------------------------------------------------------------------------------
def test_two_pages_are_answered_each(server, known):
    with page(server) as other:
        other.send(hello(server))
        heard(other)
        for line, number in ((known, 5), (other, 6)):
            line.send(json.dumps({"ask": "about", "id": number}))
        assert heard(known)["id"] == 5
        assert heard(other)["id"] == 6


def test_a_question_that_is_too_long_closes_the_socket(server, known):
    known.send(" " * (LONGEST + 1))
    assert closed_with(known) == 1009


def test_two_thousand_random_messages_upset_nothing(server, known, capfd, monkeypatch):
    monkeypatch.setattr(sessions, "RATE", 10**6)
    draw = random.Random(832)
    for number in range(2000):
        known.send(mad_message(draw, number))
    known.send(json.dumps({"ask": "stop", "id": 4001}))
    known.send(json.dumps({"ask": "motion", "id": 5000, "start": [1e-3, 0]}))
    told, kinds = heard(known), set()
    while told["id"] != 5000:
        kinds.add(told["kind"])
        told = heard(known)
    assert told["kind"] == "motion"
    assert "failed" not in kinds
    assert {"refused", "stopped"} <= kinds
    assert "Traceback" not in capfd.readouterr().err


def test_nothing_listens_when_it_has_ended(server):
    other = Server(Desk(OPENING, 1))
    other.start()
    with page(other) as line:
        line.send(hello(other))
        heard(line)
        line.send(json.dumps({"ask": "about", "id": 1}))
        heard(line)
        assert other.idle == 0.0
        (session,) = other.sessions
    other.stop()
    assert session._closed  # and its work has ended
    assert other.sessions == []
    with socket.socket() as line, pytest.raises(ConnectionRefusedError):
        line.connect(("127.0.0.1", other.port))


class _Deaf:
    """A desk whose work can't be stopped in time."""

    def answer(self, question, emit):
        threading.Event().wait(0.4)


def test_work_that_outlasts_the_server_leaves_no_traceback(capfd):
    one = Server(_Deaf())
    one._uvicorn.config.timeout_graceful_shutdown = 0.05
    one.start()
    with page(one) as line:
        line.send(json.dumps({"ask": "hello", "id": 0, "token": one.token, "wire": WIRE}))
        line.recv()
        line.send(json.dumps({"ask": "about", "id": 1}))
        while not (one.sessions and one.sessions[0]._lanes):
            threading.Event().wait(0.01)
        one.stop()
    assert capfd.readouterr().err == ""


# -- bytes -----------------------------------------------------------------------------------------
class Even:
    """A desk that answers a motion by one frame, a map by three pieces and an end."""

    def answer(self, question, emit):
        kinds = ["map-piece"] * 3 + ["map-end"] if question.ask == "map" else ["motion"]
        for kind in kinds:
            emit({"kind": kind}, {"step": np.ones(1000, "u1")})


def test_maps_are_compressed_and_motions_are_not(monkeypatch):
    decode, weights = PerMessageDeflate.decode, []

    def weighed(self, frame, **named):
        if frame.opcode is Opcode.BINARY:
            weights.append((len(frame.data), frame.rsv1))
        return decode(self, frame, **named)

    monkeypatch.setattr(PerMessageDeflate, "decode", weighed)
    server = Server(Even())
    server.start()
    try:
        with page(server) as line:
            line.send(hello(server))
            assert heard(line)["kind"] == "hello"
            line.send(json.dumps({"ask": "motion", "id": 1, "start": [1e-3, 0.0]}))
            motion = line.recv(timeout=60)
            assert weights[1:] == [(len(motion), False)]
            axes = {"x": [-5e-3, 5e-3], "v": [-1.0, 1.0]}
            line.send(json.dumps({"ask": "map", "id": 2, "axes": axes, "size": [40, 40]}))
            sizes = [len(line.recv(timeout=60)) for _ in range(4)]
    finally:
        server.stop()
    assert all(compressed for _, compressed in weights[2:])
    assert sum(size for size, _ in weights[2:]) < 0.2 * sum(sizes)
