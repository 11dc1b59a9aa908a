"""Packed Bernstein forms against plain exact arithmetic."""

import random
from fractions import Fraction
from math import comb

import pytest
from flint import fmpq

from workbench.verify.family.form import Form
from workbench.verify.family.lanes import LANE, VALUE, lanes
from workbench.verify.family.search import search
from workbench.verify.family.share import shares, volume


def value_of(form: Form, point) -> Fraction:
    """The polynomial of a form at a point of the unit box, by the definition of the Bernstein basis."""
    place = form.layout
    total = Fraction(0)
    for flat_outer, element in enumerate(form.elements):
        for lane in range(place.lanes.count):
            index = [0] * len(place.degrees)
            rest = flat_outer
            for axis, size in reversed(list(zip(place.listed, place.sizes, strict=True))):
                index[axis], rest = rest % size, rest // size
            rest = lane
            for axis, size in reversed(list(zip(place.packed, place.lanes.shape, strict=True))):
                index[axis], rest = rest % size, rest // size
            weight = Fraction(1)
            for k, d, t in zip(index, place.degrees, point, strict=True):
                weight *= comb(d, k) * t**k * (1 - t) ** (d - k)
            total += weight * place.lanes.entry(element, lane)
    return total


def random_form(degrees, seed) -> Form:
    generator = random.Random(seed)
    count = 1
    for d in degrees:
        count *= d + 1
    return Form.of(
        degrees, [fmpq(generator.randint(-(10**9), 10**9), generator.randint(1, 10**6)) for _ in range(count)]
    )


@pytest.mark.parametrize("degrees", [(1, 2, 3), (3, 9, 2), (2, 0, 1, 4), (5,)])
def test_a_half_is_the_same_polynomial_on_half_the_axis(degrees):
    form = random_form(degrees, 1)
    generator = random.Random(2)
    for axis in range(len(degrees)):
        for side, half in enumerate(form.halves(axis)):
            point = [Fraction(generator.randint(0, 64), 64) for _ in degrees]
            whole = [(t + side) / 2 if a == axis else t for a, t in enumerate(point)]
            # the declared bound: a mean rounds by at most half a unit in each of the degree's steps
            assert abs(value_of(half, point) - value_of(form, whole)) <= half.error - form.error
            assert half.error <= form.error + degrees[axis]


def test_packing_keeps_every_signed_number():
    place, generator = lanes((3, 4, 2)), random.Random(3)
    values = [generator.randint(-(2**VALUE) + 1, 2**VALUE - 1) for _ in range(24)]
    packed = place.pack(values)
    assert [place.entry(packed, k) for k in range(24)] == values
    assert [place.entry(place.negated(packed), k) for k in range(24)] == [-v for v in values]


def test_the_slope_is_the_largest_difference_of_neighbours():
    form = random_form((2, 3, 2), 4)
    place = form.layout.lanes
    grid = [[place.entry(e, lane) for lane in range(12)] for e in form.elements]
    largest = max(abs(row[4 * i + j + 1] - row[4 * i + j]) for row in grid for i in range(3) for j in range(3))
    # exact bit length, or one bit less: |difference| - 1 stands for a negative one; a degree of 3 counts one bit
    assert form.slope(1) - 1 in (largest.bit_length() - 1, largest.bit_length())


def test_a_form_is_positive_only_beyond_its_error():
    above = Form.rounded((1, 1), [1, 2, 3, 2**VALUE - 1], error=0)
    assert above.positive()
    assert not Form(above.layout, above.elements, 1).positive()
    assert not above.negative_at_a_corner()
    assert Form.rounded((1, 1), [-5, 2, 3, 4], error=1).negative_at_a_corner()


@pytest.mark.slow
def test_random_polynomials_are_proved_positive_exactly_when_dense_sampling_says_so():
    outcomes = set()
    for seed in range(16):
        form = random_form((2, 3), seed)
        lift = random.Random(seed).choice([0, 1, 2]) * 2 ** (VALUE - 2)
        values = [form.layout.lanes.entry(e, k) + lift for k in range(3) for e in form.elements]
        form = Form.rounded((2, 3), values)
        found = search((form,), lambda f: f[0].positive(), most=400, deadline=float("inf"))
        steps = [Fraction(k, 6) for k in range(7)]
        least = min(value_of(form, (a, b)) for a in steps for b in steps)
        proved = not found.left
        outcomes.add(proved)
        assert proved == (least > 0)
    assert outcomes == {True, False}


def test_open_and_free_cells_fill_the_box():
    pieces = [((1, 2), (0, 0)), ((0, 1), (3, 3)), ((5, 3), (0, 1))]
    cut = shares(pieces, 2)
    assert sum(map(volume, cut.open)) + sum(map(volume, cut.free)) == 1
    # the union by counting the 8 × 8 squares: columns 2, 3 whole, row 3 of columns 0, 1, rows 0 … 3 of column 5
    assert sum(map(volume, cut.open)) == Fraction(2 * 8 + 2 + 4, 64)


def test_a_lane_is_wide_enough_for_a_weighted_sum():
    place = lanes((2,))
    packed = place.pack([2**VALUE - 1, -(2**VALUE) + 1])
    weighted = (1 << 14) * packed + (1 << 14) * place.negated(packed)
    assert weighted < 1 << (2 * LANE)
    assert place.below(weighted, (1 << 15) * (1 << (VALUE + 1))) == 0


def test_the_extremes_of_a_tensor_fit():
    almost = fmpq(2**400 - 1, 2**400)
    form = Form.of((1, 1), [-almost, almost, fmpq(0), -almost])
    assert not form.positive()
    assert form.negative_at_a_corner()
