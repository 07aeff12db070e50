"""Certificates prove minimisers, of any image and depth, and nothing else."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from skimage import data

from relit.errors import ImageError, OptionError
from relit.solver.certificate import certify
from relit.solver.exact import solve, tv_l1
from relit.solver.neighborhoods import UNIT

NEIGHBORHOODS = (4, 8, 16)
lams = st.floats(0.05, 5.0)


@pytest.mark.parametrize("neighborhood", NEIGHBORHOODS)
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32, np.float64])
def test_certificate_holds_for_every_dtype_and_fails_when_one_pixel_changes(neighborhood, dtype):
    crop = data.astronaut()[100:130, 200:240, 0]
    f = (
        (crop.astype(dtype) / 255)
        if np.dtype(dtype).kind == "f"
        else crop.astype(dtype) * (257 if dtype == np.uint16 else 1)
    )
    solution = solve(f, 0.4, neighborhood)
    assert solution.u.dtype == dtype
    assert certify(f, solution.u, 0.4, neighborhood, solution.flow).optimal
    changed = solution.u.copy()
    changed[15, 20] = f.max() if changed[15, 20] < f.max() else f.min()
    refuted = certify(f, changed, 0.4, neighborhood, solution.flow)
    assert refuted.feasible
    assert not refuted.optimal
    assert refuted.gap > 0


def test_certificate_refuses_flows_that_are_not_feasible():
    f = data.astronaut()[100:130, 200:240, 0]
    u, flow = (solution := solve(f, 0.4)).u, solution.flow.copy()
    flow[0, 5, 5] = UNIT + 1
    assert not certify(f, u, 0.4, flow=flow).feasible
    flow = solution.flow.copy()
    flow[:, 10, 10] = UNIT
    flow[0, 10, 9] = flow[1, 9, 10] = -UNIT
    assert not certify(f, u, 0.4, flow=flow).feasible
    flow = solution.flow.copy()
    flow[0, 3, -1] = 1  # leaves the image
    assert not certify(f, u, 0.4, flow=flow).feasible


@settings(max_examples=25, deadline=None)
@given(
    f=arrays(
        np.float64, st.tuples(st.integers(1, 7), st.integers(1, 7)), elements=st.floats(-1e3, 1e3, width=32)
    ),
    lam=lams,
    neighborhood=st.sampled_from(NEIGHBORHOODS),
)
def test_certificate_proves_any_float_image(f, lam, neighborhood):
    assert certify(f, tv_l1(f, lam, neighborhood), lam, neighborhood).optimal


def test_certify_refuses_other_shapes():
    with pytest.raises(ImageError, match="u: expected the image's shape"):
        certify(np.zeros((3, 3)), np.zeros((3, 4)), 1)
    with pytest.raises(OptionError, match="flow: expected shape"):
        certify(np.zeros((3, 3)), np.zeros((3, 3)), 1, flow=np.zeros((1, 3, 3), np.int32))


@pytest.mark.parametrize("dtype", [np.int64, np.uint64])
def test_certificates_add_up_beyond_64_bits(dtype):
    f = np.random.default_rng(0).integers(0, 2**50, (40, 40)).astype(dtype)
    certificate = certify(f, tv_l1(f, 0.5), 0.5)
    assert certificate.optimal
    assert certificate.primal == certificate.dual > 2**64
    refuted = certify(f, f, 0.5)
    assert not refuted.optimal
    assert refuted.gap > 0


def test_certificates_do_not_depend_on_the_unit_of_intensity():
    f = data.astronaut()[100:120, 200:220, 0] / 255
    for scale in (1e-20, 1.0, 1e20):
        assert certify(f * scale, tv_l1(f * scale, 0.5), 0.5).optimal
        assert not certify(f * scale, f * scale, 0.5).optimal


def test_a_certificate_can_be_written_down():
    certificate = certify(np.eye(3), np.eye(3), 9)
    assert json.loads(json.dumps(vars(certificate)))["optimal"] is True
