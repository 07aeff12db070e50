"""What goes over the wire as JSON: the forms of requests and of answers."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, JsonValue, WithJsonSchema

from relit.face.landmark_files import FORMATS as LANDMARK_FORMATS
from relit.face.schemes import SchemeName
from relit.methods import WITH_SECOND_REFERENCE
from relit.settings.options import TransferOptions
from relit.studio.pictures import VIEWS
from relit.studio.sessions import Sitter

Role = Literal["target", "reference"]
if TYPE_CHECKING:
    Suffix: TypeAlias = str
    View: TypeAlias = str
else:  # what a request may say is in tables
    Suffix, View = Literal[tuple(LANDMARK_FORMATS)], Literal[tuple(VIEWS)]


def _schema_of(declared: Any) -> dict[str, Any]:
    """Return the JSON schema of an option."""
    known = declared.metadata
    kinds: list[dict[str, Any]]
    if known["choices"]:
        kinds = [{"enum": list(known["choices"])}]
    elif isinstance(declared.default, bool):
        kinds = [{"type": "boolean"}]
    elif known["text"]:
        kinds = [{"type": "string"}]
    else:
        limits = {
            "minimum": known["at_least"],
            "maximum": known["at_most"],
            "exclusiveMinimum": known["above"],
        }
        number = {"type": "number", **{key: limit for key, limit in limits.items() if limit is not None}}
        kinds = [number, *({"enum": [*known["words"]]} for _ in known["words"][:1])]
    if declared.default is None:
        kinds.append({"type": "null"})
    return {"anyOf": kinds, "default": declared.default, "description": known["help"]}


#: They are checked by the library, which says what is wrong with one; here they are only described.
Options = Annotated[
    dict[str, Any],
    WithJsonSchema(
        {
            "type": "object",
            "properties": {option.name: _schema_of(option) for option in fields(TransferOptions)},
            "additionalProperties": False,
        }
    ),
]
Rows = Annotated[
    list[list[float]],
    Field(max_length=2000),
    WithJsonSchema(
        {
            "type": "array",
            "items": {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 3},
            "minItems": 3,
            "maxItems": 2000,
            "description": "(x, y) or (x, y, z) in px of the photo, pixel centres at integers.",
        }
    ),
]


#: The eyes, the tip of the nose and the corners of a mouth.
_FACE: list[JsonValue] = [[40, 50], [80, 50], [60, 75], [45, 95], [75, 95]]


#: 640.0 is a whole number, says JSON; true and "640" are none.
Whole = Annotated[
    int, BeforeValidator(lambda value: int(value) if isinstance(value, float) and value % 1 == 0 else value)
]


class _Asked(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class Points(_Asked):
    """Landmarks from a client."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"points": _FACE}]})
    scheme: SchemeName | None = None
    points: Rows


class RenderRequest(_Asked):
    """A preview."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"options": {"strength": 0.8}, "side": 320}]})
    options: Options = {}
    view: View = "result"
    side: Whole = Field(640, ge=64, le=2048)
    quick: bool = False
    sequence: Whole = Field(0, ge=0, le=2**53)


class ExportRequest(_Asked):
    """Files at full resolution."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"options": {"strength": 0.8}}]})
    options: Options = {}
    format: Literal[".png", ".jpg", ".tif"] = ".png"


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


class Option(BaseModel):
    """An option of a transfer."""

    name: str
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
        told = {key: known[key] for key in cls.model_fields.keys() & known.keys()}
        # There is one reference here.
        told["choices"] = [choice for choice in known["choices"] if choice not in WITH_SECOND_REFERENCE]
        return cls(
            name=declared.name,
            default=declared.default,
            kind="switch" if isinstance(declared.default, bool) else kind,  # type: ignore[arg-type]
            **told,
        )


class Limits(BaseModel):
    """What a photo may have: bytes as a file, and pixels."""

    bytes: int
    pixels: int


class Offer(BaseModel):
    """What this server can do."""

    options: list[Option]
    landmark_formats: list[str]
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
    def of(cls, sitter: Sitter) -> Marks | None:
        """Describe those of a sitter, if there are any."""
        found = sitter.landmarks
        if found is None:
            return None
        return cls(
            scheme=found.scheme,
            points=np.asarray(found.points).tolist(),
            groups={name: list(rows) for name, rows in found.groups.items()},
            detected=sitter.detected,
            interocular_distance=found.interocular_distance,
        )


class PhotoFacts(BaseModel):
    """A photo and its face; where none was found, a message says so."""

    width: int
    height: int
    format: str | None
    depth: Literal["uint8", "uint16", "float32"]
    grey: bool
    landmarks: Marks | None
    message: str | None

    @classmethod
    def of(cls, sitter: Sitter) -> PhotoFacts:
        """Describe a sitter."""
        pixels = sitter.photo.pixels
        return cls(
            width=pixels.shape[1],
            height=pixels.shape[0],
            format=sitter.photo.format,
            depth=str(pixels.dtype),  # type: ignore[arg-type]
            grey=pixels.ndim == 2,
            landmarks=Marks.of(sitter),
            message=sitter.message if sitter.landmarks is None else None,
        )


class Pair(BaseModel):
    """Both photos."""

    target: PhotoFacts
    reference: PhotoFacts


class Seats(BaseModel):
    """The photos of a session, null where there is none yet."""

    target: PhotoFacts | None
    reference: PhotoFacts | None
