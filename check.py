"""What must pass before a change lands: ``python check.py``; ``--help`` tells what there is besides."""

import argparse
import os
import subprocess
import sys
import tempfile
import tomllib
import venv
from pathlib import Path

LINT = (("-m", "ruff", "check", "."), ("-m", "ruff", "format", "--check", "."), ("-m", "mypy"))
COMPILE = ("-m", "tests.compiled")
TESTS = ("-m", "pytest", "-n", "2", "--dist", "loadfile", "--no-loadscope-reorder", "--durations", "12")
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


def lowest_versions() -> list[str]:
    """Return what `pyproject.toml` asks for, to run and to test, as pins to the lowest versions it allows."""
    project = tomllib.loads(Path("pyproject.toml").read_text("utf-8"))["project"]
    wanted = {*project["dependencies"], *project["optional-dependencies"]["dev"]}
    return sorted(requirement.replace(">=", "==") for requirement in wanted)


def check_oldest() -> None:
    """Relight the samples, import the studio and run the fast tests with the lowest versions allowed."""
    pins = lowest_versions()
    print("\n".join(pins))
    with tempfile.TemporaryDirectory() as folder:
        venv.create(folder, with_pip=True)
        python = str(Path(folder, "Scripts" if os.name == "nt" else "bin", "python"))
        run(python, ("-m", "pip", "install", "-q", "--only-binary", ":all:", "-e", ".", *pins))
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
    chosen = parser.parse_args()
    try:
        if chosen.oldest:
            check_oldest()
        else:
            check(*(FAST if chosen.fast else TESTS), *(["--all"] if chosen.all else []))
    except CheckError as failure:
        return int(failure.args[0])
    return 0


if __name__ == "__main__":
    sys.exit(main())
