"""Who may ask the studio, how much it takes, and that sessions keep to themselves."""

import io
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from relit.photo.reading import read_image
from relit.photo.samples import sample
from relit.runtime.memo import remembered
from relit.studio import sessions as module
from relit.studio.app import create_app
from relit.studio.guard import HEADERS
from relit.studio.limits import Limits
from relit.studio.session import Portrait, Session, StudioError
from relit.studio.sessions import Sessions
from tests.served import served
from tests.studio.api import API, png


class TestGuard:
    def test_strangers_are_turned_away(self, client):
        for headers in (
            {"host": "evil.example"},
            {"host": "evil.example:80"},
            {"host": "127.0.0.1.evil.example"},
            {"host": "["},
            {"origin": "http://["},
            {"origin": "http://evil.example"},
            {"origin": "null"},
            {"sec-fetch-site": "cross-site"},
            {"sec-fetch-site": "same-site"},
        ):
            answer = client.post(f"{API}/sessions", headers=headers)
            assert (answer.status_code, answer.json()["error"]["code"]) == (403, "forbidden")
        for headers in (
            {"host": "localhost:1234"},
            {"host": "[::1]:5"},
            {"origin": str(client.base_url).rstrip("/")},
        ):
            answer = client.post(f"{API}/sessions", headers=headers)
            assert answer.status_code == 201

    @pytest.mark.parametrize(
        "path", ["/", "/static/none.js", f"{API}/options", f"{API}/sessions/x/photos/target"]
    )
    def test_every_answer_carries_the_headers(self, client, path):
        answer = client.get(path)
        assert {name: answer.headers[name] for name in HEADERS} == HEADERS
        assert "unsafe" not in answer.headers["content-security-policy"]
        assert "access-control-allow-origin" not in answer.headers

    @pytest.mark.parametrize("chunked", [False, True])
    def test_floods_are_stopped(self, chunked):
        with served(create_app(limits=Limits(bytes=1_000_000))) as client:
            address = f"{API}/sessions/{client.post(f'{API}/sessions').json()['session']}"
            content = (bytes(100_000) for _ in range(20)) if chunked else bytes(2_000_000)
            answer = client.put(f"{address}/photos/target", content=content)
            assert (answer.status_code, answer.json()["error"]["code"]) == (413, "too_large")
            assert "1 MB at most" in answer.json()["error"]["message"]

    def test_photos_with_too_many_pixels_are_refused(self):
        with served(create_app(limits=Limits(pixels=1000))) as client:
            address = f"{API}/sessions/{client.post(f'{API}/sessions').json()['session']}"
            answer = client.put(f"{address}/photos/target", content=sample("target").read_bytes())
            assert answer.status_code == 400
            assert "more than the 1000 px allowed" in answer.json()["error"]["message"]


class TestSessions:
    def test_nobody_sees_anothers_photos(self, client, place):
        other = f"{API}/sessions/{client.post(f'{API}/sessions').json()['session']}"
        assert client.get(f"{other}/photos/target").status_code == 404
        client.put(f"{other}/photos/target", content=png(np.full((90, 80), 99, np.uint8)))
        with Image.open(io.BytesIO(client.get(f"{place}/photos/target").content)) as mine:
            assert mine.size == (512, 512)
        for guess in ("", "x", "../" + place.rpartition("/")[2], place.rpartition("/")[2][:-1]):
            assert client.get(f"{API}/sessions/{guess}/photos/target").status_code == 404

    def test_an_ended_session_is_gone(self, client, place):
        address = f"{API}/sessions/{client.post(f'{API}/sessions').json()['session']}"
        client.delete(address)
        answer = client.post(f"{address}/samples")
        assert (answer.status_code, answer.json()["error"]["code"]) == (404, "not_found")
        assert client.get(f"{place}/photos/target").status_code == 200

    def test_idle_ones_expire(self, monkeypatch):
        store = Sessions()
        token = store.begin()
        now = time.monotonic()
        # Not `time.monotonic` itself: a server beside this test would sleep until then.
        later = SimpleNamespace(monotonic=lambda: now + module.EXPIRES + 1)
        monkeypatch.setattr(module, "time", later)
        with pytest.raises(StudioError, match="has ended"):
            store.get(token)
        assert len(store) == 0

    def test_their_number_and_their_memory_are_bounded(self):
        store = Sessions(most=3, most_bytes=1000)
        tokens = [store.begin() for _ in range(5)]
        assert len(store) == 3
        photo = read_image(io.BytesIO(png(np.zeros((20, 20), np.uint8))))  # 400 bytes
        for token in tokens[2:]:
            store.keep(store.get(token), "target", Portrait(photo, None, False))
        assert len(store) == 2
        with pytest.raises(StudioError):
            store.get(tokens[2])
        assert store.get(tokens[4]).portrait("target").photo is photo
        with pytest.raises(StudioError, match="no reference yet"):
            Session().portrait("reference")

    def test_previews_of_the_idle_go_before_their_photos(self):
        store = Sessions(most_bytes=1000)
        photo = read_image(io.BytesIO(png(np.zeros((20, 20), np.uint8))))  # 400 bytes
        idle, busy, one = (store.get(store.begin()) for _ in range(3))
        for session in (idle, busy):
            store.keep(session, "target", Portrait(photo, None, False))
            with session.memo.open():
                remembered(np.zeros)(shape=10, dtype="u1")
        idle.portraits["target"].previews[64] = replace(photo, pixels=photo.pixels.copy())
        with busy.lock:
            store.make_room(one)
            assert (idle.memo.size, idle.size, len(store)) == (0, 400, 3)
            assert busy.size == 410  # what is at work keeps what it works on
            store.keep(one, "target", Portrait(photo, None, False))
        assert len(store) == 2
        assert one.size == 400
