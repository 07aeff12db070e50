"""What a session's work is taken home as: a ZIP file that the command line can make again."""

from __future__ import annotations

import io
import zipfile
from dataclasses import replace
from typing import TYPE_CHECKING

from relit.face.landmark_files import landmarks_as_bytes
from relit.photo.atomic_files import NamedBytes
from relit.photo.writing import write_image
from relit.relighting import transfer
from relit.settings_file import Settings, as_json
from relit.studio.sessions import ROLES

if TYPE_CHECKING:
    from relit.settings.options import TransferOptions
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
    like = replace(target.photo, alpha=None) if suffix == ".jpg" else target.photo
    image = NamedBytes(f"relit{suffix}")
    write_image(image, result.image, like=like)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr(image.name, image.getvalue())
        for role, landmarks in marks.items():
            archive.writestr(f"{role}.json", landmarks_as_bytes(f"{role}.json", landmarks))
        archive.writestr("settings.json", record)
    return packed.getvalue()
