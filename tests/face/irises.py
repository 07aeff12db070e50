"""How far points are from where they should be, and which of a mesh are the irises."""

import numpy as np

RIGHT_IRIS, LEFT_IRIS = 468, 473


def distance(found, expected):
    """Return the mean distance in px of corresponding points."""
    found, expected = (getattr(points, "xy", points)[:, :2] for points in (found, expected))
    return np.linalg.norm(found - expected, axis=1).mean()
