"""What has stopped the studio's server once: attackers, each from addresses of its own, for a while.

They go no further than this machine, end by themselves, and note what they are answered.
"""

from __future__ import annotations

import random
import socket
import struct
import time
import zlib
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from importlib.resources import files

import httpx
import numpy as np

from benchmarks.tally import Tally, client_at

#: Answers that tell an attacker to stop: 503 must say when to come back.
_REFUSED = (400, 408, 409, 413, 429, 503)
_BIG = b"9" * 400
#: Bodies that are no requests for a preview, and how they are refused.
_ODD = {
    "no JSON": (b"{" * 1000, 400),
    "no text": (b'{"view": "\xff"}', 400),
    "deep": (b"[" * 100_000, 400),
    "NaN": (b'{"options": {"lam": NaN}}', 400),
    "huge number": (b'{"options": {"lam": ' + _BIG + b"}}", 400),
    "half a pair": (b'{"options": {"light": "\\ud800"}}', 400),
    "unknown option": (b'{"options": {"self": 1}}', 400),
    "unknown field": (b'{"password": ""}', 422),
    "long": (bytes(5_000_000), 413),
}


@dataclass(frozen=True)
class Attack:
    """Whom to attack, from where, until when.

    Attributes
    ----------
    address : str
        Of the API.
    number : int
        Of the attacker: the third part of its addresses.
    until : float
        By the monotonic clock.
    tally : Tally
        Where it notes what it is answered.
    """

    address: str
    number: int
    until: float
    tally: Tally

    @property
    def goes_on(self) -> bool:
        """Whether there is time left."""
        return time.monotonic() < self.until

    def turns(self) -> Iterator[None]:
        """Yield as long as there is time left, and once at least: to come here may have taken it."""
        yield
        while self.goes_on:
            yield

    def client(self, last: int = 1) -> httpx.Client:
        """Return a client of an address of its own."""
        return client_at(self.address, f"127.0.{self.number}.{last}")

    def socket(self, last: int = 1) -> socket.socket:
        """Return a connection from an address of its own."""
        url = httpx.URL(self.address)
        try:
            made = socket.create_connection(
                (url.host, url.port), 30, source_address=(f"127.0.{self.number}.{last}", 0)
            )
        except OSError:  # where the system has but one address of its own
            made = socket.create_connection((url.host, url.port), 30)
        return made

    def session(self, client: httpx.Client) -> str:
        """Return the path of a session with the sample photos."""
        begun = client.post("/sessions")
        self.tally.expect("attacker's session", begun, 201)
        path = f"/sessions/{begun.json()['session']}"
        self.tally.expect("attacker's samples", client.post(f"{path}/samples"), 200)
        return path


def many_renders(attack: Attack) -> None:
    """Ask for 45 previews at once in one session, over and over."""
    with attack.client() as client, ThreadPoolExecutor(45) as threads:
        path = attack.session(client)

        def render(number: int) -> None:
            wanted = {"options": {"strength": 1 + number / 50}, "side": 1600}
            attack.tally.expect("many renders", client.post(f"{path}/render", json=wanted), 200, 503)

        for _ in attack.turns():
            list(threads.map(render, range(45)))
            time.sleep(0.1)


def held_uploads(attack: Attack) -> None:
    """Send 199.99 of 200 MB twice, from two addresses, and then a byte every 8 s."""
    with ExitStack() as stack:
        held = []
        for last in (1, 2):
            with attack.client(last) as client:
                path = f"/sessions/{client.post('/sessions').json()['session']}/photos/target"
            held.append(stack.enter_context(attack.socket(last)))
            url = httpx.URL(attack.address)
            head = f"PUT {url.path}{path} HTTP/1.1\r\nhost: {url.host}\r\ncontent-length: 200000000\r\n\r\n"
            with suppress(OSError):
                held[-1].sendall(head.encode())
                for _ in range(19999):
                    held[-1].sendall(bytes(10_000))
        attack.tally.count("held uploads")
        for _ in attack.turns():
            for one in held:
                with suppress(OSError):  # it may have been refused
                    one.sendall(b"\0")
            time.sleep(min(8, max(attack.until - time.monotonic(), 0)))


def many_sessions(attack: Attack) -> None:
    """Begin 64 sessions, over and over."""
    with attack.client() as client:
        for _ in attack.turns():
            for _ in range(64):
                attack.tally.expect("many sessions", client.post("/sessions"), 201, 503)
            time.sleep(1)


def half_heads(attack: Attack) -> None:
    """Open 190 connections, and send half a head on each."""
    with ExitStack() as stack:
        for number in range(190):
            if not number or attack.goes_on:
                with suppress(OSError):
                    stack.enter_context(attack.socket()).sendall(b"GET /api/v1/options HTTP/1.1\r\nhost: 127")
                attack.tally.count("half a head")
        time.sleep(max(attack.until - time.monotonic(), 0))


