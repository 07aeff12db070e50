"""What hair and cloth of a person take of a change of light."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from relit.compose.matte import skin_share
from relit.compose.person_matte import person_area
from relit.photo.channels import repeated
from relit.photo.color import brightest
from relit.photo.curves import log
from relit.photo.filters import closed, gaussian
from relit.photo.resampling import blurred
from relit.runtime.memo import remembered

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.regions import FaceRegions
    from relit.face.views import View

# Of a change of brightness, and of hue, that hair and cloth do not take; by eye on forty pairs.
_SPARED, _SPARED_HUE = 0.6, 0.5
_CALM = 0.6  # interocular distances over which cloth takes the mean of a change; by eye on the same
_CHIN = 0.2  # interocular distances below it from where all that is not skin is cloth
_SHINE = 0.25  # interocular distances: the width of what shines on a chest; by eye on two of them
_PATCH = 0.03  # interocular distances over which skin and hair turn into each other


@remembered
def hair(view: View) -> NDArray[np.float32]:
    """Return how much of each pixel is hair or cloth of the person, (H, W) in [0, 1].

    It is what of the person does not look like the skin of the face; below the brows, all of a face is skin.
    """
    iod, skin = view.regions.interocular_distance, skin_share(view)
    # A collarbone shines more than any face.
    size = 2 * max(round(_SHINE * iod / 2), 1) + 1
    skin = np.maximum(skin, _below_chin(view.regions) * closed(skin, size))
    other = gaussian(1 - skin, _PATCH * iod, edge="repeated")
    return np.asarray(person_area(view) * other, np.float32)


def sparing_hair(change: NDArray[np.float32], base: NDArray[np.float32], view: View) -> NDArray[np.float32]:
    """Return a change of which hair and cloth take less: they scatter light, and lie where no template does.

    Cloth takes the mean of what is near.

    How bright they get is what the brightest channel tells, as of a light behind a filter. White cloth does
    not burn out, but takes the light's colour.

    Parameters
    ----------
    change : (h, w, k) float32 array
        In logarithms of `base`.
    base : (h, w, k) float32 array
        What of the target is relit, 0 to 1.
    view : View
        Of the target.

    Returns
    -------
    (h, w, k) float32 array
    """
    count, wide = change.shape[2], _CALM * view.regions.interocular_distance
    # A neck's light that goes on as it is would be a coloured spot on a shirt.
    cloth = hair(view) * _below_chin(view.regions)
    near = repeated(np.maximum(blurred(cloth, wide), np.float32(1e-2)), count)
    part, cloth = (repeated(plane, count) for plane in (hair(view), cloth))
    around = blurred(change * cloth, wide) / near
    calm = change + cloth * (around - change)
    bright = repeated(brightest(calm), count)
    spared = bright * (1 - _SPARED * part) + (calm - bright) * (1 - _SPARED_HUE * part)
    beyond_white = repeated(np.maximum(brightest(log(base) + spared), 0), count)
    return np.asarray(spared - part * beyond_white, np.float32)


def _below_chin(face: FaceRegions) -> NDArray[np.float32]:
    """Return where no hair of the head is, 0 to 1."""
    return np.asarray(np.clip(-face.height / (_CHIN * face.interocular_distance), 0, 1), np.float32)
