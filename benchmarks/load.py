"""Honest clients of the studio beside attackers: ``python -m benchmarks.load``.

Each honest client makes a session, sends photos, and asks for previews and files; it must get what the first
of them got, and within five times as long as without attackers. These come one after another, then all at
once. None may be answered with a failure of the server, and its memory is bounded.
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
from importlib.resources import files
from pathlib import Path

import click

from benchmarks.attackers import ATTACKERS, Attack
from benchmarks.tally import Tally, client_at
from relit.studio.limits import Limits

#: So that the bound is reached: a photo of 100 million px is read within a client's share of working memory.
LIMITS = Limits(memory=800_000_000, working_memory=1_600_000_000)

#: MB that the server may hold: that, bodies on their way, and what it is made of.
BOUND = round((LIMITS.memory + LIMITS.working_memory + 2 * LIMITS.bytes) / 1e6) + 400

#: By how much longer an honest client may wait than without attackers, half the times and nine times in ten:
#: a machine that is shared, as those of tests are, keeps a single answer waiting for whatever else it does.
SLOWER = 5
_SHARES = (0.5, 0.9)
_NOTICED = 0.1  # s: what takes less is counted as so much, since a scheduler's turn is as long

_SERVE = """
from relit.studio.app import LOCAL, Server, create_app
from relit.studio.limits import Limits
app = create_app(hosts=LOCAL, page=False, limits={limits})
Server(app, "127.0.0.1", 0, lambda url: print(url + "api/v1", flush=True)).run()
"""
_STRENGTHS = (0.25, 0.5, 1.0)
_THINKS = 2.0  # s at most, between what a person does
#: The third part of an attacker's addresses, by its name.
_NUMBERS = {name: 10 + number for number, name in enumerate(ATTACKERS)}


def honest(address: str, number: int, goes_on: Callable[[], bool], tally: Tally) -> None:
    """Do what a person does, over and over."""
    draw = random.Random(number)
    photo = (files("relit.photo") / "sample_photos" / "reference.jpg").read_bytes()
    with client_at(address, f"127.0.1.{number + 1}") as client:
        while goes_on():
            with tally.timed("options"):
                tally.expect("options", client.get("/options"), 200)
            with tally.timed("session"):
                begun = client.post("/sessions")
            tally.expect("session", begun, 201)
            session = f"/sessions/{begun.json()['session']}"
            with tally.timed("samples"):
                loaded = client.post(f"{session}/samples")
            tally.expect("samples", loaded, 200)
            tally.same("samples", loaded.content)
            with tally.timed("photo"):
                put = client.put(f"{session}/photos/reference", content=photo)
                while put.status_code == 429:  # until it is seen that others hold theirs back
                    tally.count("photo put off")
                    time.sleep(float(put.headers["retry-after"]))
                    put = client.put(f"{session}/photos/reference", content=photo)
            tally.expect("photo", put, 200)
            tally.same("photo", put.content)
            time.sleep(draw.uniform(0, _THINKS))
            for sequence in range(3):
                strength = draw.choice(_STRENGTHS)
                wanted = {"options": {"strength": strength}, "side": 320, "sequence": sequence}
                with tally.timed("render"):
                    answer = client.post(f"{session}/render", json=wanted)
                tally.expect("render", answer, 200)
                tally.same(f"render {strength}", answer.content)
                time.sleep(draw.uniform(0, _THINKS))
            with tally.timed("landmarks"):
                marks = client.get(f"{session}/landmarks/target")
            tally.expect("landmarks", marks, 200)
            with tally.timed("shown"):
                shown = client.get(f"{session}/photos/target", params={"side": 400})
            tally.expect("shown", shown, 200)
            tally.same("shown", shown.content)
            if draw.random() < 0.2:
                with tally.timed("export"):
                    answer = client.post(f"{session}/export", json={"format": ".png"})
                tally.expect("export", answer, 200)
                with zipfile.ZipFile(io.BytesIO(answer.content)) as packed:
                    tally.same("export", packed.read("relit.png"))
            tally.expect("end", client.delete(session), 204)


def load(clients: int, quiet: float, seconds: float, phases: Sequence[Sequence[str]]) -> tuple[Tally, float]:
    """Run a server under load; return what the clients saw, and the MB that the server held at most.

    Parameters
    ----------
    clients : int
        Honest ones.
    quiet : float
        How long they are alone, once they have settled for half as long.
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
        time.sleep(quiet / 2)  # until they do not do the same at the same time
        tally.phase = "quiet"
        time.sleep(quiet)
        for names in phases:
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
        said = server.communicate(timeout=60)[1]
    if "Traceback" in said:
        tally.wrong.append(f"the server failed: {said[-1500:]}")
    if peak > BOUND:
        tally.wrong.append(f"the server held {peak:.0f} MB, more than {BOUND}")
    tally.wrong += slowed(tally)
    return tally, peak


def slowed(tally: Tally) -> list[str]:
    """Return which answers took too long, and in which phase."""
    told = []
    for share in _SHARES:
        usual = tally.times("quiet", share)
        for phase in tally.seconds.keys() - {"warm-up", "settling", "quiet"}:
            for kind, took in tally.times(phase, share).items():
                if took > SLOWER * max(usual.get(kind, took), _NOTICED):
                    told.append(
                        f"{kind}: {took:.2f} s for {share:.0%}, {usual[kind]:.2f} s in quiet ({phase})"
                    )
    return told


@click.command(help=__doc__)
@click.option("--clients", default=20, show_default=True)
@click.option("--quiet", default=40.0, show_default=True, help="Seconds without attackers.")
@click.option("--seconds", default=40.0, show_default=True, help="Of each attacker, and of all at once.")
def main(clients: int, quiet: float, seconds: float) -> None:
    """Run the load test; fail if anything was not as it should be."""
    tally, peak = load(clients, quiet, seconds, [*([name] for name in ATTACKERS), list(ATTACKERS)])
    for kind, count in sorted(tally.counts.items()):
        click.echo(f"{count:6d}  {kind}")
    for phase in tally.seconds:
        halves, most = (tally.times(phase, share) for share in _SHARES)
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
