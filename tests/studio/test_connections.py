"""No client keeps the server waiting, or from others; each of these on raw sockets."""

import json
import logging
import re
import shutil
import socket
import struct
import subprocess
import sys
import threading
import time
from asyncio.selector_events import _SelectorSocketTransport
from contextlib import ExitStack, suppress
from dataclasses import replace

import pytest

from relit.studio.app import create_app
from relit.studio.connection import Connection
from relit.studio.limits import Limits
from relit.studio.metrics import Metrics
from tests.served import served
from tests.studio.api import API

HEAD = f"POST {API}/sessions HTTP/1.1\r\nHost: 127.0.0.1\r\n".encode()
GET = b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
LIMITS = Limits(connections=16, header_seconds=1, body_seconds=1)
#: Of a server that nobody keeps waiting for too long, however busy this machine is.
PATIENT = Limits(connections=16, header_seconds=120, body_seconds=120)


class Strangers:
    """Clients of a server that say what a test wants, from an address of its own."""

    def __init__(self, port, stack):
        self.port, self.stack = port, stack

    def says(self, data, address="127.0.0.2"):
        line = socket.socket()
        self.stack.callback(line.close)
        line.settimeout(120)
        line.bind((address, 0))
        line.connect(("127.0.0.1", self.port))
        line.sendall(data)
        return line


def heard(line):
    """Return the statuses of answers, the last one's failure if it is one, and whether it hung up."""
    got, ended = b"", False
    try:
        while part := line.recv(65536):
            got += part
        ended = True
    except TimeoutError:
        pass
    except ConnectionError:
        ended = True
    body = got.rpartition(b"\r\n\r\n")[2]
    statuses = [int(status) for status in re.findall(rb"HTTP/1\.1 (\d{3}) ", got)]
    return statuses, json.loads(body)["error"]["code"] if b'"error"' in body else None, ended


def answered(line):
    """Return the status of the next answer, and take no more than that off the line."""
    head = b""
    while not head.endswith(b"\r\n\r\n"):
        part = line.recv(1)
        assert part, f"it hung up: {head}"
        head += part
    left = int(re.search(rb"(?i)\r\ncontent-length: (\d+)\r\n", head)[1])
    while left:
        part = line.recv(left)
        assert part, "it hung up in the body"
        left -= len(part)
    return int(re.match(rb"HTTP/1\.1 (\d{3}) ", head)[1])


@pytest.fixture
def metrics():
    return Metrics()


@pytest.fixture
def limits():
    """Those of the server: a short patience, by default."""
    return LIMITS


@pytest.fixture
def strangers(metrics, limits, capfd, caplog):
    """Strangers to a server; whatever they do, it writes nothing to stderr, nor would by way of a log."""
    with (
        served(create_app(limits=limits, metrics=metrics), limits=limits, refused=metrics.refused) as client,
        ExitStack() as stack,
    ):
        yield Strangers(client.base_url.port, stack)
    assert capfd.readouterr().err == ""
    assert [one.getMessage() for one in caplog.get_records("call") if one.levelno >= logging.WARNING] == []


@pytest.mark.parametrize(
    "head",
    [
        "Content-Length: 5\r\nTransfer-Encoding: chunked\r\n",
        "Transfer-Encoding: chunked\r\nContent-Length: 0\r\n",
        "Content-Length: 5\r\nTransfer-Encoding:\r\n chunked\r\n",
        "Content-Length: 5\r\nContent-Length: 6\r\n",
        "Content-Length: 5, 6\r\n",
        "Content-Length: +5\r\n",
        "Content-Length: -1\r\n",
        "Content-Length: 1\r\n 2\r\n",
        "Content-Length : 5\r\n",
        "Transfer-Encoding: xchunked\r\n",
        "Transfer-Encoding: chunked, identity\r\n",
        "Host: 127.0.0.2\r\n",
        "No colon\r\n",
    ],
)
def test_what_two_servers_may_read_in_two_ways_is_refused(strangers, head):
    """And a request that one of them would find in the body is not answered."""
    line = strangers.says(HEAD + head.encode() + b"\r\n0\r\n\r\n" + GET)
    assert heard(line) == ([400], "bad_request", True)


