"""Honest clients of the studio beside attackers: ``python -m benchmarks.load``.

Each honest client makes a session, sends photos, and asks for previews and files; it must get what the first
of them got, and beside each attacker within five times as long as without. Then all come at once. None may be
answered with a failure of the server, and its memory is bounded.
"""

from __future__ import annotations

import io
import random
import subprocess
import sys
import threading
import time
import zipfile
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import click
import httpx
import numpy as np
from PIL import Image

from benchmarks.attackers import ATTACKERS, Attack
from benchmarks.tally import Tally, client_at
from relit.photo.samples import sample
from relit.studio.limits import Limits

#: So that the bound is reached: a photo of 100 million px is read within a client's share of working memory.
LIMITS = Limits(memory=800_000_000, working_memory=1_600_000_000)

#: MB that the server may hold: that, bodies on their way, and what it is made of.
BOUND = round((LIMITS.memory + LIMITS.working_memory + 2 * LIMITS.bytes) / 1e6) + 400

#: By how much longer nine of ten honest answers may take than without attackers: on a machine that is shared,
#: as those of tests are, the tenth waits for whatever else that does.
SLOWER = 5
_SHARE = 0.9
_ENOUGH = 20  # answers of a kind, for that: of ten, one pause of the machine may hit two
_NOTICED = 0.2  # s: what takes less counts as that, since an answer within a second is not noticed

_SERVE = """
from relit.studio.app import LOCAL, create_app
from relit.studio.limits import Limits
from relit.studio.server import Server
limits = {limits}
app = create_app(hosts=LOCAL, page=False, limits=limits)
Server(app, "127.0.0.1", 0, lambda url: print(url + "api/v1", flush=True), limits=limits).run()
"""
_STRENGTHS = (0.25, 0.5, 1.0)
_THINKS = 4.0  # s at most, between what a person does
#: The third part of an attacker's addresses, by its name.
_NUMBERS = {name: 10 + number for number, name in enumerate(ATTACKERS)}


def honest(address: str, number: int, goes_on: Callable[[], bool], tally: Tally) -> None:
    """Do what a person does, over and over, with small photos: most of the time she looks and thinks."""
    draw, (target, reference) = random.Random(number), small_photos()
    with client_at(address, f"127.0.1.{number + 1}") as client:

        def ask(kind: str, method: str, path: str, *statuses: int, **sent: Any) -> httpx.Response:
            with tally.timed(kind):
                answer = client.request(method, path, **sent)
                while answer.status_code == 429:  # until it is seen that others hold their photos back
                    tally.count(f"{kind} put off")
                    time.sleep(float(answer.headers["retry-after"]))
                    answer = client.request(method, path, **sent)
            tally.expect(kind, answer, *(statuses or (200,)))
            if goes_on():
                time.sleep(draw.uniform(0, _THINKS))
            return answer

        while goes_on():
            ask("options", "GET", "/options")
            session = f"/sessions/{ask('session', 'POST', '/sessions', 201).json()['session']}"
            for role, photo in (("target", target), ("reference", reference)):
                tally.same(role, ask("photo", "PUT", f"{session}/photos/{role}", content=photo).content)
            for sequence, strength in enumerate(draw.sample(_STRENGTHS, len(_STRENGTHS))):
                kind = "render again" if sequence else "render"  # which takes less, since much is remembered
                wanted = {"options": {"strength": strength}, "side": 320, "sequence": sequence}
                tally.same(f"render {strength}", ask(kind, "POST", f"{session}/render", json=wanted).content)
            ask("landmarks", "GET", f"{session}/landmarks/target")
            tally.same("shown", ask("shown", "GET", f"{session}/photos/target", params={"side": 400}).content)
            made = ask("export", "POST", f"{session}/export", json={"format": ".png"})
            with zipfile.ZipFile(io.BytesIO(made.content)) as packed:
                tally.same("export", packed.read("relit.png"))
            tally.expect("end", client.delete(session), 204)


def small_photos() -> list[bytes]:
    """Return the faces of the sample photos as small files."""
    made = []
    for role, box in (("target", (150, 40, 300, 210)), ("reference", (230, 130, 630, 650))):
        file = io.BytesIO()
        with Image.open(sample(role)) as photo:
            photo.convert("RGB").crop(box).resize((160, 200)).save(file, "PNG")
        made.append(file.getvalue())
    return made


