"""The logarithmic total variation model: I = u · v (Sect. 4 of Li, Yin and Deng, 2009).

With f = log I, ``ũ = argmin ∫|∇ũ| + λ‖f - ũ‖₁``, ``u = exp ũ`` is the large-scale, illumination-dependent
component and ``v = exp(f - ũ)`` the small-scale, illumination-invariant one [1]_.

Exact TV-L1 commutes with increasing functions of intensity, the logarithm among them, so that it is solved on
the image as it is: u takes values that occur in the image, and no logarithm is ever quantised. The isotropic
kind does not commute exactly, and runs on log I.

References
----------
.. [1] T. Chen, W. Yin, X. S. Zhou, D. Comaniciu, T. S. Huang, "Total variation models for variable lighting
       face recognition", IEEE PAMI 28(9), 2006.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.errors import OptionError
from relit.photo.color import luma
from relit.photo.foreign_images import pixels_of
from relit.photo.pixels import DARKEST, check_pixels, size_and_dtype, to_unit
from relit.runtime.memo import remembered
from relit.runtime.threads import available, pool
from relit.solver.neighborhoods import check_lam

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.photo.foreign_images import AnyImage

#: The interocular distance, in px, of the face that λ refers to.
FACE_SCALE = 100.0

_GAP = 1e-3  # relative duality gap of the isotropic kind


@dataclass(frozen=True, eq=False)
class Decomposition:
    """An image split into light and person.

    Attributes
    ----------
    u, v : (H, W) or (H, W, 3) float32 array
        Large-scale component in (0, 1], and small-scale component around 1. ``u * v`` is the image in [0, 1],
        with what is darker than half an 8-bit grey level raised to that.
    lam : float
        λ that the split was made with, in px⁻¹.
    neighborhood : int or str
        Total variation that it was made with.
    """

    u: NDArray[np.float32]
    v: NDArray[np.float32]
    lam: float
    neighborhood: int | str

    def __repr__(self) -> str:
        """Return the size, and what the split was made with."""
        made = f"lam={self.lam:.4g}, neighborhood={self.neighborhood!r}"
        return f"Decomposition({size_and_dtype(self.u)}, {made})"


def lam_in_px(lam: float, interocular_distance: float) -> float:
    """Return λ in px⁻¹ of a face with so many px between the eyes, λ being that of one with 100.

    Examples
    --------
    >>> lam_in_px(0.2, 50.0)
    0.4
    """
    return lam * FACE_SCALE / interocular_distance


@remembered
def decompose(
    image: AnyImage,
    lam: float = 0.2,
    *,
    neighborhood: int | str = 4,
    interocular_distance: float = FACE_SCALE,
) -> Decomposition:
    """Split an image into its large-scale and small-scale components, each channel for itself.

    Parameters
    ----------
    image : array, Photo, PIL image, torch tensor, or path
        As of `relit.transfer`; alpha is left out.
    lam : float
        λ for a face whose eyes are 100 px apart.
    neighborhood : {4, 8, 16, "isotropic"}
        As in `TransferOptions`.
    interocular_distance : float
        Distance of the eyes in px: λ is scaled by 100 over it. At 100, λ is in px⁻¹.

    Returns
    -------
    Decomposition

    Raises
    ------
    ImageError
        If the image is not a photo's pixels.
    OptionError
        If λ, the neighbourhood or the distance is out of range.

    Warns
    -----
    RuntimeWarning
        If the isotropic kind stops more than 0.1 % from the optimum.

    Examples
    --------
    >>> import numpy as np
    >>> image = np.full((16, 16), 100, np.uint8)
    >>> image[4, 4] = 50
    >>> split = decompose(image)
    >>> round(float(split.u[4, 4] * 255)), float(split.v[4, 4])
    (100, 0.5)
    """
    pixels = check_pixels(pixels_of(image, "image"), "image")
    check_lam(lam)
    if not (np.isfinite(interocular_distance) and interocular_distance > 0):
        raise OptionError(
            f"interocular_distance: expected a number of px above 0, got {interocular_distance!r}"
        )
    lam_px = float(lam_in_px(lam, interocular_distance))
    planes = [pixels] if pixels.ndim == 2 else list(np.moveaxis(pixels, -1, 0))
    # The solvers release the GIL, and every plane is solved alone: threads change nothing but the time.
    cores = available()
    threads = max(1, cores // len(planes))
    with pool(min(len(planes), cores)) as run:
        split = run(lambda plane: _large_scale(plane, lam_px, neighborhood, threads), planes)
    u = split[0] if pixels.ndim == 2 else np.stack(split, axis=-1)
    v = np.maximum(to_unit(pixels), np.float32(DARKEST)) / u
    return Decomposition(u, np.asarray(v, np.float32), lam_px, neighborhood)


def _large_scale(
    plane: NDArray[Any], lam: float, neighborhood: int | str, threads: int
) -> NDArray[np.float32]:
    # Imported here: the solvers bring a compiler along, and our own method takes none of them.
    if neighborhood != "isotropic":
        from relit.solver.exact import tv_l1

        u = tv_l1(plane, lam, neighborhood, threads=threads)  # type: ignore[arg-type]
        return np.maximum(to_unit(u), np.float32(DARKEST))
    from relit.solver.isotropic import tv_l1_isotropic

    solution = tv_l1_isotropic(np.log(np.maximum(to_unit(plane), DARKEST)), lam, tolerance=_GAP)
    if solution.gap > _GAP:
        warnings.warn(
            f"isotropic TV-L1 stopped after {solution.iterations} iterations, {solution.gap:.1%} from "
            "the optimum; a larger lam converges sooner; 4, 8 or 16 neighbours are exact",
            RuntimeWarning,
            stacklevel=2,
        )
    return np.exp(solution.u).astype(np.float32)


def normalize(
    image: AnyImage,
    lam: float = 0.2,
    *,
    neighborhood: int | str = 4,
    interocular_distance: float = FACE_SCALE,
) -> NDArray[np.float32]:
    """Return what of a face does not depend on the light: v of its lightness, an image for recognition.

    Parameters
    ----------
    image, lam, neighborhood, interocular_distance
        As for `decompose`. Of a colour image, the luma.

    Returns
    -------
    (H, W) float32 array
        ``v / 2``, cut at 1: 0.5 where a pixel is as bright as its surroundings.

    Raises
    ------
    ImageError
        If the image is not a photo's pixels.
    OptionError
        If λ, the neighbourhood or the distance is out of range.

    Examples
    --------
    Twice the light changes nothing:

    >>> import numpy as np
    >>> face = np.random.default_rng(0).integers(20, 100, (32, 32)).astype(np.uint8)
    >>> bool(np.array_equal(normalize(face), normalize(2 * face)))
    True
    """
    pixels = check_pixels(pixels_of(image, "image"), "image")
    grey = pixels if pixels.ndim == 2 else luma(to_unit(pixels)).astype(np.float32)
    split = decompose(grey, lam, neighborhood=neighborhood, interocular_distance=interocular_distance)
    return np.minimum(split.v / 2, np.float32(1))
