"""Lint, types and tests: what must pass before a change lands. Run it as ``python check.py``."""

import subprocess
import sys

CHECKS = (
    ("ruff", "check", "."),
    ("ruff", "format", "--check", "."),
    ("mypy",),
    ("pytest", "-n", "2", "--dist", "loadfile", "--no-loadscope-reorder"),
)


def main() -> int:
    for check in CHECKS:
        print(f"== {' '.join(check)}", flush=True)
        if code := subprocess.run([sys.executable, "-m", *check]).returncode:
            return code
    return 0


if __name__ == "__main__":
    sys.exit(main())