@pytest.mark.parametrize("limits", [PATIENT])
def test_a_body_in_chunks_is_for_http_1_1(strangers):
    old = HEAD.replace(b"1.1", b"1.0") + b"Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n"
    assert heard(strangers.says(old)) == ([400], "bad_request", True)
    line = strangers.says(HEAD + b"Transfer-Encoding: chunked\r\n\r\n2\r\n{}\r\n0\r\n\r\n" + GET)
    assert [answered(line) for _ in range(2)] == [201, 200], "and pipelined requests are answered in turn"
    line.settimeout(0.5)
    with pytest.raises(TimeoutError):  # nothing more comes, nor does it hang up
        line.recv(1)


@pytest.mark.parametrize("limits", [PATIENT])
@pytest.mark.parametrize("rest", [b"zz\r\n", b"5\r\nhello!!\r\n", b"-1\r\n"])
def test_a_broken_body_whose_request_was_answered_ends_the_connection(strangers, rest):
    line = strangers.says(b"POST /nothing HTTP/1.1\r\nHost: evil\r\nTransfer-Encoding: chunked\r\n\r\n")
    assert answered(line) == 403
    line.sendall(rest)
    assert heard(line) == ([], None, True)


@pytest.mark.parametrize("limits", [PATIENT])
def test_what_is_no_http_is_told_so_after_other_requests_too(strangers):
    line = strangers.says(GET)
    assert answered(line) == 200
    line.sendall(b"\x16\x03\x01\x02\x00\r\n\r\n")
    assert heard(line) == ([400], "bad_request", True)


@pytest.mark.parametrize("begun", [b"GET /hea", GET[:-2], GET + b"GET /hea"])
def test_a_head_that_does_not_end_is_given_up(strangers, begun, metrics):
    """However often a little of it comes, and after other requests."""
    line = strangers.says(begun)
    for _ in range(5):
        time.sleep(0.1)
        with suppress(ConnectionError):  # its second may be over by now
            line.sendall(b"x")
    assert heard(line) == ([200] * begun.count(b"\r\n\r\n") + [408], "too_slow", True)
    assert b'relit_connections_refused_total{reason="slow_head"} 1.0' in metrics.text()


def test_who_goes_while_he_is_told_why_is_no_failure(strangers, monkeypatch):
    """Between what is said to him and its end."""
    told, gone, write = threading.Event(), threading.Event(), _SelectorSocketTransport.write

    def slowly(self, data):
        write(self, data)
        if data.startswith(b"HTTP/1.1 408 "):
            told.set()
            gone.wait(120)

    monkeypatch.setattr(_SelectorSocketTransport, "write", slowly)
    line = strangers.says(b"GET /hea")
    assert told.wait(120)
    line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # with a reset
    line.close()
    gone.set()
    assert answered(strangers.says(GET)) == 200


def test_who_says_nothing_is_left(strangers):
    assert heard(strangers.says(b"")) == ([], None, True)


def test_the_rest_of_a_body_that_was_refused_is_not_waited_for(strangers):
    line = strangers.says(
        b"PUT /api/v1/sessions/x/photos/target HTTP/1.1\r\nHost: evil\r\nContent-Length: 100\r\n\r\n"
    )
    assert heard(line) == ([403], "forbidden", True)


