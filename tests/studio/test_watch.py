"""What is noted of requests: enough to see that all is well, and nothing of whom or what they are about."""

import logging
import re
import socket
import struct
import time

import pytest
from prometheus_client.parser import text_string_to_metric_families

from relit.photo.samples import sample
from relit.studio.app import create_app
from relit.studio.metrics import Metrics
from relit.studio.watch import LOG
from tests.served import served
from tests.studio.api import API


def samples(text):
    """Return (name, labels) → value, as Prometheus' own parser reads it."""
    return {
        (one.name, frozenset(one.labels.items())): one.value
        for family in text_string_to_metric_families(text)
        for one in family.samples
    }


def counted(client, method, route, status):
    labels = frozenset({"method": method, "route": route, "status": str(status)}.items())
    return samples(client.get("/metrics").text).get(("relit_requests_total", labels), 0)


@pytest.fixture
def client():
    with served(create_app()) as client:
        yield client


def test_requests_are_counted_by_what_they_ask_and_how_it_ended(client):
    tokens = [client.post(f"{API}/sessions").json()["session"] for _ in range(3)]
    for token in tokens:
        client.get(f"{API}/sessions/{token}/photos/target", params={"side": 99})
    client.get(f"{API}/sessions/{tokens[0]}")
    client.request("PROPFIND", "/odd/path", headers={"Host": "evil"})
    client.get("/static/main.js")
    one = f"{API}/sessions/{{session}}"
    assert counted(client, "POST", f"{API}/sessions", 201) == 3
    assert counted(client, "GET", f"{one}/photos/{{role}}", 404) == 3
    assert counted(client, "GET", one, 200) == 1
    assert counted(client, "other", "none", 403) == 1
    assert counted(client, "GET", "static", 200) == 1
    found = samples(client.get("/metrics").text)
    assert found["relit_sessions", frozenset()] == 3
    assert found["relit_session_bytes", frozenset()] == 0
    labels = " ".join(value for _, pairs in found for _, value in pairs)
    for secret in (*tokens, "odd", "evil", "side", "127.0.0.1"):
        assert secret not in labels
    seconds = {labels: value for (name, labels), value in found.items() if name.endswith("seconds_count")}
    assert sum(seconds.values()) == sum(
        value for (name, _), value in found.items() if name == "relit_requests_total"
    )


def test_what_is_refused_at_the_door_is_counted_by_its_kind(client):
    client.get(f"{API}/options", headers={"Host": "evil"})
    client.get("/healthz")
    assert counted(client, "GET", f"{API}/options", 403) == 1
    with served(create_app(token="a-token-for-tests-alone")) as asking:
        for path in ("/sessions/secret/photos/target", "/sessions/secret/references/grandmother", "/nothing"):
            asking.put(f"{API}{path}", content=b"x")
        asking.get("/")
        asking.headers["Authorization"] = "Bearer a-token-for-tests-alone"
        for route in (f"{API}/sessions/{{session}}/photos/{{role}}", "none"):
            assert counted(asking, "PUT", route, 401) == 1
        assert counted(asking, "PUT", f"{API}/sessions/{{session}}/references/{{id}}", 401) == 1
        assert counted(asking, "GET", "/", 200) == 1


def test_bytes_are_those_that_photos_hold(client):
    token = client.post(f"{API}/sessions").json()["session"]
    client.put(f"{API}/sessions/{token}/photos/target", content=sample("target").read_bytes())
    held = samples(client.get("/metrics").text)["relit_session_bytes", frozenset()]
    assert 512 * 512 * 3 <= held < 512 * 512 * 3 * 1.5


def test_two_servers_count_apart(client):
    client.get(f"{API}/options")
    with served(create_app()) as other:
        assert counted(other, "GET", f"{API}/options", 200) == 0
    assert counted(client, "GET", f"{API}/options", 200) == 1


def test_what_someone_adds_is_read_when_it_is_asked_for():
    metrics, values = Metrics(), iter((5, 7))
    metrics.gauge("relit_queue", "Computations that wait.", lambda: next(values))
    for expected in (5, 7):
        assert samples(metrics.text().decode())["relit_queue", frozenset()] == expected


def test_the_access_log_has_patterns_alone(client, caplog):
    with caplog.at_level(logging.INFO, LOG.name):
        token = client.post(f"{API}/sessions").json()["session"]
        client.put(
            f"{API}/sessions/{token}/references/grandmother",
            content=b"",
            headers={"Authorization": "Bearer no"},
        )
        client.get(f"{API}/sessions/{token}/photos/target", params={"side": 321})
    said = caplog.text
    assert f"POST {API}/sessions 201" in said
    assert f"PUT {API}/sessions/{{session}}/references/{{id}} 400" in said
    for secret in (token, "grandmother", "321", "127.0.0.1", "Bearer"):
        assert secret not in said


def begun(client, method, path):
    """Begin to send a body, and return the connection once the server is reading that."""
    line = socket.create_connection((client.base_url.host, client.base_url.port), 120)
    line.sendall(
        f"{method} {path} HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9999\r\n"
        "Expect: 100-continue\r\n\r\n".encode()
    )
    told = b""
    while not told.endswith(b"\r\n\r\n"):
        told += line.recv(1)
    assert re.fullmatch(rb"HTTP/1\.1 100 \s*\S*\r\n.*", told, re.DOTALL), told
    line.sendall(b"x")
    return line


@pytest.mark.parametrize("hard", [True, False])
@pytest.mark.parametrize(
    ("method", "path", "route"),
    [
        ("PUT", "/photos/target", "/photos/{role}"),
        ("PUT", "/references/a", "/references/{id}"),
        ("PUT", "/landmarks/target/file?format=.pts", "/landmarks/{role}/file"),
    ],
)
def test_a_client_that_hangs_up_is_no_failure(client, capfd, hard, method, path, route):
    place = f"{API}/sessions/{client.post(f'{API}/sessions').json()['session']}"
    client.post(f"{place}/samples").raise_for_status()
    with begun(client, method, f"{place}{path}") as line:
        if hard:  # with a reset
            line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    for _ in range(2000):
        if counted(client, method, f"{API}/sessions/{{session}}{route}", 499):
            break
        time.sleep(0.05)
    else:
        pytest.fail("it was not counted")
    assert capfd.readouterr().err == ""


def test_a_server_that_ends_does_not_wait_for_a_body_that_stopped(capfd, monkeypatch):
    monkeypatch.setattr("relit.studio.server._TO_END", 1)
    with served(create_app()) as client:
        token = client.post(f"{API}/sessions").json()["session"]
        line = begun(client, "PUT", f"{API}/sessions/{token}/photos/target")
    assert line.recv(65536).startswith(b"HTTP/1.1 503 ")
    line.close()
    assert "Traceback" not in capfd.readouterr().err
