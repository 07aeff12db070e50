"""Faces without their light, in scikit-learn's pipelines."""

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.decomposition import PCA
from sklearn.model_selection import GridSearchCV
from sklearn.neighbors import KNeighborsClassifier
from sklearn.pipeline import make_pipeline
from sklearn.utils import estimator_checks, get_tags

from relit import LightNormalizer, detect_landmarks, normalize, read_image, sample
from relit.errors import FaceNotFoundError, ImageError, LandmarkError, OptionError
from relit.photo.color import luma
from relit.photo.pixels import to_unit

SHAPE = (24, 20)


@pytest.fixture(scope="module")
def photos():
    return [read_image(sample(name)).pixels for name in ("target", "reference")]


@pytest.fixture(scope="module")
def rows():
    """Eight smooth faces of two people, as rows of numbers in [0, 1]."""
    rng = np.random.default_rng(3)
    people = rng.uniform(0.3, 0.6, (2, *SHAPE))
    lights = np.linspace(0.2, 1, SHAPE[1])[None, :] ** np.linspace(0, 2, 4)[:, None, None]
    return (people[:, None] * lights).reshape(8, -1), np.repeat([0, 1], 4)


@pytest.mark.slow
def test_it_does_what_normalize_does(photos):
    made = LightNormalizer(lam=0.4, neighborhood=8).fit_transform(photos)
    for one, photo in zip(made, photos, strict=True):
        distance = detect_landmarks(photo).interocular_distance
        np.testing.assert_array_equal(
            one, normalize(photo, 0.4, neighborhood=8, interocular_distance=distance)
        )


def test_images_of_one_size_become_one_array_and_paths_are_taken(photos):
    crops = np.stack([photo[:120, :100] for photo in photos])
    made = LightNormalizer(eye_distance=30).transform(crops)
    assert (made.shape, made.dtype) == ((2, 120, 100), np.float32)
    listed = LightNormalizer(eye_distance=30).transform([crops[0], crops[1][:50]])
    np.testing.assert_array_equal(listed[0], made[0])
    assert listed[1].shape == (50, 100)
    (read,) = LightNormalizer(eye_distance=30).transform([sample("grey_target")])
    known = normalize(sample("grey_target"), interocular_distance=30)
    np.testing.assert_array_equal(read, known)
    assert LightNormalizer().transform([]) == []


def test_landmarks_stand_in_for_the_faces(photos):
    crop = photos[0][:120, :100]
    points = [[30, 40], [60, 40], [45, 60], [35, 80], [55, 80]]
    (made,) = LightNormalizer().transform([crop], landmarks=[points])
    from relit import Landmarks

    distance = Landmarks(points).interocular_distance
    np.testing.assert_array_equal(made, normalize(crop, interocular_distance=distance))
    with pytest.raises(LandmarkError, match="expected one entry for each of 1 images, got 2"):
        LightNormalizer().transform([crop], landmarks=[points, points])


def test_an_image_without_a_face_ends_the_work_or_stays():
    empty = np.tile(np.arange(200, dtype=np.uint8), (150, 1))
    with pytest.raises(FaceNotFoundError, match="image 1: no face found"):
        LightNormalizer().transform([sample("target"), empty])
    (kept,) = LightNormalizer(no_face="keep").transform([np.dstack([empty] * 3)])
    np.testing.assert_allclose(kept, luma(to_unit(np.dstack([empty] * 3))), atol=1e-6)


def test_rows_go_through_a_pipeline(rows):
    X, y = rows
    shape = {"eye_distance": 20, "image_shape": SHAPE}
    made = LightNormalizer(**shape).fit_transform(X)
    known = [normalize(row.reshape(SHAPE), interocular_distance=20).ravel() for row in X]
    np.testing.assert_array_equal(made, known)
    model = make_pipeline(LightNormalizer(**shape), PCA(3), KNeighborsClassifier(1))
    assert model.fit(X, y).score(X, y) == 1
    search = GridSearchCV(model, {"lightnormalizer__lam": [0.2, 0.8]}, cv=2).fit(X, y)
    assert search.best_params_["lightnormalizer__lam"] in (0.2, 0.8)
    names = make_pipeline(LightNormalizer(**shape)).fit(X).get_feature_names_out()
    assert list(names[:2]) == ["pixel0", "pixel1"]
    assert len(names) == X.shape[1]


