"""Surfaces as they are drawn: what holds them, and their shape under a contact."""

from __future__ import annotations

import numpy as np
import pytest

import palpate as pp


def test_a_beam_bends_as_beam_theory_says(beam):
    shape = beam.shape("200 mm", force="3 N", points=3)
    inertia = 0.04 * 0.0012**3 / 12
    assert shape[:, 0].tolist() == [0, 0.2, 0.4]
    assert shape[1, 1] == pytest.approx(-3 * 0.4**3 / (48 * 200e9 * inertia), rel=1e-12)
    assert np.array_equal(beam.with_force("3 N").shape(0.2, points=3), shape)


def test_a_digit_keeps_its_length():
    digit = pp.Setup(pp.Digit("100 mm", "10 mm", "0.5 mm", "200 GPa"), pp.strain(3, noise="1 ue"))
    shape = digit.shape("70 mm", force="1 N", points=2001)
    assert shape[-1, 1] < -1e-3
    assert np.hypot(*np.diff(shape, axis=0).T).sum() == pytest.approx(0.1, rel=1e-6)


def test_supports_say_what_they_are(beam, plate):
    assert beam.support_kinds == ["simple", "simple"] and beam.edges is None
    supports = [pp.Support("0 mm", "clamped"), pp.Support("300 mm", "elastic", stiffness="2 kN/m")]
    held = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa", supports=supports), pp.deflection(4))
    assert (held.supports.tolist(), held.support_kinds) == ([0, 0.3], ["clamped", "elastic"])
    assert plate.edges == {"left": "simple", "right": "simple", "bottom": "simple", "top": "simple"}
    edges, posts = {"left": "clamped", "right": "simple"}, [pp.Support(("150 mm", "100 mm"), "simple")]
    plate = pp.Setup(
        pp.Plate("300 mm", "200 mm", "2 mm", "70 GPa", 0.33, edges=edges, supports=posts, elements=16), pp.deflection((2, 2))
    )
    assert plate.edges == {"left": "clamped", "right": "simple", "bottom": "free", "top": "free"}
    assert plate.support_kinds == ["simple"]


def test_shapes_that_there_are_not(beam, plate):
    with pytest.raises(pp.PalpateError, match="a plane has no bent line"):
        plate.shape("10 mm")
    with pytest.raises(pp.PalpateError, match="`force` is needed"):
        beam.shape("10 mm")
    with pytest.raises(pp.PalpateError, match=r"500 mm.*400 mm"):
        beam.shape("500 mm", force=1)
    with pytest.raises(pp.PalpateError, match="`points` is 1; it must be at least 2"):
        beam.shape("100 mm", force=1, points=1)
    with pytest.raises(pp.PalpateError, match="no model"):
        pp.Setup(pp.Measured("1 m"), pp.raw(2)).shape(0.5, force=1)