# All of them are there before the first is given up, also where this process has to wait.
@pytest.mark.parametrize("limits", [replace(LIMITS, header_seconds=4)])
def test_one_client_leaves_room_for_others(strangers, metrics):
    """Half-sent heads, four times as many as there may be connections."""
    held = [strangers.says(GET[:-2]) for _ in range(4 * LIMITS.connections)]
    assert answered(strangers.says(GET, "127.0.0.3")) == 200
    told = [heard(line) for line in held]
    assert all(ended for *_, ended in told)
    allowed = LIMITS.connections // 4
    assert told[:allowed] == [([408], "too_slow", True)] * allowed
    assert told[allowed] == ([503], "busy", True)
    refused = re.search(rb'reason="too_many_connections"} ([\d.]+)', metrics.text())
    assert float(refused[1]) == len(held) - allowed
    assert answered(strangers.says(GET)) == 200, "and once they have gone, that client is served again"


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("sh"), reason="ulimit is a shell's")
def test_few_open_files_are_enough_for_the_honest():
    """190 half-sent heads, and 600 connections that are given up at once, of a server with 128 files."""
    serve = "from relit.cli.app import main; main(['serve', '--port', '0', '--header-timeout', '3'])"
    command = ["sh", "-c", f'ulimit -n 128; exec "{sys.executable}" -c "{serve}"']
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as server, ExitStack() as stack:
        try:
            port = int(re.search(r":(\d+)/", server.stderr.readline())[1])
            assert "so few files" in server.stderr.readline()
            strangers = Strangers(port, stack)
            held = [strangers.says(GET[:-2]) for _ in range(190)]
            for number in range(600):
                strangers.says(b"", f"127.0.2.{number % 200 + 1}").close()
            assert answered(strangers.says(GET, "127.0.0.3")) == 200
            assert all(heard(line)[2] for line in held)
        finally:
            server.terminate()
            said = server.communicate(timeout=120)[1]
    assert said == ""


@pytest.mark.parametrize("limits", [PATIENT])
def test_many_clients_are_bounded_together(strangers):
    held = [strangers.says(GET[:-2], f"127.0.1.{number}") for number in range(LIMITS.connections + 1)]
    assert heard(held[-1]) == ([503], "busy", True)


def test_a_trusted_proxy_is_many_clients(capfd):
    with (
        served(create_app(), limits=PATIENT, proxies=("127.0.0.0/29",)) as client,
        ExitStack() as stack,
    ):
        strangers = Strangers(client.base_url.port, stack)
        for _ in range(LIMITS.connections - 2):
            strangers.says(GET[:-2])
        assert answered(strangers.says(GET)) == 200
    assert capfd.readouterr().err == ""


def test_answers_do_not_wait_for_more_to_send(monkeypatch):
    """As they would with Nagle's algorithm, 40 ms each."""
    waits = []
    made = Connection.connection_made

    def noted(self, transport):
        line = transport.get_extra_info("socket")
        waits.append(not line.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))
        made(self, transport)

    monkeypatch.setattr(Connection, "connection_made", noted)
    with served(create_app()) as client:
        client.get("/healthz")
    assert waits == [False]


def test_who_does_not_take_an_answer_is_cut_off(metrics, capfd):
    async def app(_scope, _receive, send):
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": bytes(50_000_000)})

    with served(app, limits=LIMITS, refused=metrics.refused) as client, ExitStack() as stack:
        line = Strangers(client.base_url.port, stack).says(GET)
        for _ in range(1200):
            if b"slow_reader" in metrics.text():
                break
            time.sleep(0.1)
        assert b'relit_connections_refused_total{reason="slow_reader"} 1.0' in metrics.text()
        got = 0
        while part := line.recv(1 << 20):
            got += len(part)
        assert got < 40_000_000
    assert capfd.readouterr().err == ""


@pytest.mark.slow
def test_who_takes_it_slowly_gets_it(metrics):
    # A patience that is more than this process may have to wait for its turn.
    size, limits = 20_000_000, replace(LIMITS, body_seconds=3)

    async def app(_scope, _receive, send):
        headers = [(b"content-length", str(size).encode())]
        await send({"type": "http.response.start", "status": 200, "headers": headers})
        await send({"type": "http.response.body", "body": bytes(size)})

    with served(app, limits=limits, refused=metrics.refused) as client, ExitStack() as stack:
        line = Strangers(client.base_url.port, stack).says(GET)
        got, begun = 0, time.monotonic()
        while got < size:  # over 9 s, three times its patience
            part = line.recv(1 << 18)
            assert part, f"it hung up after {got} bytes: {metrics.text().decode()}"
            got += len(part)
            time.sleep(max(0, begun + 9 * got / size - time.monotonic()))
    assert got >= size
