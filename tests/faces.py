"""Where the faces of test photos end."""

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.spatial import Delaunay


def off_the_face(landmarks, shape, outline=None):
    """Return where a photo is farther from its face than 0.9 interocular distances and two pixels."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    outside = Delaunay(landmarks.xy if outline is None else outline).find_simplex(np.dstack([x, y])) < 0
    off = distance_transform_edt(outside) > 0.9 * landmarks.interocular_distance + 2
    assert 0.05 < off.mean() < 0.9
    return off


def untouched(result):
    """Return where a transfer's mask leaves a photo as it is: behind the person, and far below."""
    share = np.zeros(result.target.shape[:2])
    share[result.window] = result.mask
    assert 0.02 < (share == 0).mean() < 0.9
    return share == 0
