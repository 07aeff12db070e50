"""`relit serve`: who is asked for a token, what is said of it, and limits as options."""

import os
import re
import signal
import subprocess
import sys
from dataclasses import replace

import pytest

from relit.cli import serve
from relit.errors import OptionError
from relit.studio import server
from relit.studio.limits import Limits


class Started:
    """What the command would have started."""

    def __init__(self):
        self.app = self.where = self.settings = None


@pytest.fixture
def started(monkeypatch):
    """Have the server say that it is ready, and end."""
    noted = Started()

    def initialise(self, app, host, port, ready, **settings):
        noted.app, noted.where, noted.settings, self._ready = app, (host, port), settings, ready
        self.most_connections = settings["limits"].connections
        self.addresses = [f"http://{host}:{port}/"]

    monkeypatch.setattr(server.Server, "__init__", initialise)
    monkeypatch.setattr(server.Server, "run", lambda self: self._ready(self.addresses[0]))
    monkeypatch.delenv("RELIT_TOKEN", raising=False)
    return noted


def token_of(started):
    """Return the token that the application asks for: its middleware's, between the guard and the intake."""
    return getattr(started.app.app.app, "_token", b"").decode() or None


def test_on_this_machine_alone_nobody_is_asked(started, run):
    done = run("serve")
    assert done.code == 0
    assert done.err == "relit serve: http://127.0.0.1:8765/api/v1\n"
    assert token_of(started) is None


@pytest.mark.parametrize(
    "flags", ["--host 0.0.0.0", "--host ::", "--allow-host light.team", "--trusted-proxy 127.0.0.1"]
)
def test_for_others_a_token_is_made_and_printed(started, run, flags):
    said = [run(f"serve {flags}").err for _ in range(2)]
    made = [re.search(r"the token, made for this run: (\S{32})\n", one)[1] for one in said]
    assert made[0] != made[1]
    assert made[1] == token_of(started)
    assert ("no TLS" in said[0]) == ("--host" in flags)
    assert ("is every address of this machine" in said[0]) == ("--host" in flags)


def test_the_page_is_told_with_a_token_that_was_made(started, run):
    said = run("serve --page --allow-host light.team").err
    assert f"the page: http://127.0.0.1:8765/#token={token_of(started)}\n" in said
    assert "the page: http://127.0.0.1:8765/\n" in run("serve --page").err


@pytest.mark.parametrize("flags", ["", "--host 0.0.0.0", "--host 0.0.0.0 --page"])
def test_a_token_that_is_given_is_asked_for_and_not_printed(started, run, monkeypatch, flags):
    given = "correct-horse-battery"
    monkeypatch.setenv("RELIT_TOKEN", given)
    assert given not in run(f"serve {flags}").err
    assert token_of(started) == given
    other = "another-token-that-is-long"
    assert other not in run(f"serve {flags} --token {other}").err
    assert token_of(started) == other


def test_without_a_token_only_when_that_is_said(started, run, monkeypatch):
    assert "token, made" not in run("serve --host 0.0.0.0 --no-token").err
    assert token_of(started) is None
    monkeypatch.setenv("RELIT_TOKEN", "correct-horse-battery")
    done = run("serve --no-token")
    assert (done.code, "exclude each other" in done.err) == (2, True)


