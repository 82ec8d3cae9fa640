"""Numbers, names and colours of the report as they are written."""

import numpy as np
import pytest

from tipdamp.hbm.drawing import figure
from tipdamp.report import text


@pytest.mark.parametrize(
    "value, written",
    [
        (0.75226, "0.7523"),
        (79.903, "79.90"),
        (43896, "43896"),
        (0, "0"),
        (-0.0639, "\N{MINUS SIGN}0.06390"),
        (None, "\N{EN DASH}"),
        (2.5e-12, "2.500\N{MULTIPLICATION SIGN}10⁻¹²"),
    ],
)
def test_numbers(value, written):
    assert text.number(value) == written


def test_percent_of_nearly_nothing():
    assert text.percent(-1e-6) == "0.00 %" and text.percent(-0.0123) == "\N{MINUS SIGN}1.23 %"


def test_names_of_pairs():
    names = [
        "the left 3",
        "the left 1",
        "the left 2",
        "right 0/1",
        "the left 9",
        "right 0/0",
        "right 1/1",
    ]
    assert (
        text.names_of_pairs(names)
        == "the left 1\N{EN DASH}3, 9; right (row 1) 0\N{EN DASH}1; right (row 0) 0"
    )


def test_many_pairs_are_counted():
    names = [f"left {k}/{row}" for row in range(2) for k in range(0, 14, 2)] + ["right 3/0"]
    assert text.names_of_pairs(names[:12]).count(", ") == 10
    assert text.names_of_pairs(names) == "left 14 pairs, right 1 pair"
    assert text.names_of_pairs([f"left {k}" for k in range(99)]) == "left 0\N{EN DASH}98"


@pytest.mark.parametrize(
    "value, written", [(-1e-14, "0 N m"), (None, "\N{EN DASH} N m"), (0.05, "0.0500 N m")]
)
def test_rounding_is_nothing(value, written):
    assert text.amount(value, "N m") == written


def test_colors_of_levels_go_from_dark_to_light():
    grey = [
        sum(w * int(c[k : k + 2], 16) for w, k in ((0.299, 1), (0.587, 3), (0.114, 5)))
        for c in figure.level_colors(5)
    ]
    assert grey == sorted(grey) and min(np.diff(grey)) > 20  # of 255: apart in grey print


@pytest.mark.parametrize("size", [3e-13, 2.5e-9, 4e-7, 0.031, 7.0])
@pytest.mark.parametrize(
    "written", [text.number, text.micro, text.distance, text.percent, lambda v: text.amount(v, "N")]
)
def test_a_number_and_its_negative_differ_by_the_sign(written, size):
    """What counts as nothing does so on both sides."""
    minus = written(-size)
    assert minus.removeprefix("\N{MINUS SIGN}") == written(size).removeprefix("+")
    assert minus.startswith("\N{MINUS SIGN}") == any(c in "123456789" for c in written(size))


def test_deviation_from_a_reference():
    assert text.deviation(1590.0, 1590.0) == "0.00 %" and text.deviation(103.0, 100.0) == "+3.00 %"
    assert text.deviation(None, 100.0) == text.deviation(100.0, None) == text.NOTHING
