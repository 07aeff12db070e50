"""What a session's work is taken home as: a ZIP file that the command line can make again."""

from __future__ import annotations

import io
import tempfile
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from relit.image import write_image
from relit.landmark_files import write_landmarks
from relit.relighting import transfer
from relit.settings_file import Settings, as_json
from relit.studio.sessions import ROLES

if TYPE_CHECKING:
    from relit.options import TransferOptions
    from relit.studio.sessions import Session


def exported(session: Session, settings: TransferOptions, suffix: str) -> bytes:
    """Return what ``relit transfer --config settings.json`` makes of the same photos, and what it takes."""
    (target, here), *lit_by = (
        session.ready(role) for role in (ROLES[:1] if settings.light is not None else ROLES)
    )
    result = transfer(
        target.photo,
        [sitter.photo for sitter, _ in lit_by] or None,
        target_landmarks=here,
        reference_landmarks=[there for _, there in lit_by] or None,
        options=settings,
    )
    marks = dict(zip(ROLES, (here, *(there for _, there in lit_by)), strict=False))
    record = as_json(Settings(settings, **marks))
    packed = io.BytesIO()
    with tempfile.TemporaryDirectory() as folder, zipfile.ZipFile(packed, "w") as archive:
        names = [f"relit{suffix}"]
        like = replace(target.photo, alpha=None) if suffix == ".jpg" else target.photo
        write_image(Path(folder, names[0]), result.image, like=like)
        for role, landmarks in marks.items():
            names.append(f"{role}.json")
            write_landmarks(Path(folder, names[-1]), landmarks)
        for name in names:
            archive.write(Path(folder, name), name)
        archive.writestr("settings.json", record)
    return packed.getvalue()