def shrunk_landmarks(attack: Attack) -> None:
    """Shrink the target's landmarks to one pixel, and more, and ask for previews."""
    with attack.client() as client:
        path = attack.session(client)
        marks = client.get(f"{path}/landmarks/target").json()
        points, scheme = np.array(marks["points"]), marks["scheme"]
        for _ in attack.turns():
            for share in (1e-3, 1e-4, 1e-6):
                shrunk = (points.mean(axis=0) + share * (points - points.mean(axis=0))).tolist()
                put = client.put(f"{path}/landmarks/target", json={"scheme": scheme, "points": shrunk})
                attack.tally.expect("shrunk landmarks", put, 200, 400)
                for method in ("shading", "ltv"):
                    wanted = {"options": {"method": method}, "side": 512}
                    answer = client.post(f"{path}/render", json=wanted)
                    attack.tally.expect("shrunk face", answer, 200, *_REFUSED)


def hung_up_exports(attack: Attack) -> None:
    """Ask for 12 exports, and hang up."""
    url = httpx.URL(attack.address)
    with attack.client() as client:
        path = attack.session(client)
        body = b'{"format": ".psd"}'
        head = (
            f"POST {url.path}{path}/export HTTP/1.1\r\nhost: {url.host}\r\ncontent-type: application/json\r\n"
            f"content-length: {len(body)}\r\n\r\n"
        )
        for _ in attack.turns():
            with ExitStack() as stack:
                for _ in range(12):
                    stack.enter_context(attack.socket()).sendall(head.encode() + body)
                    attack.tally.count("hung-up export")
                time.sleep(0.2)
            time.sleep(0.3)


def black_photos(attack: Attack) -> None:
    """Send six black photos of 100 million px, of 300 kB each."""
    photo = black_png(10_000)
    with attack.client() as client:
        path = f"/sessions/{client.post('/sessions').json()['session']}"
        for _ in attack.turns():
            for number in range(6):
                put = client.put(f"{path}/references/{number}", content=photo)
                attack.tally.expect("black photo", put, 200, *_REFUSED)
                if not attack.goes_on:
                    break


def black_png(side: int) -> bytes:
    """Return a black photo, in RGB, made row by row."""
    packer, row = zlib.compressobj(9), bytes(1 + 3 * side)
    packed = b"".join([*(packer.compress(row) for _ in range(side)), packer.flush()])
    head = struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    parts = [(b"IHDR", head), (b"IDAT", packed), (b"IEND", b"")]
    chunks = [
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in parts
    ]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


def odd_requests(attack: Attack) -> None:
    """Send what is not to be sent."""
    draw, expect = random.Random(attack.number), attack.tally.expect
    photo = (files("relit.photo") / "sample_photos" / "target.png").read_bytes()
    with attack.client() as client:
        session = f"/sessions/{client.post('/sessions').json()['session']}"
        for _ in attack.turns():
            damaged = bytearray(photo[: draw.randrange(100, 5000)])
            damaged[draw.randrange(len(damaged))] ^= 255
            bomb = photo[:16] + bytes([0, 1, 0, 0, 0, 1, 0, 0]) + photo[24:]  # claims 65536 by 65536 px
            for kind, file in (("damaged photo", bytes(damaged)), ("bomb", bomb)):
                expect(kind, client.put(f"{session}/photos/target", content=file), 400, 429)
            expect("stranger", client.post("/sessions", headers={"origin": "http://evil.example"}), 403)
            for host in ("evil.example", "[", ""):
                expect("other name", client.get("/options", headers={"host": host}), 403, 400)
            guess = "".join(draw.choices("abcXYZ019-_", k=32))
            expect("guess", client.get(f"/sessions/{guess}/photos/target"), 404)
            expect("no such place", client.get(f"/{guess}"), 404)
            expect("no such method", client.request("TRACE", session), 405)
            for kind, (body, status) in _ODD.items():
                headers = {"content-type": "application/json"}
                expect(kind, client.post(f"{session}/render", content=body, headers=headers), status)
            try:
                expect("flood", client.put(f"{session}/photos/target", content=_flood()), 413, 429)
            except httpx.TransportError:  # the server may hang up on who goes on sending
                attack.tally.count("flood cut off")


def _flood() -> Iterator[bytes]:
    """Send as much as may be, hold it there, and then send more."""
    for number in range(250):
        if number == 190:
            time.sleep(3)
        yield bytes(1 << 20)


ATTACKERS: dict[str, Callable[[Attack], None]] = {
    attacker.__name__: attacker
    for attacker in (
        many_renders,
        held_uploads,
        many_sessions,
        half_heads,
        shrunk_landmarks,
        hung_up_exports,
        black_photos,
        odd_requests,
    )
}
