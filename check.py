"""What must pass before a change lands: ``python check.py``; ``--help`` tells what there is besides."""

import argparse
import os
import shutil
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
INSTALL = ("-m", "pip", "install", "-q", "--only-binary", ":all:")
FOR_DEVELOPERS = {"dev", "docs", "training", "bench"}  # extras that nobody ships
STUDIO = ("-c", "from relit.studio.app import create_app; create_app()")
FAST = (*TESTS, "-m", "not slow and not e2e")


class CheckError(Exception):
    """A command failed, with this exit code."""


def run(program: str, *commands: tuple[str, ...], cwd: str | None = None) -> None:
    for command in commands:
        print(f"== {' '.join(command)}", flush=True)
        if code := subprocess.run([program, *command], cwd=cwd).returncode:
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
        run(python, (*INSTALL, *requirements))
        yield folder, python


def check_licences() -> None:
    """Refuse what users may install under a licence that is not allowed."""
    with environment(f".[{','.join(extras_for_users())}]") as (_folder, python):
        run(sys.executable, ("-m", "tools.licences", python))


def relight_samples(folder: str, python: str) -> None:
    """Have the command of an environment relight the samples, in its folder."""
    photos = ("photos/target.png", "photos/reference.jpg")
    run(
        str(Path(python).with_name("relit")),
        ("--version",),
        ("samples", "photos"),
        ("transfer", *photos, "-o", "relit.png", "--stages", "stages"),
        ("transfer", *photos, "-o", "ltv.png", "--method", "ltv"),
        cwd=folder,
    )


def check_oldest() -> None:
    """Relight the samples, import the studio and run the fast tests with the lowest versions allowed."""
    pins = lowest_versions()
    print("\n".join(pins))
    with environment("-e", ".", *pins) as (folder, python):
        relight_samples(folder, python)
        run(python, STUDIO, cwd=folder)
        run(python, FAST)


def check_release() -> None:
    """Build what is uploaded, of what is committed, and try both files in environments of their own.

    `build` makes the wheel of the sdist: the one that works, so does the other.
    """
    if changed := subprocess.check_output(["git", "status", "--porcelain"], text=True):
        print(f"not committed, so not released:\n{changed}", file=sys.stderr)
        raise CheckError(1)
    os.environ.pop("PYTHONPATH", None)  # it would have this checkout tried, not what was built
    shutil.rmtree("dist", ignore_errors=True)
    run(sys.executable, ("-m", "build"))
    (wheel,), (sdist,) = (list(Path("dist").absolute().glob(kind)) for kind in ("*.whl", "*.tar.gz"))
    run(sys.executable, ("-m", "twine", "check", "--strict", str(wheel), str(sdist)))
    with environment(str(wheel)) as (folder, python):
        relight_samples(folder, python)
        run(python, (*INSTALL, f"{wheel}[studio]"), STUDIO, cwd=folder)
    with tempfile.TemporaryDirectory() as folder:
        shutil.unpack_archive(sdist, folder, filter="data")
        (source,) = map(str, Path(folder).iterdir())
        with environment("-e", f"{source}[dev]") as (_folder, python):
            run(python, ("check.py", "--fast"), cwd=source)
    print(f"== to upload: {wheel.name}, {sdist.name}, in dist")


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
    only.add_argument(
        "--release",
        action="store_true",
        help="build wheel and sdist into dist; try both in environments of their own",
    )
    chosen = parser.parse_args()
    try:
        if chosen.oldest:
            check_oldest()
        elif chosen.licences:
            check_licences()
        elif chosen.release:
            check_release()
        else:
            check(*(FAST if chosen.fast else TESTS), *(["--all"] if chosen.all else []))
    except CheckError as failure:
        return int(failure.args[0])
    return 0


if __name__ == "__main__":
    sys.exit(main())
