"""The HTTP API does what its OpenAPI schema says, whatever schemathesis makes up from that."""

import io
import os
import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import pytest
from PIL import Image

from relit.photo.samples import sample
from relit.studio.app import create_app
from relit.studio.limits import Limits
from tests.served import served

pytestmark = pytest.mark.slow
HERE = Path(__file__).parent
API = "/api/v1"
SCHEMATHESIS = [sys.executable, "-m", "schemathesis.cli", "--config-file", HERE / "schemathesis.toml", "run"]


class Counted:
    """ASGI middleware that notes the status of every answer."""

    def __init__(self, app):
        self.app, self.seen = app, []

    async def __call__(self, scope, receive, send):
        async def noted(message):
            if message["type"] == "http.response.start":
                self.seen.append((scope["method"].lower(), scope["path"], message["status"]))
            await send(message)

        await self.app(scope, receive, noted)


def small(role, factor):
    """Return the sample as a PNG file that takes little time."""
    with Image.open(sample(role)) as photo:
        file = io.BytesIO()
        photo.reduce(factor).save(file, "PNG")
    return file.getvalue()


@pytest.mark.rotating
def test_every_answer_is_one_that_the_schema_describes(tmp_path):
    app = Counted(create_app(limits=Limits(sessions=10_000, sessions_per_client=10_000)))
    with served(app) as client:
        schema = client.get(f"{API}/openapi.json").json()
        session, other, empty, whole = (client.post(f"{API}/sessions").json()["session"] for _ in range(4))
        photos = {"target": small("target", 3), "reference": small("reference", 5)}
        for role, photo in photos.items():
            for one in (session, whole):
                put = client.put(f"{API}/sessions/{one}/photos/{role}", content=photo)
                assert put.json()["landmarks"] is not None
        for name in ("kept", "gone"):
            assert client.put(f"{API}/sessions/{session}/references/{name}", content=photos["reference"])
        (tmp_path / "photo.png").write_bytes(photos["target"])
        app.seen.clear()
        done = subprocess.run(
            [
                *SCHEMATHESIS,
                f"{client.base_url}{API[1:]}/openapi.json",
                "--seed",
                "1",
                "--request-timeout",
                "300",
            ],
            env=os.environ
            | {
                "SCHEMATHESIS_HOOKS": str(HERE / "schema_hooks.py"),
                "RELIT_SESSION": session,
                "RELIT_OTHER": other,
                "RELIT_EMPTY": empty,
                "RELIT_WHOLE": whole,
                "RELIT_PHOTO": str(tmp_path / "photo.png"),
            },
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=1200,
        )
    assert done.returncode == 0, done.stdout + done.stderr
    # It was really tried: every operation did its work at least once, and refused at least once.
    statuses = defaultdict(set)
    for path, methods in schema["paths"].items():
        pattern = re.compile(re.sub(r"\\{\w+\\}", "[^/]+", re.escape(path)))
        for method, operation in methods.items():
            for verb, place, status in app.seen:
                if verb == method and pattern.fullmatch(place):
                    statuses[operation["operationId"]].add(status)
    assert len(statuses) == sum(map(len, schema["paths"].values()))
    for name, seen in statuses.items():
        assert min(seen) < 300, (name, seen)
        assert max(seen) < 500, (name, seen)


def test_a_token_is_asked_for_as_the_schema_says(tmp_path):
    """With it, without it, and with another one, which schemathesis tries by itself."""
    token = "a-token-for-tests-alone"
    app = Counted(create_app(token=token))
    with served(app) as client:
        done = subprocess.run(
            [
                *SCHEMATHESIS,
                f"{client.base_url}{API[1:]}/openapi.json",
                *("--header", f"Authorization: Bearer {token}", "--include-method", "GET"),
                *(
                    "--phases",
                    "coverage,fuzzing",
                    "--checks",
                    "all",
                    "--exclude-checks",
                    "positive_data_acceptance",
                ),
            ],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=1200,
        )
    assert done.returncode == 0, done.stdout + done.stderr
    statuses = {status for _, path, status in app.seen if path == f"{API}/options"}
    assert statuses >= {200, 401}
