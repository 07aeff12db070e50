"""The benchmark's own tools: peers that solve the same problem, and honest sums."""

import subprocess
import sys

import numpy as np
import pytest

import relit
from benchmarks import images
from benchmarks.faces import crops, pair
from benchmarks.measure import Timing, exponent, side_by_side
from benchmarks.peers import PyMaxflowDyadic, energy
from benchmarks.transfers import rival
from relit.solver.certificate import certify
from relit.solver.exact import tv_l1


@pytest.mark.parametrize("neighborhood", [4, 8, 16])
@pytest.mark.parametrize("lam", [0.1, 0.8])
def test_pymaxflow_reaches_the_same_energy(neighborhood, lam):
    f = images.portrait()[100:160, 200:250]
    u = tv_l1(f, lam, neighborhood)
    theirs = PyMaxflowDyadic(f, lam, neighborhood)
    optimum = certify(f, u, lam, neighborhood).primal
    assert energy(u, f, lam, neighborhood) == optimum
    for _ in range(2):  # its graph is used again
        assert energy(theirs(), f, lam, neighborhood) == optimum


def test_images_are_what_the_table_says():
    assert images.face().shape == (192, 168)
    assert images.portrait().shape == (512, 512)
    assert images.large_portrait().shape == (1024, 1024)
    for shape in ((192, 168), (512, 256), (1030, 2000)):
        assert images.mosaic(*shape).shape == shape
    assert len(np.unique(images.sixteen_bit(images.portrait()))) > 20_000


def test_power_laws_and_quartiles():
    assert exponent({10: 3.0, 100: 30.0 * 10**0.5, 1000: 3000.0}) == pytest.approx(1.5)
    assert Timing.of([1.0, 2.0, 3.0, 4.0, 100.0]) == Timing(3.0, 2.0, 5)


def test_functions_take_turns():
    calls = []
    timings, results = side_by_side(3, {"a": lambda: calls.append("a"), "b": lambda: calls.append("b") or 7})
    assert calls == ["a", "b"] * 3
    assert results == {"a": None, "b": 7}
    assert timings["a"].runs == 3


def test_crops_differ_and_their_landmarks_are_where_the_face_is():
    first, second = crops("reference", 2, 256)
    assert first.pixels.shape == (256, 256, 3)
    assert (first.pixels != second.pixels).any()
    for face in (first, second, *pair(256)):
        off = relit.detect_landmarks(face.pixels).xy - face.landmarks.xy
        assert np.abs(off).max() < 0.1 * face.landmarks.interocular_distance


@pytest.mark.slow
def test_any_command_runs_beside_ours_on_the_same_pair():
    (row,) = rival(1, f'{sys.executable} -c \'import shutil; shutil.copy("{{target}}", "{{output}}")\'')
    assert row.peer is not None
    assert row.ratio == row.peer.median / row.ours.median


def test_a_rival_that_fails_is_told():
    with pytest.raises(subprocess.CalledProcessError):
        list(rival(1, f"{sys.executable} -c 'raise SystemExit(3)' {{target}} {{output}}"))