def load(clients: int, quiet: float, seconds: float, phases: Sequence[Sequence[str]]) -> tuple[Tally, float]:
    """Run a server under load; return what the clients saw, and the MB that the server held at most.

    Parameters
    ----------
    clients : int
        Honest ones.
    quiet : float
        How long they are alone, at first and then before each phase.
    seconds : float
        How long each phase lasts.
    phases : sequence of sequences of str
        The attackers of each phase, by name.
    """
    tally, over = Tally(), threading.Event()
    command = [sys.executable, "-c", _SERVE.format(limits=repr(LIMITS))]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, text=True, **pipes) as server:  # type: ignore[call-overload]
        address = server.stdout.readline().strip()
        assert address, server.stderr.read()

        def run(name: str, act: Callable[[], None]) -> threading.Thread:
            def noted() -> None:
                try:
                    act()
                except Exception as error:
                    tally.wrong.append(f"{name}: {error!r}")

            thread = threading.Thread(target=noted)
            thread.start()
            return thread

        # The first compiles, and knows what is right.
        turns = iter([True])
        run("honest", lambda: honest(address, 0, lambda: next(turns, False), tally)).join()
        tally.phase = "settling"
        persons = [
            run("honest", partial(honest, address, number, lambda: not over.is_set(), tally))
            for number in range(clients)
        ]
        time.sleep(quiet)  # until they do not do the same at the same time
        for names in phases:
            tally.phase = "quiet"
            time.sleep(quiet)
            tally.phase = " + ".join(names)
            until = time.monotonic() + seconds
            hostile = [
                run(name, partial(ATTACKERS[name], Attack(address, _NUMBERS[name], until, tally)))
                for name in names
            ]
            for thread in hostile:
                thread.join()
        over.set()
        for thread in persons:
            thread.join()
        peak = _peak(server.pid)
        server.terminate()
        said = server.communicate(timeout=300)[1]
    if "Traceback" in said:
        tally.wrong.append(f"the server failed: {said[-1500:]}")
    if peak > BOUND:
        tally.wrong.append(f"the server held {peak:.0f} MB, more than {BOUND}")
    tally.wrong += slowed(tally)
    return tally, peak


def slowed(tally: Tally) -> list[str]:
    """Return which answers took too long beside one attacker, or beside each in turn."""
    told = []
    alone = {phase: took for phase, took in tally.seconds.items() if phase in ATTACKERS}
    in_turn = {
        kind: [one for took in alone.values() for one in took.get(kind, [])]
        for kind in tally.seconds["quiet"]
    }
    for phase, kinds in {"each": in_turn, **alone}.items():
        for kind, took in kinds.items():
            quiet = tally.seconds["quiet"].get(kind, [])
            if min(len(took), len(quiet)) < _ENOUGH:
                continue
            usual, slow = (float(np.quantile(one, _SHARE)) for one in (quiet, took))
            if slow > SLOWER * max(usual, _NOTICED):
                told.append(f"{kind}: {slow:.2f} s, {usual:.2f} s in quiet ({phase})")
    return told


@click.command(help=__doc__)
@click.option("--clients", default=20, show_default=True)
@click.option("--quiet", default=20.0, show_default=True, help="Seconds without attackers, before each.")
@click.option("--seconds", default=30.0, show_default=True, help="Of each attacker, and of all at once.")
def main(clients: int, quiet: float, seconds: float) -> None:
    """Run the load test; fail if anything was not as it should be."""
    tally, peak = load(clients, quiet, seconds, [*([name] for name in ATTACKERS), list(ATTACKERS)])
    for kind, count in sorted(tally.counts.items()):
        click.echo(f"{count:6d}  {kind}")
    for phase in tally.seconds:
        halves, most = (tally.times(phase, share) for share in (0.5, _SHARE))
        told = ", ".join(f"{kind} {halves[kind]:.2f}/{most[kind]:.2f}" for kind in halves)
        click.echo(f"{phase}: {told} s")
    click.echo(f"server: {peak:.0f} MB at most, of {BOUND}")
    for wrong in tally.wrong[:20]:
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
