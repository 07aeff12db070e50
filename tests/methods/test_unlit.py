"""What stands in for a person in deep shadow, against the person who is there."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from relit.face.shape import face_shape
from relit.methods.lit_face import brightness_of, explain, linear
from relit.methods.unlit import lit, stand_in
from relit.photo.profile import encode_srgb

LEFT, FRONT = np.array([-0.8, 0.0, -0.6]), np.array([0.0, 0.0, -1.0])


class Ball:
    """A ball of some albedo that is the same on both halves, in a light."""

    def __init__(self, ball):
        landmarks, self.normals, self.face = ball
        self.iod = landmarks.interocular_distance
        self.shape = face_shape(landmarks, self.face.shape)
        y, x = np.indices(self.face.shape).astype(float)
        self.twin = np.stack([y, 100.0 - x])
        random = np.random.default_rng(0)
        pattern = gaussian_filter(random.normal(0, 1, self.face.shape), 3)
        pattern[:, 1:] += pattern[:, :0:-1]  # alike about column 50
        self.person = 0.25 * pattern / pattern[self.face].std()
        self.no_features = np.zeros(self.face.shape, bool)

    def explained(self, shade, person=None):
        person = self.person if person is None else person
        planes = encode_srgb((0.4 * shade * np.exp(person)).astype(np.float32))
        weight = self.face.astype(np.float32)
        light = brightness_of(linear(planes, True))
        return light, explain(planes, self.shape, weight, self.iod, encoded=True)


@pytest.fixture
def a_ball(ball):
    return Ball(ball)


def half_black(a_ball):
    """Lit from the left, and black on the right."""
    shade = np.maximum(a_ball.normals @ LEFT, 0) + 0.1
    shade[:, 55:] = 1e-4
    dark = a_ball.face.copy()
    dark[:, :68] = False
    return shade, dark


def test_light_reaches_what_is_lit(a_ball):
    shade, dark = half_black(a_ball)
    reached = lit(a_ball.explained(shade)[1], a_ball.iod)
    assert reached[dark].max() < 0.1
    assert reached[a_ball.face & (shade > 0.6)].min() > 0.6
    # Under a lamp at the camera, what is dark is dark of itself.
    front = np.maximum(a_ball.normals @ FRONT, 0) + 0.1
    person = np.where(np.indices(dark.shape)[1] > 70, -6.0, 0.0)
    assert lit(a_ball.explained(front, person)[1], a_ball.iod)[a_ball.face].min() > 0.9


def relit_person(light, target, missing):
    """What the change that is to be made leaves of the target, beside its shading: the person."""
    return np.log(light) + missing - target.shading(target.lamps)[0]


@pytest.mark.parametrize("source", ["other half", "reference"])
def test_a_black_half_is_filled(a_ball, source):
    shade, dark = half_black(a_ball)
    light, target = a_ball.explained(shade)
    reference = twin = None
    if source == "reference":
        _, reference = a_ball.explained(np.maximum(a_ball.normals @ FRONT, 0) + 0.1)
    else:
        twin = a_ball.twin
    missing, _ = stand_in(
        light, target.own_shading[0], target, reference, a_ball.no_features, twin, a_ball.iod
    )
    bare, _ = stand_in(light, target.own_shading[0], target, None, a_ball.no_features, None, a_ball.iod)
    made, without = (relit_person(light, target, one)[dark] for one in (missing, bare))
    true = a_ball.person[dark]

    def off(person):  # but for a constant: how bright the albedo is
        return np.abs(person - true - np.median(person - true)).mean()

    assert np.corrcoef(made, true)[0, 1] > 0.8
    assert off(made) < 0.5 * np.abs(true - np.median(true)).mean() + 0.05
    assert off(made) < off(without)


def test_where_the_light_reaches_nothing_is_put_in(a_ball):
    light, target = a_ball.explained(np.maximum(a_ball.normals @ FRONT, 0) + 0.3)
    _, other = a_ball.explained(np.maximum(a_ball.normals @ LEFT, 0) + 0.3, -a_ball.person)
    missing, reached = stand_in(
        light, target.own_shading[0], target, other, a_ball.no_features, a_ball.twin, a_ball.iod
    )
    inner = a_ball.face & (np.hypot(*(np.indices(light.shape) - 50)) < 25)
    assert reached[inner].min() > 0.9
    assert np.abs(missing[inner]).mean() < 0.05


def test_nothing_to_stand_in_changes_nothing_where_it_is_lit(a_ball):
    light, target = a_ball.explained(np.maximum(a_ball.normals @ FRONT, 0) + 0.3)
    missing, _ = stand_in(light, target.own_shading[0], target, None, a_ball.no_features, None, a_ball.iod)
    inner = a_ball.face & (np.hypot(*(np.indices(light.shape) - 50)) < 25)
    assert np.abs(missing[inner]).max() < 0.02
