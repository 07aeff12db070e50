"""A server for others asks for its token, wherever there is something to be had."""

import re
import string

import h11
import pytest
from hypothesis import given
from hypothesis import strategies as st

from relit.errors import OptionError
from relit.studio.access import checked, new_token
from relit.studio.app import create_app
from tests.served import served
from tests.studio.api import API

#: What is printed, and no part of a token but at its end.
OTHERS = set(string.punctuation) - set("._~+/-")
TOKEN = "a-token-for-tests-alone"
HAVING = {"Authorization": f"Bearer {TOKEN}"}


@pytest.fixture(scope="module")
def asking():
    """A client of a server that asks for a token."""
    with served(create_app(token=TOKEN)) as client:
        yield client


@pytest.mark.parametrize(
    "given",
    [
        "",
        "Bearer",
        TOKEN,
        f"Basic {TOKEN}",
        f"Bearer {TOKEN[:-1]}",
        f"Bearer {TOKEN}x",
        "Bearer ü",
    ],
)
def test_who_has_it_not_gets_nothing(asking, given):
    headers = {"Authorization": given.encode("latin-1")}
    for method, path in (
        ("GET", f"{API}/options"),
        ("GET", f"{API}/openapi.json"),
        ("POST", f"{API}/sessions"),
        ("GET", f"{API}/sessions/x/photos/target"),
        ("PUT", f"{API}/sessions/x/photos/target"),
        ("GET", "/metrics"),
        ("GET", "/nothing"),
        ("OPTIONS", f"{API}/options"),
    ):
        answer = asking.request(method, path, headers=headers)
        assert (answer.status_code, answer.json()["error"]["code"]) == (401, "unauthorized"), path
        assert answer.headers["www-authenticate"].startswith('Bearer realm="relit"')
        # RFC 6750, 3.1: only a token that was sent can be invalid.
        assert ("invalid_token" in answer.headers["www-authenticate"]) == given.startswith("Bearer")


@pytest.mark.parametrize("kind", ["Bearer", "bearer", "BEARER"])
def test_who_has_it_comes_in(asking, kind):
    headers = {"Authorization": f"{kind} {TOKEN}"}
    assert asking.get(f"{API}/options", headers=headers).status_code == 200
    assert asking.get("/metrics", headers=headers).status_code == 200
    assert asking.get("/nothing", headers=headers).status_code == 404


def test_the_page_and_the_health_are_for_anyone(asking):
    for path in ("/", "/static/main.js", "/healthz"):
        shown, head = asking.get(path), asking.head(path)
        assert (shown.status_code, head.status_code, head.content) == (200, 200, b"")
        assert head.headers["content-length"] == str(len(shown.content))
    assert asking.get("/healthz", headers={"Host": "whatever"}).json() == {"status": "ok"}


def test_another_sites_page_is_refused_with_the_token_too(asking):
    answer = asking.post(f"{API}/sessions", headers={**HAVING, "Origin": "http://evil.example"})
    assert (answer.status_code, "evil.example" in answer.json()["error"]["message"]) == (403, True)


def test_the_schema_says_so_where_it_is_so(asking, client):
    there = asking.get(f"{API}/openapi.json", headers=HAVING).json()
    assert [scheme["scheme"] for scheme in there["components"]["securitySchemes"].values()] == ["bearer"]
    for methods in there["paths"].values():
        for operation in methods.values():
            assert operation["security"]
            assert "WWW-Authenticate" in operation["responses"]["401"]["headers"]
    here = client.get(f"{API}/openapi.json").json()
    assert "securitySchemes" not in here["components"]
    assert not any(
        "401" in one["responses"] for methods in here["paths"].values() for one in methods.values()
    )


def test_names_that_are_refused_are_told_with_what_to_do(client):
    message = client.get("/", headers={"Host": "light.team:80"}).json()["error"]["message"]
    assert "light.team" in message
    assert "--allow-host light.team" in message


def test_the_address_that_a_connection_came_in_at_is_a_name_of_the_server():
    """Whichever it is: on a server of every address, they are not known before."""
    with served(create_app(), host="127.0.0.5") as client:
        assert client.get(f"{API}/options").status_code == 200
        assert client.get(f"{API}/options", headers={"Host": "127.0.0.5:1"}).status_code == 200
        for other in ("127.0.0.6", "0.0.0.0", "[::]", "10.0.0.5"):
            assert client.get(f"{API}/options", headers={"Host": other}).status_code == 403


@given(
    st.text(min_size=1) | st.text(string.ascii_letters + string.digits + "._~+/-=", min_size=10, max_size=30)
)
def test_a_chosen_token_can_stand_in_a_header_or_is_refused_unseen(token):
    if len(token) >= 16 and re.fullmatch("[!-~]+", token) and not set(token.rstrip("=")) & OTHERS:
        assert h11.Request(
            method="GET", target="/", headers=[("Host", "x"), ("A", f"Bearer {checked(token)}")]
        )
    else:
        with pytest.raises(OptionError, match=f"got {len(token)}") as refused:
            checked(token)
        assert len(token) < 5 or token not in str(refused.value)


def test_made_tokens_are_tokens_and_differ():
    tokens = {checked(new_token()) for _ in range(100)}
    assert len(tokens) == 100