@pytest.mark.parametrize(
    ("flags", "said"),
    [
        ("--token short", "RELIT_TOKEN: expected 16 characters or more, of A-Z a-z 0-9 . _ ~ + / -, got 5;"),
        ("--token 'with spaces and more'", "got 20 with others among them; leave it out, and one is made"),
        ("--token ''", "--token or RELIT_TOKEN: expected 16 characters or more"),
        (
            "--trusted-proxy *",
            "--trusted-proxy: expected an address or a network, as 127.0.0.1 or 10.0.0.0/8",
        ),
        ("--allow-host http://light.team/", "--allow-host: expected a name alone, as light.team, without"),
        ("--allow-host light.team:8080", "without a port, got 'light.team:8080'"),
        ("--allow-host ''", "without a port, got ''"),
        ("--allow-host *.light.team", "--allow-host: expected a name alone"),
        ("--host no.such.name.invalid", "--host: expected an address of this machine or a name of one"),
        (
            "--max-bytes 2T",
            "'2T' is not a whole number of 1 or more, as 500k, 200M or 1.5G (see relit serve --help)",
        ),
        ("--max-pixels 0.5", "is not a whole number"),
        ("--memory infM", "is not a whole number"),
        ("--workers 0", "'0' is not a whole number of 1 or more (see"),
        ("--header-timeout 0", "'0' is not a number of seconds above 0 (see"),
        ("--compute-timeout nan", "'nan' is not a number of seconds above 0 (see"),
        ("--live inf", "'inf' is not a number of seconds above 0 (see"),
        ("--body-timeout soon", "'soon' is not a number of seconds above 0 (see"),
        ("--port abc", "'abc' is not a whole number of 0 to 65535 (see"),
        ("--port 65536", "'65536' is not a whole number of 0 to 65535 (see"),
    ],
)
@pytest.mark.usefixtures("started")
def test_what_is_wrong_is_said_in_a_line(run, flags, said):
    done = run(f"serve {flags}")
    assert done.code == 2
    assert said in done.err
    assert "short" not in done.err.replace("--token short", "")


def test_an_empty_token_in_the_environment_is_refused(started, run, monkeypatch):
    monkeypatch.setenv("RELIT_TOKEN", "")
    for flags in ("", "--host 0.0.0.0", "--page"):
        done = run(f"serve {flags}")
        assert (done.code, "--token or RELIT_TOKEN: expected 16 characters" in done.err) == (2, True)
    assert started.app is None


@pytest.mark.parametrize("name", ["light", "Light.Team", "light.team.", "a_b.c-d", "10.0.0.5", "2001:db8::5"])
def test_names_of_servers_are_let_through(started, run, name):
    assert run(f"serve --allow-host {name}").code == 0
    assert name.lower() in started.app.app.hosts


@pytest.mark.parametrize("name", Limits.__dataclass_fields__)
@pytest.mark.parametrize("limit", [float("nan"), float("inf"), -1, None])
def test_limits_are_finite(name, limit):
    with pytest.raises(OptionError, match=f"^{name}: expected a finite number of 0 or more, got "):
        Limits(**{name: limit})


# In a process of its own, since a browser's tests keep a loop of events running in this one; one that would
# ignore Ctrl-C where these tests run in the background.
START = (
    "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    "from relit.cli.app import main; main()"
)


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="needs SIGINT")
@pytest.mark.parametrize("command", ["serve --no-token", "studio --no-open"])
def test_ctrl_c_ends_it_as_every_command(command):
    words = [sys.executable, "-c", START, *command.split(), "--port", "0"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as child:
        assert any("http://127.0.0.1:" in line for line in child.stdout)
        child.send_signal(signal.SIGINT)
        said, _ = child.communicate(timeout=120)
    assert (child.returncode, said.splitlines()[-1]) == (130, "relit: interrupted")


def test_every_limit_is_an_option_with_its_default(started, run):
    run("serve")
    assert started.settings["limits"] == Limits()
    for number, (name, (flag, kind, _)) in enumerate(serve.LIMITS.items(), 100):
        if name in Limits.__dataclass_fields__:
            text, value = (f"{number / 10}M", number * 100_000) if kind.name == "amount" else (number, number)
            run(f"serve {flag} {text}")
            assert started.settings["limits"] == replace(Limits(), **{name: value})


def test_the_help_has_them_in_groups(succeed, monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    said = succeed("serve --help").decode()
    heads = ["Options:", "Who may come in:", "Limits"]
    assert [said.index(head) for head in heads] == sorted(said.index(head) for head in heads)
    limits = " ".join(said.partition("Limits")[2].split())
    for text in ("--max-bytes N", "[default: 200M]", "[default: 2G]", "--compute-timeout S", "[default: 64]"):
        assert text in limits
    assert "list of processes" in " ".join(said.split())
