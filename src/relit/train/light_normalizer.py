"""Faces without their light, as a step of a scikit-learn pipeline; scikit-learn itself is not needed."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from relit.errors import FaceNotFoundError, ImageError, LandmarkError, OptionError
from relit.face.detect import detect_landmarks
from relit.face.landmarks import Landmarks, as_landmarks
from relit.ltv.decomposition import normalize
from relit.photo.color import luma
from relit.photo.foreign_images import pixels_of
from relit.photo.pixels import check_pixels, to_unit
from relit.settings.option_fields import is_finite
from relit.settings.options import TransferOptions
from relit.splitting import Splitting

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from relit.inputs import AnyLandmarks
    from relit.photo.foreign_images import AnyImage


class LightNormalizer:
    """Take the light out of faces, for recognition: a transformer in scikit-learn's style.

    It maps images to `normalize`d ones. There is nothing to learn, so `fit` but checks its parameters.

    Parameters
    ----------
    lam : float or "auto"
        How fine light may be, as of `relit.TransferOptions`.
    neighborhood : {4, 8, 16, "isotropic"}
        How length is measured.
    eye_distance : float, optional
        Of faces that are cropped alike: the distance of the eyes in px, which sets the scale of λ. No face
        is looked for then.
    image_shape : (int, int), optional
        Height and width of images that come as rows of numbers, one row for each, as scikit-learn has them;
        rows come out, too.
    no_face : {"error", "keep"}
        What becomes of an image in which no face is found: it ends the work, or stays what it is, in grey.

    Attributes
    ----------
    n_features_in_ : int
        Of rows, how long they are; set by `fit`.

    Examples
    --------
    >>> rows = np.random.default_rng(0).uniform(0.2, 0.4, (3, 400))
    >>> normalizer = LightNormalizer(eye_distance=10, image_shape=(20, 20)).fit(rows)
    >>> bool(np.allclose(normalizer.transform(rows), normalizer.transform(2 * rows), atol=1e-6))
    True
    """

    n_features_in_: int

    def __init__(
        self,
        *,
        lam: float | str = 0.2,
        neighborhood: int | str = 4,
        eye_distance: float | None = None,
        image_shape: tuple[int, int] | None = None,
        no_face: str = "error",
    ) -> None:
        self.lam = lam
        self.neighborhood = neighborhood
        self.eye_distance = eye_distance
        self.image_shape = image_shape
        self.no_face = no_face

    def __repr__(self) -> str:
        """Return the parameters."""
        told = ", ".join(f"{name}={value!r}" for name, value in self.get_params().items())
        return f"LightNormalizer({told})"

    def get_params(self, deep: bool = True) -> dict[str, Any]:  # noqa: ARG002 (scikit-learn's signature)
        """Return the parameters by their names."""
        return {name: getattr(self, name) for name in inspect.signature(type(self)).parameters}

    def set_params(self, **params: Any) -> Self:
        """Change parameters by their names.

        Raises
        ------
        OptionError
            If a name is unknown.
        """
        known = self.get_params()
        for name, value in params.items():
            if name not in known:
                raise OptionError(f"{name}: no such parameter; expected one of {', '.join(known)}")
            setattr(self, name, value)
        return self

    def fit(self, X: Any, y: Any = None) -> Self:  # noqa: ARG002 (scikit-learn's signature)
        """Check the parameters, and that rows are as long as `image_shape` says.

        Raises
        ------
        OptionError
            If a parameter is out of range.
        ImageError
            If rows are of another length.
        """
        self._options()
        if self.image_shape is not None:
            self.n_features_in_ = self._rows(X).shape[1]
        return self

    def transform(
        self, X: Any, landmarks: Sequence[AnyLandmarks | None] | None = None
    ) -> NDArray[np.float32] | list[NDArray[np.float32]]:
        """Return the images without their light.

        Parameters
        ----------
        X : list of images, or array
            Images of any kind that `relit.transfer` takes; an array ``(n, H, W)`` or ``(n, H, W, 3)``; or,
            with `image_shape`, rows ``(n, H · W)`` of grey in [0, 1] or in 8 or 16 bits.
        landmarks : sequence of (landmarks or None), optional
            One entry for each image; where there is none, the largest face is found.

        Returns
        -------
        (n, H, W) or (n, H · W) float32 array, or list of (H, W) float32 arrays
            In [0, 1], and 0.5 where a pixel is as bright as its surroundings; a list where images differ in
            size.

        Raises
        ------
        OptionError
            If a parameter is out of range.
        ImageError
            If something is no image, or rows are of another length.
        FaceNotFoundError
            If an image has no face, unless ``no_face="keep"``.
        LandmarkError
            If landmarks are unusable, or not as many as there are images.
        """
        options = self._options()
        images = list(X if self.image_shape is None else self._rows(X).reshape(-1, *self.image_shape))
        faces = [None] * len(images) if landmarks is None else list(landmarks)
        if len(faces) != len(images):
            raise LandmarkError(
                f"landmarks: expected one entry for each of {len(images)} images, got {len(faces)}"
            )
        made = [
            self._normalized(image, face, options, f"image {row}")
            for row, (image, face) in enumerate(zip(images, faces, strict=True))
        ]
        if self.image_shape is not None:
            return np.array(made, np.float32).reshape(len(made), self.image_shape[0] * self.image_shape[1])
        alike = len({one.shape for one in made}) == 1
        return np.stack(made) if alike else made

    def fit_transform(
        self, X: Any, y: Any = None, **rest: Any
    ) -> NDArray[np.float32] | list[NDArray[np.float32]]:
        """Fit, and return the images without their light, as of `transform`."""
        return self.fit(X, y).transform(X, **rest)

    def get_feature_names_out(self, input_features: Any = None) -> NDArray[np.object_]:
        """Return a name for each number of a row: those that are given, or ``pixel0`` and so on.

        Raises
        ------
        OptionError
            If images are no rows, so that their pixels have no names; or names are of another count.
        """
        if self.image_shape is None:
            raise OptionError(
                "image_shape: pixels have names only in rows; give the height and width of these"
            )
        count = self.image_shape[0] * self.image_shape[1]
        names = input_features if input_features is not None else [f"pixel{n}" for n in range(count)]
        if len(names) != count:
            raise OptionError(f"input_features: expected {count} names, got {len(names)}")
        return np.array(names, object)

    def __sklearn_is_fitted__(self) -> bool:
        """Return that there is nothing to learn."""
        return True

    def __sklearn_tags__(self) -> Any:
        """Return what scikit-learn is to know; only scikit-learn asks, so it is there."""
        from sklearn.utils import InputTags, Tags, TargetTags, TransformerTags

        rows = self.image_shape is not None
        return Tags(
            estimator_type="transformer",
            target_tags=TargetTags(required=False),
            transformer_tags=TransformerTags(preserves_dtype=["float32"]),
            input_tags=InputTags(two_d_array=rows, three_d_array=not rows, positive_only=True),
            requires_fit=False,
        )

    def _options(self) -> TransferOptions:
        """Return the options of the split, all parameters checked."""
        distance, shape = self.eye_distance, self.image_shape
        if distance is not None and not (is_finite(distance) and distance > 0):
            raise OptionError(
                f"eye_distance: expected a finite number of px above 0, or None, got {distance!r}"
            )
        if distance is not None and self.lam == "auto":
            raise OptionError("lam: 'auto' needs faces; give a number, or no eye_distance")
        if shape is not None and (np.shape(shape) != (2,) or np.asarray(shape).dtype.kind not in "iu"):
            raise OptionError(f"image_shape: expected height and width in px, or None, got {shape!r}")
        if self.no_face not in ("error", "keep"):
            raise OptionError(f"no_face: expected 'error' or 'keep', got {self.no_face!r}")
        return TransferOptions().changed(lam=self.lam, neighborhood=self.neighborhood)  # type: ignore[arg-type]

    def _rows(self, X: Any) -> NDArray[Any]:
        """Return rows as an array, if they are as long as `image_shape` says."""
        rows = np.asarray(X)
        height, width = self.image_shape or (0, 0)
        if rows.ndim != 2 or rows.shape[1] != height * width:
            raise ImageError(
                f"X: expected rows of {height * width} numbers, an image of {width}x{height} px each, got an "
                f"array of shape {rows.shape}; set image_shape"
            )
        return rows

    def _normalized(
        self, image: AnyImage, face: AnyLandmarks | None, options: TransferOptions, name: str
    ) -> NDArray[np.float32]:
        """Return an image without its light, or in grey if that is wanted of one without a face."""
        pixels = check_pixels(pixels_of(image, name), name)
        if self.eye_distance is not None:
            splitting = Splitting(self.eye_distance, float(options.lam), options.neighborhood)
        else:
            found = self._face(pixels, face, name)
            if found is None:
                unit = to_unit(pixels)
                return np.asarray(unit if unit.ndim == 2 else luma(unit), np.float32)
            splitting = Splitting.of(found, options)
        return normalize(
            pixels,
            splitting.lam,
            neighborhood=splitting.neighborhood,
            interocular_distance=splitting.interocular_distance,
        )

    def _face(self, pixels: NDArray[Any], face: AnyLandmarks | None, name: str) -> Landmarks | None:
        """Return the face that is given or found; None where there is none and images may stay."""
        if face is not None:
            return as_landmarks(face, f"landmarks of {name}")
        try:
            return detect_landmarks(pixels, name=name)
        except FaceNotFoundError:
            if self.no_face == "error":
                raise
            return None
