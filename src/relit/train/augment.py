"""Random light for training data: an augmentation as PyTorch and torchvision have them, without needing them.

What a call does is drawn from a key, and from nothing else: the seed, the epoch, the process's number as a
worker of a ``DataLoader``, and the number of calls so far in it; until `set_epoch` says which epoch it is, a
worker goes by the seed that torch gives it, too. So workers and epochs differ, however workers are started.
"""

from __future__ import annotations

from dataclasses import replace
from operator import index
from secrets import randbits
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.errors import FaceNotFoundError, OptionError
from relit.face.detect import detect_landmarks
from relit.face.landmarks import as_landmarks, check_inside
from relit.photo.foreign_images import opened
from relit.photo.photo import Photo
from relit.relighting import transfer
from relit.runtime.threads import limit
from relit.settings.option_fields import is_finite
from relit.train.data_loader import loader_worker, share_of_threads
from relit.train.image_in_sample import find, put, take
from relit.train.photo_memory import PhotoMemory
from relit.train.random_settings import RandomSettings
from relit.train.reference_pool import ReferencePool

if TYPE_CHECKING:
    from collections.abc import Sequence

    from relit.inputs import AnyLandmarks
    from relit.settings.options import TransferOptions
    from relit.train.random_settings import Draw, Lights