def test_a_clone_has_the_parameters():
    ours = LightNormalizer(lam=0.7, no_face="keep")
    theirs = clone(ours)
    assert theirs is not ours
    assert theirs.get_params() == ours.get_params()
    assert repr(theirs) == repr(ours)
    assert clone(ours).set_params(lam=0.1).lam == 0.1
    assert get_tags(ours).transformer_tags.preserves_dtype == ["float32"]


@pytest.mark.parametrize(
    "check",
    [
        "check_estimator_cloneable",
        "check_estimator_repr",
        "check_estimator_tags_renamed",
        "check_get_params_invariance",
        "check_mixin_order",
        "check_no_attributes_set_in_init",
        "check_parameters_default_constructible",
        "check_set_params",
        "check_valid_tag_types",
    ],
)
def test_scikit_learn_finds_nothing_wrong(check):
    getattr(estimator_checks, check)("LightNormalizer", LightNormalizer())


@pytest.mark.parametrize(
    "check",
    [
        "check_dict_unchanged",
        "check_fit2d_1sample",
        "check_fit_idempotent",
        "check_methods_sample_order_invariance",
        "check_methods_subset_invariance",
        "check_n_features_in",
        "check_pipeline_consistency",
        "check_readonly_memmap_input",
        "check_transformers_unfitted_stateless",
    ],
)
def test_scikit_learn_finds_nothing_wrong_with_rows(check, monkeypatch):
    # Its data have any number of columns, and no bounds: shape and range are made to fit.
    class OfAnyLength(LightNormalizer):
        def _rows(self, X):
            rows = np.asarray(X, float)
            self.image_shape = (1, rows.shape[1])
            return 1 / (1 + np.exp(-rows))

    monkeypatch.setattr("relit.photo.pixels.SMALLEST_SIDE", 1)
    ours = OfAnyLength(eye_distance=10, image_shape=(1, 1))
    getattr(estimator_checks, check)("LightNormalizer", ours)


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"lam": -1}, "lam: expected a finite number above 0"),
        ({"neighborhood": 5}, "neighborhood: expected one of 4, 8, 16, isotropic, got 5"),
        ({"eye_distance": 0}, "eye_distance: expected a finite number of px above 0, or None, got 0"),
        ({"eye_distance": 9, "lam": "auto"}, "lam: 'auto' needs faces"),
        ({"image_shape": 20}, "image_shape: expected height and width in px, or None, got 20"),
        ({"image_shape": (2.5, 3)}, "image_shape: expected height and width"),
        ({"no_face": "skip"}, "no_face: expected 'error' or 'keep', got 'skip'"),
    ],
)
def test_wrong_parameters_are_refused_by_fit(wrong, told):
    with pytest.raises(OptionError, match=f"^{told}"):
        LightNormalizer(**wrong).fit([])


def test_wrong_names_and_lengths_are_refused():
    with pytest.raises(OptionError, match="lamda: no such parameter; expected one of lam, neighborhood"):
        LightNormalizer().set_params(lamda=1)
    with pytest.raises(ImageError, match=r"X: expected rows of 480 numbers, an image of 20x24 px each"):
        LightNormalizer(image_shape=SHAPE).fit(np.zeros((3, 10)))
    with pytest.raises(OptionError, match="pixels have names only in rows"):
        LightNormalizer().get_feature_names_out()
    with pytest.raises(OptionError, match="input_features: expected 480 names, got 1"):
        LightNormalizer(image_shape=SHAPE).get_feature_names_out(["a"])
