"""Many clients of the studio at once, honest and hostile: ``python -m benchmarks.load``.

Each honest client makes a session, sends photos, and asks for previews and files; it must get what the
first of them got. Each hostile one sends what a server may choke on, and must be refused. No answer may be a
failure of the server, and its memory is bounded.
"""

from __future__ import annotations

import io
import random
import subprocess
import sys
import threading
import time
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator
from importlib.resources import files
from pathlib import Path

import click
import httpx

#: MB that the server may hold, of which photos on their way are 400 and sessions, once there are 64, as many.
BOUND = 1200

_SERVE = "from relit.cli.app import main; main(['serve', '--port', '0'])"
_STRENGTHS = (0.25, 0.5, 1.0)
_BIG = b"9" * 400
#: Bodies that are no requests for a preview, and how they are refused.
_ODD = {
    "no JSON": (b"{" * 1000, 422),
    "no text": (b'{"view": "\xff"}', 400),
    "deep": (b"[" * 100_000, 400),
    "NaN": (b'{"options": {"lam": NaN}}', 400),
    "huge number": (b'{"options": {"lam": ' + _BIG + b"}}", 400),
    "half a pair": (b'{"options": {"light": "\\ud800"}}', 400),
    "unknown option": (b'{"options": {"self": 1}}', 400),
    "unknown field": (b'{"password": ""}', 422),
    "long": (bytes(5_000_000), 413),
}


