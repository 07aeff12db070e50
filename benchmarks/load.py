"""Many clients of the studio at once, honest and hostile: ``python -m benchmarks.load``.

Each honest client makes a session, loads the samples, and asks for previews, landmarks and photos; it must
get what the first of them got. Each hostile one sends what a server may choke on, and must be refused.
"""

from __future__ import annotations

import os
import random
import subprocess
import sys
import threading
import time
from collections import Counter
from importlib.resources import files
from pathlib import Path

import click
import httpx

_SERVE = "from relit.cli import main; main(['serve', '--port', '0'])"
_STRENGTHS = (0.25, 0.5, 1.0)


class Tally:
    """What the clients saw, counted by kind."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.wrong: list[str] = []
        self.right: dict[str, bytes] = {}
        self._lock = threading.Lock()

    def expect(self, kind: str, answer: httpx.Response, status: int, *, same_as: str = "") -> None:
        """Count an answer, and note it if it is not as it should be."""
        with self._lock:
            self.counts[f"{kind} {answer.status_code}"] += 1
            if answer.status_code != status:
                self.wrong.append(f"{kind}: {answer.status_code} {answer.text[:200]}")
            elif same_as and self.right.setdefault(same_as, answer.content) != answer.content:
                self.wrong.append(f"{kind}: another picture than the first client's")


def honest(address: str, until: float, tally: Tally, seed: int) -> None:
    """Do what a person does, over and over."""
    draw = random.Random(seed)
    with httpx.Client(base_url=address, timeout=120) as client:
        while time.monotonic() < until:
            session = f"/sessions/{client.post('/sessions').json()['session']}"
            tally.expect("samples", client.post(f"{session}/samples"), 200, same_as="samples")
            for sequence in range(3):
                strength = draw.choice(_STRENGTHS)
                wanted = {"options": {"strength": strength}, "side": 320, "sequence": sequence}
                answer = client.post(f"{session}/render", json=wanted)
                tally.expect("render", answer, 200, same_as=f"render {strength}")
            photo = client.get(f"{session}/photos/target", params={"side": 400})
            tally.expect("photo", photo, 200, same_as="photo")
            if draw.random() < 0.5:
                tally.expect("end", client.delete(session), 204)


def hostile(address: str, until: float, tally: Tally, seed: int) -> None:
    """Send what is not to be sent."""
    draw = random.Random(seed)
    photo = (files("relit") / "sample_photos" / "target.png").read_bytes()
    with httpx.Client(base_url=address, timeout=120) as client:
        session = f"/sessions/{client.post('/sessions').json()['session']}"
        while time.monotonic() < until:
            damaged = bytearray(photo[: draw.randrange(100, 5000)])
            damaged[draw.randrange(len(damaged))] ^= 255
            put = client.put(f"{session}/photos/target", content=bytes(damaged))
            tally.expect("damaged photo", put, 400)
            tally.expect("stranger", client.post("/sessions", headers={"origin": "http://evil.example"}), 403)
            tally.expect("other name", client.get("/options", headers={"host": "evil.example"}), 403)
            guess = "".join(draw.choices("abcXYZ019-_", k=32))
            tally.expect("guess", client.get(f"/sessions/{guess}/photos/target"), 404)
            tally.expect("no JSON", client.post(f"{session}/render", content=b"{" * 1000), 422)
            deep = {"options": {"lam": [[1]]}, "sequence": 1}
            tally.expect("odd option", client.post(f"{session}/render", json=deep), 400)
            flood = (bytes(1 << 20) for _ in range(250))
            try:
                tally.expect("flood", client.put(f"{session}/photos/target", content=flood), 413)
            except httpx.TransportError:  # the server may hang up on who goes on sending
                tally.counts["flood cut off"] += 1


@click.command(help=__doc__)
@click.option("--clients", default=20, show_default=True)
@click.option("--seconds", default=60.0, show_default=True)
def main(clients: int, seconds: float) -> None:
    """Run the load test; fail if anything was not as it should be."""
    server = subprocess.Popen([sys.executable, "-c", _SERVE], stderr=subprocess.PIPE, text=True)
    assert server.stderr is not None
    line = server.stderr.readline()
    address = line.split()[-1]
    tally, until = Tally(), time.monotonic() + seconds
    kinds = [hostile if number % 4 == 3 else honest for number in range(clients)]
    threads = [
        threading.Thread(target=kind, args=(address, until, tally, number))
        for number, kind in enumerate(kinds)
    ]
    for thread in threads:
        thread.start()
    peak = 0
    while any(thread.is_alive() for thread in threads):
        time.sleep(0.5)
        peak = max(peak, _resident(server.pid))
    server.terminate()
    server.wait(30)
    for kind, count in sorted(tally.counts.items()):
        click.echo(f"{count:6d}  {kind}")
    click.echo(f"server: {peak / 1e6:.0f} MB at most")
    for wrong in tally.wrong[:10]:
        click.echo(f"WRONG  {wrong}")
    sys.exit(bool(tally.wrong))


def _resident(process: int) -> int:
    """Return the bytes of memory that a process holds; 0 where the system does not tell."""
    try:
        pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    except OSError:
        return 0
    return pages * os.sysconf("SC_PAGE_SIZE")


if __name__ == "__main__":
    main()
