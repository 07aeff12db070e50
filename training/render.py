"""A head under one lamp at a time, by ray tracing: light adds up, so that any light is a weighted sum.

A lamp's light is diffuse and glossy (Blinn and Phong), with the shadows that all of the head casts. Of light
from the head itself there is one bounce: the mean of what the head gets, from where the sky is hidden.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

from relit.photo.profile import encode_srgb
from training.lights import LAMPS, lamps

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from training.people import Person

    Floats = NDArray[np.float32]

_SPREAD, _SHADOW_RAYS = 0.15, 2  # rad: half the size of a lamp; rays to it
_SHINE, _ROUGH = (0.005, 0.04), (6, 40)  # share of light that a skin reflects, and exponent of its gloss
_UNDER_SKIN = 0.6, 0.4, 0.3  # px that red, green and blue light spreads under the skin
_LENS, _GRAIN = 0.4, 0.003  # px of a blur, and linear noise
_WALL = 0.35  # linear
_ANGLES, _MOST_ANGLE = (9, 6, 3), 25  # degrees that heads are turned, nodded and tilted
_MIDDLE = np.array([0, 0.6, 1.2])  # of a head, in interocular distances from between the eyes
_FAR = 9, 22  # interocular distances to the camera
_AHEAD = 1e-3  # interocular distances that a ray starts above the surface


class Shot(NamedTuple):
    """A head before a camera.

    Attributes
    ----------
    covered : (H, W) bool array
    albedo : (n, 3) array
        Of the pixels that are covered.
    diffuse, gloss : (LAMPS, n) array
        What each lamp makes of them, without the albedo.
    open : (n,) array
        The share of all lamps' light that no part of the head hides.
    """

    covered: NDArray[np.bool_]
    albedo: Floats
    diffuse: Floats
    gloss: Floats
    open: Floats

    def photo(
        self, light: NDArray[np.float64], gain: float, random: np.random.Generator | None = None
    ) -> NDArray[np.uint8]:
        """Return what a camera makes of a light.

        Parameters
        ----------
        light : (LAMPS,) array
            How strong each lamp is.
        gain : float
            What radiance is multiplied with.
        random : numpy.random.Generator, optional
            Of the grain; without it, there is none.

        Returns
        -------
        (H, W, 3) uint8 array
            sRGB.
        """
        strengths = light.astype(np.float32)
        direct: Floats = (strengths @ self.diffuse)[:, None]
        bounced = direct.mean() * (1 - self.open)[:, None] * self.albedo.mean(axis=0)
        image = np.zeros((*self.covered.shape, 3), np.float32)
        image[self.covered] = self.albedo * (direct + bounced) + (strengths @ self.gloss)[:, None]
        soft = np.stack([gaussian_filter(image[..., k], px) for k, px in enumerate(_UNDER_SKIN)], axis=-1)
        image = np.where(self.covered[..., None], gain * soft, np.float32(_WALL))
        image = gaussian_filter(image, (_LENS, _LENS, 0))
        if random is not None:
            image += np.asarray(random.normal(0, _GRAIN, image.shape), np.float32)
        return np.asarray(np.rint(255 * encode_srgb(image.clip(0, 1))), np.uint8)

    def gain(self, light: NDArray[np.float64], bright: float) -> float:
        """Return the gain that makes most of the head darker than `bright`."""
        return bright / float(np.quantile(self.albedo[:, 1] * (light @ self.diffuse), 0.95))


def shoot(person: Person, side: int, iod: float, random: np.random.Generator) -> Shot:
    """Take a head into view, looking anywhere near the camera, and find what each lamp makes of it.

    Parameters
    ----------
    person : Person
    side : int
        Of the photo, in px.
    iod : float
        Interocular distance of a head that looks at the camera, in px.
    random : numpy.random.Generator

    Returns
    -------
    Shot
    """
    angles = random.normal(0, _ANGLES).clip(-_MOST_ANGLE, _MOST_ANGLE)
    turn = Rotation.from_euler("yxz", angles, degrees=True).as_matrix()
    vertices = (person.vertices - _MIDDLE) @ turn.T + _MIDDLE
    scene = EmbreeScene()
    TriangleMesh(scene, vertices[person.triangles].astype(np.float32))
    camera, ways = _camera(side, iod, random.uniform(*_FAR))
    hit = scene.run(np.tile(camera, (len(ways), 1)), ways, query="INTERSECT", output=True)
    covered = hit["primID"] >= 0
    corners, u, v = person.triangles[hit["primID"][covered]], hit["u"][covered], hit["v"][covered]
    share = np.stack([1 - u - v, u, v])

    def seen(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(np.einsum("kn,nk...->n...", share, values[corners]))

    normals, view = _unit(seen(person.normals @ turn.T)), -ways[covered]
    albedo = person.skin.albedo(seen(person.place), seen(person.lip), seen(person.eye), seen(person.hair))
    starts = seen(vertices) + _AHEAD * (normals + 2 * view)
    diffuse, gloss = (np.zeros((LAMPS, len(starts)), np.float32) for _ in range(2))
    shine, rough = random.uniform(*_SHINE), random.uniform(*_ROUGH)
    directions = lamps()
    for k, direction in enumerate(directions):
        cosine = normals @ direction
        lit = np.flatnonzero(cosine > 0)
        diffuse[k, lit] = cosine[lit] * _free(scene, starts[lit], direction, random)
        along = (normals[lit] * _unit(direction + view[lit])).sum(axis=1).clip(0)
        gloss[k, lit] = shine * (rough + 2) / 8 * along**rough * diffuse[k, lit]
    reach = np.maximum((normals @ directions.T).clip(0).sum(axis=1), 1e-6)
    return Shot(
        covered=covered.reshape(side, side),
        albedo=albedo.astype(np.float32),
        diffuse=diffuse,
        gloss=gloss,
        open=np.asarray(diffuse.sum(axis=0) / reach, np.float32),
    )


def _camera(side: int, iod: float, far: float) -> tuple[Floats, Floats]:
    """Return where a camera is, and the ways of its pixels' rays."""
    y, x = np.mgrid[:side, :side]
    aims = np.stack([(x - side / 2) / iod, (y - 0.45 * side) / iod, np.zeros((side, side))], axis=-1)
    camera = np.array([0, _MIDDLE[1], -far])
    return camera.astype(np.float32), _unit(aims.reshape(-1, 3) - camera).astype(np.float32)


def _free(
    scene: EmbreeScene,
    starts: NDArray[np.float64],
    direction: NDArray[np.float64],
    random: np.random.Generator,
) -> Floats:
    """Return the share of a lamp that is seen from each place."""
    seen = np.zeros(len(starts), np.float32)
    for _ in range(_SHADOW_RAYS):
        to = _unit(direction + random.normal(0, _SPREAD, starts.shape)).astype(np.float32)
        # 0 is the number of the mesh that is in the way.
        seen += scene.run(starts.astype(np.float32), to, query="OCCLUDED") != 0
    return seen / np.float32(_SHADOW_RAYS)


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9))
