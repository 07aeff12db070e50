"""docs/nginx.conf is true: nginx, started with it, brings page and API to others, and tells them apart."""

import io
import re
import shutil
import socket
import ssl
import subprocess
import time
from pathlib import Path

import httpx
import pytest
import trustme
from PIL import Image

from relit.photo.samples import sample
from relit.studio.app import create_app
from tests.served import served
from tests.studio.api import API

NGINX = shutil.which("nginx") or shutil.which("nginx", path="/usr/sbin")
CONFIG = Path(__file__).parents[2] / "docs" / "nginx.conf"
TOKEN = "a-token-for-tests-alone"

pytestmark = [pytest.mark.slow, pytest.mark.skipif(NGINX is None, reason="nginx is not installed")]


class Seen:
    """ASGI middleware that notes whom requests are from."""

    def __init__(self, app):
        self.app, self.clients = app, []

    async def __call__(self, scope, receive, send):
        self.clients.append((scope["client"][0], scope["scheme"]))
        await self.app(scope, receive, send)


def free_ports(count):
    sockets = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


@pytest.fixture(scope="module")
def seen():
    return Seen(create_app(hosts=("light.team",), token=TOKEN))


@pytest.fixture(scope="module")
def place(seen, tmp_path_factory):
    """Run relit, and nginx with the documented configuration; return its TLS port, authority and folder."""
    folder = tmp_path_factory.mktemp("nginx")
    authority = trustme.CA()
    issued = authority.issue_cert("light.team")
    issued.private_key_pem.write_to_path(folder / "key.pem")
    for number, part in enumerate(issued.cert_chain_pems):
        part.write_to_path(folder / "chain.pem", append=number > 0)
    with served(seen, proxies=("127.0.0.1",)) as behind:
        site = CONFIG.read_text("utf-8")
        for documented, here in {
            "/etc/ssl/light.team.pem": f"{folder}/chain.pem",
            "/etc/ssl/light.team.key": f"{folder}/key.pem",
            "/var/log/nginx/": f"{folder}/",
            "127.0.0.1:8765": f"127.0.0.1:{behind.base_url.port}",
        }.items():
            assert documented in site
            site = site.replace(documented, here)
        kinds = ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
        temporary = "".join(f"{kind}_temp_path {folder}/{kind};" for kind in kinds)
        for _ in range(5):  # another process may take a port before nginx does
            plain, tls = free_ports(2)
            listening = site
            for documented, here in {
                "listen 80;": f"listen 127.0.0.1:{plain};",
                "listen 443 ssl;": f"listen 127.0.0.1:{tls} ssl;",
            }.items():
                assert documented in listening
                listening = listening.replace(documented, here)
            (folder / "nginx.conf").write_text(
                f"daemon off; pid {folder}/pid; error_log {folder}/main.log;"
                f"events {{}} http {{ {temporary} {listening} }}"
            )
            nginx = subprocess.Popen(
                [NGINX, "-p", folder, "-e", folder / "main.log", "-c", folder / "nginx.conf"]
            )
            try:
                if listens(nginx, folder):
                    yield tls, authority, folder
                    return
            finally:
                nginx.terminate()
                nginx.wait(120)
        pytest.fail((folder / "main.log").read_text())


def listens(process, folder):
    """Return whether nginx has begun, or could not."""
    for _ in range(1200):
        if process.poll() is not None:
            said = (folder / "main.log").read_text()
            assert "Address already in use" in said, said
            return False
        # It writes its number once it has its ports.
        if (folder / "pid").exists():
            return True
        time.sleep(0.1)
    raise AssertionError("nginx does not start")


@pytest.fixture
def client(place):
    """A client from another address of this machine, by the server's name and through TLS."""
    port, authority, _ = place
    trust = ssl.create_default_context()
    authority.configure_trust(trust)
    # The name in Host and in the certificate is another than the address to connect to.
    with httpx.Client(
        base_url=f"https://127.0.0.1:{port}",
        headers={"Host": f"light.team:{port}", "Authorization": f"Bearer {TOKEN}"},
        transport=httpx.HTTPTransport(verify=trust, local_address="127.0.0.3"),
        timeout=300,
    ) as client:
        client.event_hooks["request"] = [lambda asked: asked.extensions.update(sni_hostname="light.team")]
        yield client


def test_the_page_and_the_api_come_through(client, place, seen):
    assert "relit studio" in client.get("/").text
    assert client.get("/static/main.js").status_code == 200
    seen.clients.clear()
    session = client.post(
        f"{API}/sessions",
        headers={"Origin": f"https://light.team:{place[0]}", "Sec-Fetch-Site": "same-origin"},
    ).json()["session"]
    assert seen.clients == [("127.0.0.3", "https")]
    for role in ("target", "reference"):
        put = client.put(f"{API}/sessions/{session}/photos/{role}", content=sample(role).read_bytes())
        assert put.json()["landmarks"] is not None
    answer = client.post(f"{API}/sessions/{session}/render", json={"side": 320})
    with Image.open(io.BytesIO(answer.content)) as preview:
        assert max(preview.size) <= 320
    assert client.delete(f"{API}/sessions/{session}").status_code == 204
    # What nginx noted has nobody's session.
    log = (place[2] / "relit.log").read_text()
    assert len(re.findall(r"127\.0\.0\.3 PUT 200", log)) == 2
    assert session not in log
    assert not (place[2] / "relit.error.log").read_text()


def test_who_may_not_come_in_is_told_by_relit_itself(client):
    for headers, status, code in (
        ({"Authorization": ""}, 401, "unauthorized"),
        ({"Authorization": "Bearer no"}, 401, "unauthorized"),
        ({"Host": "evil.example"}, 403, "forbidden"),
        ({"Origin": "https://evil.example"}, 403, "forbidden"),
    ):
        answer = client.post(f"{API}/sessions", headers=headers)
        assert (answer.status_code, answer.json()["error"]["code"]) == (status, code)
    assert client.get("/healthz").json() == {"status": "ok"}
    assert client.get("/metrics").status_code == 404
    assert client.get("/").headers["strict-transport-security"].startswith("max-age=")


def test_a_client_cannot_say_that_it_is_another(client, seen):
    seen.clients.clear()
    client.get(f"{API}/options", headers={"X-Forwarded-For": "10.1.2.3"})
    assert seen.clients == [("127.0.0.3", "https")]


def test_one_client_is_bounded(client):
    """A burst of many more than a page makes is refused, for the rest of a second."""
    statuses = []
    while 429 not in statuses and len(statuses) < 5000:
        statuses.append(client.get("/healthz").status_code)
    assert statuses.count(200) > 50
    assert set(statuses) == {200, 429}
    time.sleep(1)
    assert client.get("/healthz").status_code == 200


def test_without_a_trusted_proxy_nobody_is_believed():
    seen = Seen(create_app())
    with served(seen) as client:
        client.get("/healthz", headers={"X-Forwarded-For": "10.1.2.3", "X-Forwarded-Proto": "https"})
    assert seen.clients == [("127.0.0.1", "http")]
