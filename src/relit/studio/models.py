"""What goes over the wire as JSON: the forms of requests and of answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self, TypeAlias

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, JsonValue

from relit.face.landmark_files import FORMATS as LANDMARK_FORMATS
from relit.face.schemes import SchemeName
from relit.settings.methods import WITH_SECOND_REFERENCE
from relit.settings.option_fields import GROUPS
from relit.settings.options import TransferOptions
from relit.settings.studio_lights import STUDIO_LIGHTS
from relit.studio.pictures import VIEWS
from relit.studio.session import ROLES, Portrait

Role = Literal["target", "reference"]
#: Names of references at hand, which clients choose.
REFERENCE_ID = "^[A-Za-z0-9_-]{1,40}$"
if TYPE_CHECKING:
    Group: TypeAlias = str
    Suffix: TypeAlias = str
    View: TypeAlias = str
else:  # what a request may say is in tables
    Group, Suffix, View = Literal[GROUPS], Literal[tuple(LANDMARK_FORMATS)], Literal[VIEWS]


class Option(BaseModel):
    """An option of a transfer."""

    name: str
    title: str
    group: Group
    flag: str
    help: str
    default: bool | int | float | str | None
    kind: Literal["choice", "text", "number", "switch"]
    choices: list[int | str]
    words: list[str]
    at_least: float | None
    at_most: float | None
    above: float | None

    @classmethod
    def of(cls, declared: Any) -> Option:
        """Describe a field of `TransferOptions`."""
        known = declared.metadata
        kind = "choice" if known["choices"] else "text" if known["text"] else "number"
        return cls(
            name=declared.name,
            default=declared.default,
            kind="switch" if isinstance(declared.default, bool) else kind,  # type: ignore[arg-type]
            # There is one reference here.
            choices=[choice for choice in known["choices"] if choice not in WITH_SECOND_REFERENCE],
            **{key: known[key] for key in ("title", "group", "flag", "help", "words")},
            **{key: known[key] for key in ("at_least", "at_most", "above")},
        )

    def json_schema(self) -> dict[str, Any]:
        """Return the JSON schema of its values."""
        limits = {"minimum": self.at_least, "maximum": self.at_most, "exclusiveMinimum": self.above}
        number = {"type": "number"} | {key: limit for key, limit in limits.items() if limit is not None}
        kinds: dict[str, dict[str, Any]] = {
            "choice": {"enum": self.choices},
            "switch": {"type": "boolean"},
            "text": {"type": "string"},
            "number": number,
        }
        values = [kinds[self.kind]]
        if self.kind == "number" and self.words:
            values.append({"enum": self.words})
        if self.default is None:
            values.append({"type": "null"})
        return {"anyOf": values, "default": self.default, "description": self.help}


OPTIONS = [Option.of(declared) for declared in fields(TransferOptions)]

# Options and points are only described here: the library checks them, and says what is wrong with one.
_VALUES: dict[str, JsonValue] = {option.name: option.json_schema() for option in OPTIONS}
_Options = Annotated[
    dict[str, Any], Field(json_schema_extra={"properties": _VALUES, "additionalProperties": False})
]
_Point = Annotated[list[float], Field(json_schema_extra={"minItems": 2, "maxItems": 3})]
_Points = Annotated[
    list[_Point],
    Field(
        max_length=2000,
        description="(x, y) or (x, y, z) in px of the photo, pixel centres at integers.",
        json_schema_extra={"minItems": 3},
    ),
]
#: 640.0 is a whole number, says JSON; true and "640" are none.
_Whole = Annotated[
    int, BeforeValidator(lambda value: int(value) if isinstance(value, float) and value % 1 == 0 else value)
]


def _asked(**example: Any) -> ConfigDict:
    return ConfigDict(extra="forbid", strict=True, json_schema_extra={"examples": [example]})


class Points(BaseModel):
    """Landmarks from a client."""

    # The eyes, the tip of the nose and the corners of a mouth.
    model_config = _asked(points=[[40, 50], [80, 50], [60, 75], [45, 95], [75, 95]])
    scheme: SchemeName | None = None
    points: _Points


class RenderRequest(BaseModel):
    """A preview."""

    model_config = _asked(options={"strength": 0.8}, side=320)
    options: _Options = {}
    view: View = "result"
    side: _Whole = Field(640, ge=64, le=2048)
    quick: bool = False
    sequence: _Whole = Field(0, ge=0, le=2**53)
    reference: str | None = Field(
        None, pattern=REFERENCE_ID, description="Of those at hand, the one that gives the light."
    )


class ExportRequest(BaseModel):
    """Files at full resolution; ``.ora``, ``.psd`` and ``.exr`` hold layers."""

    model_config = _asked(options={"strength": 0.8})
    options: _Options = {}
    format: Literal[".png", ".jpg", ".tif", ".ora", ".psd", ".exr"] = ".png"
    target: str | None = Field(None, pattern=REFERENCE_ID)
    reference: str | None = Field(
        None, pattern=REFERENCE_ID, description="Of those at hand, the one that gives the light."
    )


class Problem(BaseModel):
    """What went wrong: a word for programs, a sentence for people."""

    code: str
    message: str


class Failure(BaseModel):
    """Every answer of 4xx."""

    error: Problem


class Begun(BaseModel):
    """A new session, and after how many seconds without a request it ends."""

    session: str
    expires_in: int


class Limits(BaseModel):
    """What a photo may have: bytes as a file, and pixels."""

    bytes: int
    pixels: int


class Lamp(BaseModel):
    """Where the lamp of a light by name stands, and how large it is, in degrees."""

    azimuth: float
    elevation: float
    size: float


LIGHTS = {
    name: Lamp(azimuth=lamp.azimuth, elevation=lamp.elevation, size=lamp.size)
    for name, (lamp, *_) in ((name, light.lamps) for name, light in STUDIO_LIGHTS.items())
}


class Offer(BaseModel):
    """What this server can do."""

    options: list[Option]
    landmark_formats: list[str]
    lights: dict[str, Lamp]
    limits: Limits
    version: str


class Marks(BaseModel):
    """The landmarks of a photo."""

    scheme: SchemeName
    points: list[list[float]]
    groups: dict[str, list[int]]
    detected: bool
    interocular_distance: float

    @classmethod
    def of(cls, portrait: Portrait) -> Marks | None:
        """Describe those of a photo, if there are any."""
        found = portrait.landmarks
        if found is None:
            return None
        return cls(
            scheme=found.scheme,
            points=np.asarray(found.points).tolist(),
            groups={name: list(rows) for name, rows in found.groups.items()},
            detected=portrait.detected,
            interocular_distance=found.interocular_distance,
        )


class Part(BaseModel):
    """A part of the target's face, null where there is no face."""

    part: str | None