class Tally:
    """What the clients saw, counted by kind."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.wrong: list[str] = []
        self.right: dict[str, bytes] = {}
        self._lock = threading.Lock()

    def count(self, what: str) -> None:
        """Count something."""
        with self._lock:
            self.counts[what] += 1

    def expect(self, kind: str, answer: httpx.Response, *statuses: int) -> None:
        """Count an answer, and note it if it is not as it should be."""
        self.count(f"{kind} {answer.status_code}")
        if answer.status_code not in statuses:
            self.wrong.append(f"{kind}: {answer.status_code} {answer.text[:200]}")
        elif answer.status_code >= 400 and set(answer.json()["error"]) != {"code", "message"}:
            self.wrong.append(f"{kind}: another form of failure: {answer.text[:200]}")

    def same(self, kind: str, content: bytes) -> None:
        """Note an answer that is not the one which the first client got."""
        with self._lock:
            if self.right.setdefault(kind, content) != content:
                self.wrong.append(f"{kind}: another answer than the first client's")


def honest(address: str, until: float, tally: Tally, seed: int) -> None:
    """Do what a person does, over and over."""
    draw = random.Random(seed)
    photo = (files("relit.photo") / "sample_photos" / "reference.jpg").read_bytes()
    with httpx.Client(base_url=address, timeout=120) as client:
        while time.monotonic() < until:
            session = f"/sessions/{client.post('/sessions').json()['session']}"
            loaded = client.post(f"{session}/samples")
            tally.expect("samples", loaded, 200)
            tally.same("samples", loaded.content)
            put = client.put(f"{session}/photos/reference", content=photo)
            while put.status_code == 429:  # floods take the memory there is
                tally.count("photo put off")
                time.sleep(float(put.headers["retry-after"]))
                put = client.put(f"{session}/photos/reference", content=photo)
            tally.expect("photo", put, 200)
            tally.same("photo", put.content)
            for sequence in range(3):
                strength = draw.choice(_STRENGTHS)
                wanted = {"options": {"strength": strength}, "side": 320, "sequence": sequence}
                answer = client.post(f"{session}/render", json=wanted)
                tally.expect("render", answer, 200)
                tally.same(f"render {strength}", answer.content)
            shown = client.get(f"{session}/photos/target", params={"side": 400})
            tally.expect("shown", shown, 200)
            tally.same("shown", shown.content)
            if draw.random() < 0.2:
                answer = client.post(f"{session}/export", json={"format": ".png"})
                tally.expect("export", answer, 200)
                with zipfile.ZipFile(io.BytesIO(answer.content)) as packed:
                    tally.same("export", packed.read("relit.png"))
            if draw.random() < 0.5:
                tally.expect("end", client.delete(session), 204)


def hostile(address: str, until: float, tally: Tally, seed: int) -> None:
    """Send what is not to be sent."""
    draw = random.Random(seed)
    photo = (files("relit.photo") / "sample_photos" / "target.png").read_bytes()
    with httpx.Client(base_url=address, timeout=120) as client:
        session = f"/sessions/{client.post('/sessions').json()['session']}"
        while time.monotonic() < until:
            damaged = bytearray(photo[: draw.randrange(100, 5000)])
            damaged[draw.randrange(len(damaged))] ^= 255
            bomb = photo[:16] + bytes([0, 1, 0, 0, 0, 1, 0, 0]) + photo[24:]  # claims 65536 by 65536 px
            for kind, file in (("damaged photo", bytes(damaged)), ("bomb", bomb)):
                put = client.put(f"{session}/photos/target", content=file)
                tally.expect(kind, put, 400, 429)
            tally.expect("stranger", client.post("/sessions", headers={"origin": "http://evil.example"}), 403)
            for host in ("evil.example", "[", ""):
                tally.expect("other name", client.get("/options", headers={"host": host}), 403, 400)
            guess = "".join(draw.choices("abcXYZ019-_", k=32))
            tally.expect("guess", client.get(f"/sessions/{guess}/photos/target"), 404)
            tally.expect("no such place", client.get(f"/{guess}"), 404)
            tally.expect("no such method", client.request("TRACE", session), 405)
            for kind, (body, status) in _ODD.items():
                headers = {"content-type": "application/json"}
                answer = client.post(f"{session}/render", content=body, headers=headers)
                tally.expect(kind, answer, status)
            try:
                tally.expect("flood", client.put(f"{session}/photos/target", content=_flood()), 413, 429)
            except httpx.TransportError:  # the server may hang up on who goes on sending
                tally.count("flood cut off")


def _flood() -> Iterator[bytes]:
    """Send as much as may be, hold it there, and then send more."""
    for number in range(250):
        if number == 190:
            time.sleep(3)
        yield bytes(1 << 20)


def load(clients: int, seconds: float) -> tuple[Tally, float]:
    """Run a server under load; return what the clients saw, and the MB that the server held at most.

    Parameters
    ----------
    clients : int
        Every fourth is hostile.
    seconds : float
        How long they go on.
    """
    tally = Tally()
    with subprocess.Popen([sys.executable, "-c", _SERVE], stderr=subprocess.PIPE, text=True) as server:
        assert server.stderr is not None
        address = server.stderr.readline().split()[-1]
        until = time.monotonic() + seconds

        def run(kind: Callable[[str, float, Tally, int], None], number: int) -> None:
            try:
                kind(address, until, tally, number)
            except Exception as error:
                tally.wrong.append(f"{kind.__name__}: {error!r}")

        threads = [
            threading.Thread(target=run, args=(hostile if number % 4 == 3 else honest, number))
            for number in range(clients)
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        peak = _peak(server.pid)
        server.terminate()
        said = server.communicate(timeout=60)[1]
    if "Traceback" in said:
        tally.wrong.append(f"the server failed: {said[-500:]}")
    if peak > BOUND:
        tally.wrong.append(f"the server held {peak:.0f} MB, more than {BOUND}")
    return tally, peak


@click.command(help=__doc__)
@click.option("--clients", default=20, show_default=True)
@click.option("--seconds", default=60.0, show_default=True)
def main(clients: int, seconds: float) -> None:
    """Run the load test; fail if anything was not as it should be."""
    tally, peak = load(clients, seconds)
    for kind, count in sorted(tally.counts.items()):
        click.echo(f"{count:6d}  {kind}")
    click.echo(f"server: {peak:.0f} MB at most, of {BOUND}")
    for wrong in tally.wrong[:10]:
        click.echo(f"WRONG  {wrong}")
    sys.exit(bool(tally.wrong))


def _peak(process: int) -> float:
    """Return the most MB of memory that a process held; 0 where the system does not tell."""
    try:
        lines = Path(f"/proc/{process}/status").read_text().splitlines()
    except OSError:
        return 0
    return next(int(line.split()[1]) / 1e3 for line in lines if line.startswith("VmHWM"))


if __name__ == "__main__":
    main()
