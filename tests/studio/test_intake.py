"""What clients send at once takes no more memory than it may, and what is refused makes room."""

import asyncio
import json
from concurrent.futures import ThreadPoolExecutor

import pytest

from relit.studio.intake import LEAST_RATE, SMALL_BYTES, Intake
from relit.studio.limits import Limits

PHOTO, JSON = "/api/v1/sessions/x/photos/target", "/api/v1/sessions/x/render"


class Client:
    """A request whose parts come when the test sends them."""

    def __init__(self, intake, path, length=None, who="10.0.0.1"):
        self.parts, self.answers = asyncio.Queue(), []
        headers = [] if length is None else [(b"content-length", str(length).encode())]
        scope = {"type": "http", "method": "PUT", "path": path, "headers": headers, "client": (who, 1)}
        self.task = asyncio.ensure_future(intake(scope, self.parts.get, self._take))

    async def _take(self, message):
        self.answers.append(message)

    async def sends(self, size, *, last=False):
        await self.parts.put({"type": "http.request", "body": bytes(size), "more_body": not last})
        for _ in range(20):
            await asyncio.sleep(0)

    @property
    def status(self):
        return self.answers[0]["status"] if self.answers else None

    @property
    def code(self):
        return json.loads(self.answers[1]["body"])["error"]["code"]


@pytest.fixture
def work():
    """What the application waits for, once it has a body."""
    return []


@pytest.fixture
def app(work):
    async def app(_scope, receive, send):
        try:
            while (await receive()).get("more_body"):
                pass
        except Exception:
            # As a framework does, which takes for a bad body whatever happens while it is read.
            await send({"type": "http.response.start", "status": 400, "headers": []})
            raise
        for wait in work:
            await wait.wait()
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b""})

    return app


class Quick(asyncio.SelectorEventLoop):
    """A loop in which time passes at once where all wait for it."""

    def __init__(self):
        super().__init__()
        self.now, self._select = 1000.0, self._selector.select
        self._selector.select = self._pass

    def time(self):
        return self.now

    def _pass(self, timeout=None):
        self.now += timeout or 0
        return self._select(0)


def played(scene, loop=None):
    """Run a scene in a thread of its own: the tests of the page have a loop running in the main one."""

    def play():
        with asyncio.Runner(loop_factory=loop) as runner:
            return runner.run(scene)

    with ThreadPoolExecutor(1) as thread:
        return thread.submit(play).result()


def test_one_body_is_bounded(app):
    async def scene():
        intake = Intake(app, Limits(bytes=10_000_000))
        told = Client(intake, PHOTO, length=10_000_001)
        await told.task
        assert (told.status, told.code) == (413, "too_large")
        grown = Client(intake, PHOTO)
        await grown.sends(10_000_000)
        assert grown.status is None
        await grown.sends(1)
        assert (grown.status, grown.code) == (413, "too_large")
        assert len(grown.answers) == 2  # and nothing of the application's
        odd = Client(intake, JSON, length=SMALL_BYTES + 1)
        await odd.task
        assert odd.status == 413
        whole = Client(intake, PHOTO, length=10_000_000)
        await whole.sends(10_000_000, last=True)
        assert whole.status == 200

    played(scene())


def test_all_bodies_together_are_bounded(app, work):
    async def scene():
        intake = Intake(app, Limits(bytes=10_000_000))
        work.append(done := asyncio.Event())
        first, second, third = (Client(intake, PHOTO, who=f"10.0.0.{number}") for number in range(3))
        await first.sends(9_000_000, last=True)  # all there, and being worked on: still in memory
        await second.sends(9_000_000)
        await third.sends(2_000_001)
        assert (third.status, third.code) == (429, "busy")
        assert (b"retry-after", b"1") in third.answers[0]["headers"]
        assert intake.photos.held() == 18_000_000
        small = Client(intake, JSON)  # a flood of photos keeps nobody from the rest
        await small.sends(1000, last=True)
        done.set()
        await small.task
        await first.task
        assert (first.status, small.status) == (200, 200)
        again = Client(intake, PHOTO, who="10.0.0.3")
        await again.sends(9_000_000, last=True)
        await second.sends(1_000_000, last=True)
        assert (again.status, second.status) == (200, 200)
        assert (intake.photos.held(), intake.others.held()) == (0, 0)

    played(scene())


def test_a_body_that_stops_coming_is_given_up(app, work):
    async def scene():
        intake = Intake(app, Limits(bytes=10_000_000), patience=0.05)
        work.append(done := asyncio.Event())
        slow, whole = Client(intake, PHOTO), Client(intake, PHOTO)
        await whole.sends(5, last=True)  # work may take longer than patience
        await slow.sends(5)
        await asyncio.wait_for(slow.task, 120)
        assert (slow.status, slow.code) == (408, "too_slow")
        assert intake.photos.held() == 5
        done.set()
        await whole.task
        assert whole.status == 200

    played(scene())


def test_a_client_sends_no_more_than_its_share(app):
    async def scene():
        intake = Intake(app, Limits(bytes=10_000_000))
        first, second = Client(intake, PHOTO), Client(intake, PHOTO)
        other = Client(intake, PHOTO, who="10.0.0.2")
        await first.sends(9_990_000)
        await second.sends(10_001)
        assert (second.status, second.code) == (429, "busy")
        await other.sends(10_000_000, last=True)
        assert other.status == 200
        first.task.cancel()

    played(scene())


def test_what_is_held_back_gives_way_to_what_comes(app):
    async def scene():
        clock = asyncio.get_running_loop().time
        intake = Intake(app, Limits(bytes=10_000_000))
        held = [Client(intake, PHOTO, who=f"10.0.0.{number}") for number in (1, 2)]
        for one in held:
            await one.sends(9_999_999)
        begun = clock()
        await asyncio.sleep(6)
        other = Client(intake, PHOTO, who="10.0.0.3")
        await other.sends(10_000_000, last=True)
        assert other.status == 200
        assert [one.code for one in held if one.status] == ["too_slow"]
        assert clock() - begun < 7
        for one in held:
            one.task.cancel()

    played(scene(), Quick)


def test_a_body_has_so_long_and_as_much_longer_as_it_comes(app):
    async def scene():
        clock = asyncio.get_running_loop().time
        intake = Intake(app, Limits(bytes=200_000_000, body_seconds=120))

        async def lasted(client, size):
            """Send so many bytes every 8 s; return for how long that went on."""
            begun = clock()
            while client.status is None and clock() - begun < 3000:
                await client.sends(size)
                await asyncio.sleep(8)
            return clock() - begun

        trickling = Client(intake, PHOTO)
        await trickling.sends(199_990_000)
        assert 112 <= await lasted(trickling, 1) <= 136
        assert trickling.code == "too_slow"
        assert 112 <= await lasted(Client(intake, PHOTO), 1) <= 136
        slow = Client(intake, PHOTO)
        assert await lasted(slow, 8 * LEAST_RATE) >= 3000
        await slow.sends(1, last=True)
        assert slow.status == 200
        assert intake.photos.held() == 0

    played(scene(), Quick)