class PhotoFacts(BaseModel):
    """A photo and its face; where none was found, a message says so.

    It has a name if it is of those that the studio was started with.
    """

    width: int
    height: int
    format: str | None
    depth: Literal["uint8", "uint16", "float32"]
    grey: bool
    landmarks: Marks | None
    message: str | None
    name: str | None

    @classmethod
    def of(cls, portrait: Portrait, role: str) -> PhotoFacts:
        """Describe the photo of a role."""
        pixels = portrait.photo.pixels
        height, width = pixels.shape[:2]
        none = f"No face was found in the {role}; place landmarks by hand, or load a file of them."
        return cls(
            width=width,
            height=height,
            format=portrait.photo.format,
            depth=str(pixels.dtype),  # type: ignore[arg-type]
            grey=pixels.ndim == 2,
            landmarks=Marks.of(portrait),
            message=none if portrait.landmarks is None else None,
            name=portrait.name,
        )


class _ByRole(BaseModel):
    @classmethod
    def of(cls, portraits: Mapping[str, Portrait], **more: str) -> Self:
        """Describe the photos that there are, and what more there is to say."""
        there = dict(portraits)
        photos = {role: PhotoFacts.of(there[role], role) if role in there else None for role in ROLES}
        return cls(**photos, **more)


class Pair(_ByRole):
    """Both photos."""

    target: PhotoFacts
    reference: PhotoFacts


class Swapped(Pair):
    """Both photos, and the name by which the new reference is at hand."""

    id: str


class Seats(_ByRole):
    """The photos of a session, null where there is none yet."""

    target: PhotoFacts | None
    reference: PhotoFacts | None
