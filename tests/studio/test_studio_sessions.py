"""Who may ask the studio, how much it takes, and that sessions keep to themselves."""

import io
import time
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from relit.photo.photo import Photo
from relit.photo.samples import sample
from relit.runtime.memo import remembered
from relit.studio import sessions as module
from relit.studio.app import create_app
from relit.studio.guard import HEADERS
from relit.studio.limits import Limits
from relit.studio.models import Seats
from relit.studio.session import ROLES, Portrait, Session, StudioError
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
            for method, path in (("POST", f"{API}/sessions"), ("GET", f"{API}/options"), ("GET", "/")):
                answer = client.request(method, path, headers=headers)
                assert (answer.status_code, answer.json()["error"]["code"]) == (403, "forbidden")
        for headers in (
            {"host": "localhost:1234"},
            {"host": "[::1]:5"},
            {"origin": str(client.base_url).rstrip("/")},
        ):
            answer = client.post(f"{API}/sessions", headers=headers)
            assert answer.status_code == 201
            assert client.get(f"{API}/options", headers=headers).status_code == 200

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
            said = "claims 512x512 px, more than the 1000 px allowed; save it smaller"
            assert answer.json()["error"]["message"] == said


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

    @pytest.mark.parametrize("expires", [module.EXPIRES, module.EXPIRES_AT_HOME])
    def test_idle_ones_expire(self, clock, expires):
        store = Sessions(expires=expires)
        token = store.begin()
        clock.pass_by(expires - 1)
        assert store.get(token)
        clock.pass_by(expires + 1)
        with pytest.raises(StudioError, match="has ended"):
            store.get(token)
        assert len(store) == 0

    def test_a_live_one_is_ended_by_nobody_else(self, clock):
        store = Sessions(Limits(sessions=4, sessions_per_client=2))
        mine = [store.begin(client="me") for _ in range(2)]
        for _ in range(64):
            error = refused(lambda: store.begin(client="me"))
            assert (error.status, error.code) == (503, "busy")
            assert 0 < error.again <= Limits.live_seconds
        others = [store.begin(client=client) for client in "ab"]
        assert refused(lambda: store.begin(client="c")).code == "busy"
        assert all(store.get(token) for token in (*mine, *others))
        clock.pass_by(Limits.live_seconds - 1)
        store.get(mine[0])
        clock.pass_by(2)
        store.begin(client="me")  # the idle one makes way, not the one that was used lately
        assert store.get(mine[0])
        assert refused(lambda: store.get(mine[1])).code == "not_found"
        store.begin(client="c")
        assert refused(lambda: store.get(others[0])).code == "not_found"
        assert store.get(others[1])
        assert len(store) == 4

    def test_one_that_waits_for_an_answer_is_live_however_long_that_takes(self, clock):
        store = Sessions(Limits(sessions=2, memory=1000))
        token = store.begin(client="me")
        with store.using(token) as session:
            store.keep(session, "target", blank(600))
            clock.pass_by(module.EXPIRES + 1)
            other = store.begin(client="a")
            assert refused(lambda: store.keep(store.get(other), "target", blank(600))).code == "busy"
            clock.pass_by(Limits.live_seconds + 1)
            other = store.begin(client="b")  # in place of the idle one
            with store.using(other):
                clock.pass_by(Limits.live_seconds + 1)
                assert refused(lambda: store.begin(client="c")).code == "busy"
        clock.pass_by(Limits.live_seconds - 1)
        assert refused(lambda: store.begin(client="c")).code == "busy"  # both have just had their answers
        clock.pass_by(2)
        store.begin(client="c")
        assert (len(store), store.get(token)) == (2, session)

    def test_one_that_its_client_ends_meanwhile_stays_ended(self):
        store = Sessions()
        token = store.begin()
        with store.using(token):
            store.end(token)
        assert len(store) == 0

    def test_a_photo_on_its_way_keeps_its_session(self):
        with served(create_app(limits=Limits(sessions=1, live_seconds=0.01))) as client:
            address = f"{API}/sessions/{client.post(f'{API}/sessions').json()['session']}"
            photo, asked = png(np.full((90, 80), 99, np.uint8)), []

            def body():
                yield photo[:50]
                time.sleep(0.1)
                asked.append(client.post(f"{API}/sessions"))
                yield photo[50:]

            assert client.put(f"{address}/photos/target", content=body()).status_code == 200
            assert [answer.json()["error"]["code"] for answer in asked] == ["busy"]

    def test_a_client_has_no_more_than_its_share_of_memory(self, clock):
        store = Sessions(Limits(memory=2000))
        one, two, other = (store.get(store.begin(client=client)) for client in ("me", "me", "other"))
        for session, role in ((one, "target"), (one, "reference"), (two, "target")):
            store.keep(session, role, blank())
        error = refused(lambda: store.keep(two, "reference", blank()))
        assert (error.status, error.code) == (409, "full")
        assert refused(lambda: store.keep_in_gallery(two, "a", blank())).code == "full"
        assert (list(two.portraits), two.gallery) == (["target"], {})
        store.keep(other, "target", blank())
        store.keep(two, "target", blank())  # in place of another
        clock.pass_by(Limits.live_seconds + 1)
        store.keep(two, "reference", blank())  # the idle one of this client makes way
        assert (len(store), two.size, other.size) == (2, 800, 400)

    def test_where_memory_is_full_the_idle_go_and_the_live_stay(self, clock):
        store = Sessions(Limits(memory=1000))
        sessions = {}
        for client in "abc":
            sessions[client] = store.get(store.begin(client=client))
            if client != "c":
                store.keep(sessions[client], "target", blank())
                clock.pass_by(Limits.live_seconds / 2)
        error = refused(lambda: store.keep(sessions["c"], "target", blank()))
        assert (error.status, error.code) == (503, "busy")
        assert not sessions["c"].portraits
        clock.pass_by(1)
        store.keep(sessions["c"], "target", blank())
        assert len(store) == 2
        with pytest.raises(StudioError, match="no reference yet"):
            Session().portrait("reference")

    def test_previews_go_before_photos(self):
        store = Sessions(Limits(memory=1000))
        idle, busy, one = (store.get(store.begin(client=client)) for client in "abc")
        for session in (idle, busy):
            store.keep(session, "target", blank())
            with session.memo.open():
                remembered(np.zeros)(shape=10, dtype="u1")
        photo = idle.portraits["target"].photo
        idle.portraits["target"].previews[64] = replace(photo, pixels=photo.pixels.copy())
        with store.computing(busy):
            with store.computing(one):
                pass
            assert (idle.memo.size, idle.size) == (0, 400)
            assert busy.size == 410  # what is at work keeps what it works on
            store.keep(one, "target", blank(100))
        assert (len(store), one.size) == (3, 100)

    def test_what_is_called_off_leaves_no_more_than_there_may_be(self):
        store = Sessions(Limits(memory=1000))
        idle, one = (store.get(store.begin(client=client)) for client in "ab")
        store.keep(idle, "target", blank(700))
        with idle.memo.open():
            remembered(np.zeros)(shape=100, dtype="u1")

        def make():
            with store.computing(one):
                with one.memo.open():
                    remembered(np.zeros)(shape=250, dtype="u1")
                raise StudioError(499, "gone", "The client has hung up.")

        assert refused(make).code == "gone"
        assert (idle.memo.size, store.size) == (0, 950)

    def test_photos_that_the_studio_was_started_with_have_their_names(self):
        store = Sessions()
        photo = Photo(np.full((60, 80, 3), 90, np.uint8))
        seats = Seats.of(store.get(store.begin([("me.png", photo), ("film.jpg", photo)])).portraits)
        assert (seats.target.name, seats.reference.name) == ("me.png", "film.jpg")

    def test_who_works_on_photos_keeps_those_it_began_with(self):
        store, session = Sessions(), Session()
        for role in ROLES:
            store.keep(session, role, blank())
        before, photos = session.portraits, dict(session.portraits)
        store.swap(session)
        store.keep(session, "target", blank())
        assert before == photos
        assert session.portraits["reference"] is photos["target"]


def blank(size=400):
    """A photo of so many bytes."""
    return Portrait(Photo(np.zeros((size // 20, 20), np.uint8)), None, False)


def refused(act):
    with pytest.raises(StudioError) as caught:
        act()
    return caught.value


@pytest.fixture
def clock(monkeypatch):
    """The clock of sessions, which the test puts forward."""

    class Clock:
        now = time.monotonic()

        def monotonic(self):
            return self.now

        def pass_by(self, seconds):
            self.now += seconds

    # Not `time.monotonic` itself: a server beside this test would sleep until then.
    clock = Clock()
    monkeypatch.setattr(module, "time", clock)
    return clock
