"""What a preview tells of its new light, so that a page can show it and start from it: lamps, fill, trust."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from relit.light.dome import DOME, Lamps
from relit.light.lamps import angles_of, studio_points
from relit.photo.pixels import from_unit
from relit.photo.profile import encode_srgb
from relit.settings.studio_lights import MOST_LAMPS, studio_light

if TYPE_CHECKING:
    from relit.results import TransferResult

_FAINT = 0.01  # of the strongest lamp: what is less is none
_SEEN = 0.5  # cosine of the angle to the camera up to which a face shows much of its skin


def light_headers(result: TransferResult) -> dict[str, str]:
    """Return the headers that tell of a light; lamps and fill are empty of a method that finds none."""
    options, sources, fill = result.options, result.first.sources, result.options.fill
    if options.light is not None:
        light = studio_light(options.light, fill)
        sources, fill = sources or studio_points(light), light.fill
    elif sources is not None and fill is None:
        fill = even_share(sources)
    found = options.light is None and sources is not None and sources.colors is not None
    lamps = [] if sources is None else listed(without_cast(sources) if found else sources)
    return {
        "X-Relit-Lamps": json.dumps(lamps, separators=(",", ":")),
        "X-Relit-Fill": "" if sources is None or fill is None else f"{fill:.3f}",
        "X-Relit-Confidence": f"{result.confidence:.3f}",
    }


def listed(lamps: Lamps) -> list[tuple[int, int, float, str]]:
    """Return lamps as azimuth and elevation in degrees, power, and colour; the strongest first.

    Examples
    --------
    >>> listed(studio_points(studio_light("-30,20:power=0.5+120,10:power=2:color=#ff8000")))
    [(120, 10, 1.0, '#ff8000'), (-30, 20, 0.25, '#ffffff')]
    """
    colors = np.repeat(lamps.weights[:, None], 3, axis=1) if lamps.colors is None else lamps.colors
    powers = colors.max(axis=1)
    most = float(powers.max(initial=0))
    bright = [row for row in np.argsort(-powers, kind="stable")[:MOST_LAMPS] if powers[row] > _FAINT * most]
    azimuths, elevations = angles_of(lamps.directions[bright])
    texts = from_unit(encode_srgb(colors[bright] / np.maximum(powers[bright, None], 1e-12)), np.uint8)
    return [
        (round(azimuth), round(elevation), round(float(power / most), 3), f"#{bytes(color).hex()}")
        for azimuth, elevation, power, color in zip(azimuths, elevations, powers[bright], texts, strict=True)
    ]


def without_cast(lamps: Lamps) -> Lamps:
    """Return lamps that were found in a photo in white balance: their overall colour is partly the skin's."""
    assert lamps.colors is not None
    overall = lamps.colors.sum(axis=0) / max(float(lamps.weights.sum()), 1e-12)
    return lamps._replace(colors=lamps.colors / np.maximum(overall, 1e-12))


def even_share(lamps: Lamps) -> float:
    """Return light from everywhere, as a share of what falls on what looks into the light, of any lamps.

    It is what falls on the darkest side that a face shows.

    Examples
    --------
    >>> even_share(Lamps(DOME, np.ones(100))) > 0.8, even_share(Lamps(np.array([[-1.0, 0, 0]]), np.ones(1)))
    (True, 0.0)
    """
    falls = np.maximum(DOME[-DOME[:, 2] > _SEEN] @ lamps.directions.T, 0) @ lamps.weights
    return float(falls.min() / max(float(falls.max()), 1e-12))
