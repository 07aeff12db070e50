"""A baseline that knows shape: the ratio of two lights of nine spherical harmonics each [1]_.

A convex matt surface of one albedo under distant light has the brightness ``Σ l_k Y_k(n)``, with harmonics
of order 2 at most [2]_. The nine l_k of either photo are found by least squares over the face, on the
normals of the target's landmark mesh, and ``target · (Y l_reference) / (Y l_target)`` is the relit face. It
casts no shadows and removes none.

References
----------
.. [1] Z. Wen, Z. Liu, T. S. Huang, "Face relighting with radiance environment maps", CVPR 2003.
.. [2] R. Ramamoorthi, P. Hanrahan, "An efficient representation for irradiance environment maps", SIGGRAPH
       2001.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from relit.face.shape import face_shape
from relit.methods.scene import Relit, Scene, as_planes, stacked
from relit.photo.pixels import to_unit
from relit.runtime.threads import one_blas_thread

if TYPE_CHECKING:
    from numpy.typing import NDArray

_DARKEST = 0.05  # of the brightest that a light makes: what it leaves darker is no base for a ratio
_RATIO = 8.0  # and no ratio goes beyond this, nor below its inverse


def relight(scene: Scene) -> Relit:
    """Return target · ratio of the lights."""
    with one_blas_thread():
        return _relit(scene)


def _relit(scene: Scene) -> Relit:
    basis = harmonics(face_shape(scene.face.landmarks, scene.face.shape).normals)
    targets = as_planes(to_unit(scene.target).astype(np.float64))
    references = as_planes(to_unit(scene.reference).astype(np.float64))
    relit = []
    for plane, reference in zip(targets * (len(references) // len(targets)), references, strict=True):
        shade, light = (_shading(basis, image, scene.face.interior) for image in (plane, reference))
        relit.append(plane * np.clip(light / shade, 1 / _RATIO, _RATIO))
    return Relit(np.clip(stacked(relit), 0, 1))


def _shading(basis: NDArray[np.float64], image: NDArray[Any], face: NDArray[np.bool_]) -> NDArray[np.float64]:
    light, *_ = np.linalg.lstsq(basis[face], image[face], rcond=None)
    shade = basis @ light
    return np.asarray(np.maximum(shade, _DARKEST * shade[face].max()))


def harmonics(normals: NDArray[Any]) -> NDArray[np.float64]:
    """Return the nine harmonics up to order 2, without their constants, of (..., 3) unit vectors."""
    x, y, z = np.moveaxis(normals, -1, 0)
    return np.stack([np.ones_like(x), x, y, z, x * y, x * z, y * z, x * x - y * y, 3 * z * z - 1], axis=-1)
