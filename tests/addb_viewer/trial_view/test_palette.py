"""Colours of texts: legible on both pages, by contrasts that are well known."""

import re

import pytest

from addb_viewer.trial_view.palette import BLACK, GREEN, INK, WHITE, Rgb

GREY_117, GREY_118, GREY_119 = (Rgb(k, k, k) for k in (117, 118, 119))  # 118, #767676, is the palest AA grey


def shades(color):
    """On a light and on a dark page."""
    return [Rgb(*map(int, numbers.split(","))) for numbers in re.findall(r"rgb\(([\d, ]+)\)", color.as_text)]


def test_contrasts_are_those_of_wcag():
    assert WHITE.contrast(BLACK) == pytest.approx(21.0)
    assert GREY_118.contrast(WHITE) == WHITE.contrast(GREY_118) == pytest.approx(4.54, abs=0.005)
    assert GREY_119.contrast(WHITE) == pytest.approx(4.48, abs=0.005)
    assert GREEN.ink == BLACK  # 6.1 against 3.4


def test_a_legible_colour_stays_and_another_one_changes():
    assert shades(GREY_117)[0] == GREY_117
    assert shades(GREY_118)[0] == GREY_118
    on_light, on_dark = shades(GREY_119)
    assert on_light.r < 119 < on_dark.r
    assert INK.as_text == "light-dark(#000, #fff)"