class RelightAugment:
    """Relight faces at random, to train with.

    Called on an image, it returns one of the same kind, shape and dtype: an array ``(H, W)``, ``(H, W, 1)``
    or ``(H, W, 3)``, or with alpha ``(H, W, 2)`` or ``(H, W, 4)``, of uint8, uint16 or floats in [0, 1]; a
    `Photo`; a PIL image (L, RGB, with alpha or without, I;16); a torch tensor ``(1, H, W)`` or ``(3, H, W)``
    of uint8 or floats in [0, 1]; a ``tv_tensors.Image``. Alpha is kept. A grey image stays grey: it takes the
    lightness of a reference alone.

    Called on a sample, a tuple, list or dict of anything, or several arguments, it relights the image in it
    and passes all else through, as transforms of torchvision's v2 do: the first PIL image, Photo or
    ``tv_tensors.Image``, or where there is none of these, the first array or plain tensor that has the shape
    of a photo (of arrays, ``(H, W)`` and ``(H, W, 3)`` come first). It goes into ``v2.Compose``, before
    anything that takes values out of [0, 1].

    Parameters
    ----------
    references : path, image, or list of such, optional
        Photos that give the light. A path is that of a photo, of a folder, with all photos in it and its
        folders, or a pattern such as ``"lights/**/*.jpg"``. Files are read when they are first drawn.
    lights : str, (float, float), or list of such, optional
        Lights by name (``"rembrandt"``, ...), lamps by their place, ``"-30,20"`` or ``(-30, 20)``, or
        ``"random"`` for a lamp anywhere within `azimuth` and `elevation`. By default ``"random"`` if there
        are no references. With both, half of the draws are a reference.
    azimuth, elevation : (float, float)
        Ranges of a random lamp's place in degrees, to the right of the picture and upwards.
    strength : float, (low, high), or list of float
        As of `TransferOptions`, and random as `changes` are; it goes before that of `options`.
    p : float
        Probability that an image is relit. Otherwise it is returned itself.
    on_missing : {"keep", "raise"}
        Whether an image in which no face is found is returned itself, or an error. A reference without a face
        always is one; `prepare` finds out early.
    seed : int, optional
        With it, a run can be repeated: see Notes. Without, draws differ in every process, epoch and run.
    reference_landmarks : list of (landmarks or None), optional
        One entry for each photo; by default faces are detected, once.
    detail : float, optional
        As of `relit.transfer`: less is quicker on large faces.
    options : TransferOptions, optional
        How to relight.
    **changes
        Single fields of `TransferOptions` by name: a value, a tuple ``(low, high)`` for any number between,
        or a list for any of its values: ``exposure=(-0.5, 0.5)``, ``method=["shading", "ltv"]``.

    Raises
    ------
    OptionError
        If an argument is out of its range, or there is no photo where `references` points.
    ImageError, LandmarkError
        If a reference that is an image, or its landmarks, cannot be used.

    See Also
    --------
    relit.transfer : what is done to an image.

    Notes
    -----
    With a seed, epochs differ, and the run repeats:

    - In one process, calls are counted, and the second epoch goes on where the first one ended.
    - In workers of a ``DataLoader``, draws depend on the seed that torch gives the worker, too: it is another
      for every worker and in every epoch. As with any random transform, the run repeats if torch is seeded as
      well: by ``torch.manual_seed``, or by the loader's ``generator``. Persistent workers go on counting.
    - With ``set_epoch(epoch)`` before each epoch, as of ``DistributedSampler``, draws in workers do without
      torch's seeds: they depend on `seed`, epoch, worker and number of the call alone, and `draw` tells them
      beforehand.
    - Other pools hand every worker the same copy: give each call its own ``number``, as the sample's index.
      It counts as a call of the main process, so that the lights do not depend on who does the work.
    - Processes of distributed training take one seed each, such as ``1000 * run + rank``.
    - What is pickled or copied goes on where the original was.

    What was found out about the photos that were relit last is kept, 150 MB at most in each process, which is
    about eight photos of 256²: another light on one of them takes half the time.

    A call draws from ``numpy.random.SeedSequence(seed, spawn_key=(epoch, worker, number))``: `epoch` is 0 or
    what `set_epoch` was told; `worker` is 0, and in worker i of a ``DataLoader`` i + 1; `number` counts the
    calls before it, in this process and epoch. For `seed` stands ``[seed, torch's seed of the worker]`` in a
    worker, if `set_epoch` was never called or there is no seed.

    Examples
    --------
    >>> import relit
    >>> image = relit.read_image(relit.sample("target")).pixels
    >>> augment = RelightAugment(lights=["rembrandt", "loop"], p=1, seed=7)
    >>> augment(image).shape == image.shape
    True
    >>> augment.draw(1).options.light
    'rembrandt'
    >>> relit_image, label = augment((image, 3))
    >>> label
    3
    """

    def __init__(
        self,
        references: Any = None,
        *,
        lights: Lights | None = None,
        azimuth: tuple[float, float] = (-90, 90),
        elevation: tuple[float, float] = (-20, 60),
        strength: float | tuple[float, float] | list[float] = (0.3, 1.0),
        p: float = 0.5,
        on_missing: str = "keep",
        seed: int | None = None,
        reference_landmarks: Sequence[AnyLandmarks | None] | None = None,
        detail: float | None = None,
        options: TransferOptions | None = None,
        **changes: Any,
    ) -> None:
        if on_missing not in ("keep", "raise"):
            raise OptionError(f"on_missing: expected 'keep' or 'raise', got {on_missing!r}")
        if detail is not None and not (is_finite(detail) and detail > 0):
            raise OptionError(f"detail: expected a finite number of px above 0, or None, got {detail!r}")
        if references is None and reference_landmarks is not None:
            raise OptionError("reference_landmarks: expected none without references; leave them out")
        self.on_missing, self.detail = on_missing, detail
        self.seed = None if seed is None else _count("seed", seed)
        self._entropy = randbits(128) if self.seed is None else self.seed
        self._epoch: int | None = None
        self._calls = 0
        self._pool = None if references is None else ReferencePool(references, reference_landmarks)
        self._memory = PhotoMemory()
        self._settings = RandomSettings(
            len(self.references),
            lights=lights,
            azimuth=azimuth,
            elevation=elevation,
            p=p,
            options=options,
            changes={"strength": strength, **changes},
        )

    def __call__(
        self, image: Any, /, *others: Any, landmarks: AnyLandmarks | None = None, number: int | None = None
    ) -> Any:
        """Relight an image, or the image in a sample.

        Parameters
        ----------
        image : image or sample
        *others
            The rest of a sample that is given as several arguments; a tuple comes back.
        landmarks : Landmarks or (n, 2) or (n, 3) array_like, optional
            Of the face in the image; detected by default, which takes about as long as relighting.
        number : int, optional
            Do what `draw` says for this number, and do not count the call.

        Returns
        -------
        image or sample
            Of the kind that was given. What is not relit is the same object.

        Raises
        ------
        ImageError
            If there is no image, or it is not a photo's pixels.
        FaceNotFoundError
            If there is no face, and `on_missing` says so; or none in a reference.
        LandmarkError
            If landmarks are unusable, lie outside the image, or do not pair up with the reference's.
        OptionError
            If the number is not one.
        """
        if number is None:
            draw = self._draw(self._calls, *self._process())
            self._calls += 1
        else:
            draw = self.draw(number)
        sample = (image, *others) if others else image
        place = find(sample)
        given = take(sample, place)
        photo, back = opened(given, "image")
        if not draw.applied:
            return sample
        try:
            face = (
                detect_landmarks(photo.pixels) if landmarks is None else as_landmarks(landmarks, "landmarks")
            )
        except FaceNotFoundError:
            if self.on_missing == "raise":
                raise
            return sample
        check_inside(face, photo.pixels.shape, "landmarks")
        reference = marks = None
        if self._pool and draw.reference is not None:
            reference, marks = self._pool.seen(draw.reference, photo, draw.options, self.detail)
        with limit(share_of_threads()), self._memory.open(photo, face):
            result = transfer(
                photo,
                reference,
                target_landmarks=face,
                reference_landmarks=marks,
                detail=self.detail,
                options=draw.options,
            )
        made = back(result.image)
        return put(sample, place, replace(given, pixels=made) if isinstance(given, Photo) else made)

    def __repr__(self) -> str:
        """Return what it draws from."""
        settings = self._settings
        shown = {"references": len(self.references), "lights": settings.lights, "p": settings.p}
        told = ", ".join(
            f"{name}={value!r}" for name, value in (shown | settings.changes | {"seed": self.seed}).items()
        )
        return f"RelightAugment({told})"

    @property
    def references(self) -> tuple[Any, ...]:
        """The references: paths, and of what was given as an image, a `Photo`."""
        return tuple(self._pool.given) if self._pool else ()

    def set_epoch(self, epoch: int) -> None:
        """Begin the draws of an epoch, in this process and in workers that are started from now on.

        Parameters
        ----------
        epoch : int
            From 0.

        Raises
        ------
        OptionError
            If it is not an integer of 0 or more.
        """
        self._epoch, self._calls = _count("epoch", epoch), 0

    def prepare(self) -> None:
        """Read all references and find their faces now, so that workers started later need not.

        Raises
        ------
        ImageError
            If one cannot be read.
        FaceNotFoundError
            If one has no face.
        """
        colours = Photo(np.zeros((1, 1, 3), np.uint8))
        if self._pool:
            for number in range(len(self._pool)):
                self._pool.seen(number, colours, self._settings.options, self.detail)

    def draw(self, number: int, *, worker: int | None = None) -> Draw:
        """Return what a call of this epoch does, without doing it.

        Parameters
        ----------
        number : int
            How many calls come before it.
        worker : int, optional
            If the call is made in a worker of a ``DataLoader``: which, from 0.

        Returns
        -------
        Draw

        Raises
        ------
        OptionError
            If a number is not an integer of 0 or more, or a worker is given without a seed or before
            `set_epoch`.

        Examples
        --------
        >>> augment = RelightAugment(seed=1, p=0.7, strength=(0.5, 1))
        >>> draw = augment.draw(0)
        >>> draw.applied, draw.options.light, round(draw.options.strength, 2)
        (True, '-53.1,30.0', 0.56)
        """
        if worker is None:
            return self._draw(_count("number", number))
        if self.seed is None or self._epoch is None:
            raise OptionError(
                "worker: its draws are known only with a seed and an epoch; give RelightAugment a seed, and "
                "call set_epoch"
            )
        return self._draw(_count("number", number), _count("worker", worker) + 1)

    def _draw(self, number: int, process: int = 0, *seeds: int) -> Draw:
        """Draw what a call in a process does, in a worker of torch's by its seed too if need be."""
        entropy = [self._entropy, *seeds]
        key = np.random.SeedSequence(entropy, spawn_key=(self._epoch or 0, process, number))
        return self._settings.draw(key)

    def _process(self) -> tuple[int, ...]:
        """Return the number of this process, and in a worker whose epoch is not known, its torch seed."""
        info = loader_worker()
        if info is None:
            return (0,)
        known = self.seed is not None and self._epoch is not None
        return (info.id + 1,) if known else (info.id + 1, info.seed)


def _count(name: str, value: Any) -> int:
    """Return a number that counts something."""
    try:
        number = index(value)
    except TypeError:
        number = -1
    if number < 0 or isinstance(value, bool):
        raise OptionError(f"{name}: expected an integer of 0 or more, got {value!r}")
    return number
