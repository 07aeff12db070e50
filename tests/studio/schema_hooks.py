"""What schemathesis sends beside what it makes up: sessions that have photos, photos, landmark files.

`test_api_schema.py` names this file to it, and puts what it needs into the environment.
"""

import os
import re
from pathlib import Path

import schemathesis

LANDMARKS = b"version: 1\nn_points: 3\n{\n40 50\n80 50\n60 90\n}\n"


@schemathesis.hook
def map_case(context, case):
    name = context.operation.definition.raw["operationId"]
    places, how, place = case.path_parameters, case.meta, os.environ["RELIT_SESSION"]
    token = places.get("session", "")
    if name == "end":
        places["session"] = "gone" if token == place else token
    elif how.phase.name != "stateful" and re.fullmatch(r"[A-Za-z0-9_-]+", token) and len(token) % 4:
        # The samples are larger: what takes long is tried on small photos.
        places["session"] = os.environ["RELIT_OTHER"] if name in ("samples", "put_photo") else place
        # Where the landmarks stay those that were found.
        if name in ("render", "export"):
            places["session"] = os.environ["RELIT_WHOLE"]
        # Most of what would be computed is only checked: there is nothing to compute it of.
        if how.phase.name == "coverage" and name in ("render", "export") and len(str(case.body)) % 6:
            places["session"] = os.environ["RELIT_EMPTY"]
    if how.generation.mode == schemathesis.GenerationMode.POSITIVE:
        if "id" in places:  # one that is there, and stays; or another one, which comes and goes
            places["id"] = "gone" if name in ("put_reference", "delete_reference") else "kept"
        if name in ("put_photo", "put_reference"):
            case.body = Path(os.environ["RELIT_PHOTO"]).read_bytes()
        elif name == "put_file" and case.query["format"] == ".pts":
            case.body = LANDMARKS
        elif name == "export" and not case.body.get("options"):  # one that can be met
            places["session"] = place
            case.body.pop("target", None)
        elif name == "render" and "sequence" in case.body:
            case.body["sequence"] = 0  # one that is high makes all others stale
    return case
