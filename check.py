"""What must pass before a change lands: ``python check.py``; ``--help`` tells what there is besides."""

import argparse
import os
import subprocess
import sys
import tempfile
import tomllib
import venv
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

LINT = (("-m", "ruff", "check", "."), ("-m", "ruff", "format", "--check", "."), ("-m", "mypy"))
COMPILE = ("-m", "tests.compiled")
TESTS = ("-m", "pytest", "-n", "2", "--dist", "loadfile", "--no-loadscope-reorder", "--durations", "12")
FOR_DEVELOPERS = {"dev", "docs", "training", "bench"}  # extras that nobody ships
FAST = (*TESTS, "-m", "not slow and not e2e")


class CheckError(Exception):
    """A command failed, with this exit code."""


def run(python: str, *commands: tuple[str, ...], cwd: str | None = None) -> None:
    for command in commands:
        print(f"== {' '.join(command)}", flush=True)
        if code := subprocess.run([python, *command], cwd=cwd).returncode:
            raise CheckError(code)


def check(*tests: str) -> None:
    """Lint, check types and test; meanwhile, compile what all processes of the tests need."""
    with subprocess.Popen([sys.executable, *COMPILE]) as compiling:
        run(sys.executable, *LINT)
    if compiling.returncode:
        raise CheckError(compiling.returncode)
    run(sys.executable, tests)


def project() -> dict[str, Any]:
    table: dict[str, Any] = tomllib.loads(Path("pyproject.toml").read_text("utf-8"))["project"]
    return table


def lowest_versions() -> list[str]:
    """Return what `pyproject.toml` asks for, to run and to test, as pins to the lowest versions it allows."""
    wanted = {*project()["dependencies"], *project()["optional-dependencies"]["dev"]}
    return sorted(requirement.replace(">=", "==") for requirement in wanted)


def extras_for_users() -> list[str]:
    return sorted(project()["optional-dependencies"].keys() - FOR_DEVELOPERS)


@contextmanager
def environment(*requirements: str) -> Iterator[tuple[str, str]]:
    """Make an environment for as long as it is needed; give its folder and its Python."""
    with tempfile.TemporaryDirectory() as folder:
        venv.create(folder, with_pip=True)
        python = str(Path(folder, "Scripts" if os.name == "nt" else "bin", "python"))
        run(python, ("-m", "pip", "install", "-q", "--only-binary", ":all:", *requirements))
        yield folder, python


def check_licences() -> None:
    """Refuse what users may install under a licence that is not allowed."""
    with environment(f".[{','.join(extras_for_users())}]") as (_folder, python):
        run(sys.executable, ("-m", "tools.licences", python))


def check_oldest() -> None:
    """Relight the samples, import the studio and run the fast tests with the lowest versions allowed."""
    pins = lowest_versions()
    print("\n".join(pins))
    with environment("-e", ".", *pins) as (folder, python):
        relit = ("-c", "from relit.cli.app import main; main()")
        photos = ("photos/target.png", "photos/reference.jpg")
        run(
            python,
            (*relit, "samples", "photos"),
            (*relit, "transfer", *photos, "-o", "relit.png", "--stages", "stages"),
            (*relit, "transfer", *photos, "-o", "ltv.png", "--method", "ltv"),
            ("-c", "from relit.studio.app import create_app; create_app()"),
            cwd=folder,
        )
        run(python, FAST)


def main() -> int:
    parser = argparse.ArgumentParser(description="Lint, types and tests; without an option, what CI runs.")
    only = parser.add_mutually_exclusive_group()
    only.add_argument("--fast", action="store_true", help="leave out the slow tests: for daily work")
    only.add_argument("--all", action="store_true", help="all tests and corpora; other runs take a part")
    only.add_argument(
        "--oldest", action="store_true", help="the fast tests with the lowest versions allowed: for a release"
    )
    only.add_argument(
        "--licences", action="store_true", help="those of all that users may install: for a release"
    )
    chosen = parser.parse_args()
    try:
        if chosen.oldest:
            check_oldest()
        elif chosen.licences:
            check_licences()
        else:
            check(*(FAST if chosen.fast else TESTS), *(["--all"] if chosen.all else []))
    except CheckError as failure:
        return int(failure.args[0])
    return 0


if __name__ == "__main__":
    sys.exit(main())
