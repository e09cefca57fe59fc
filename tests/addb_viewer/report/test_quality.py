"""Figures against their bounds."""

from dataclasses import replace

import pytest

from addb_viewer.report.quality import (
    bounds_of,
    held_out_table,
    judged_figures,
    quality_table,
    worse_than_markers,
)
from solver.fitting.summary import summary
from tests.addb_viewer.fit_figures import of_layouts


@pytest.fixture
def figures(small_fit):
    return summary(small_fit).trials


def test_figures_of_a_trial_as_the_summary_has_them(figures):
    force, moment, rms, largest = judged_figures(figures[0])
    assert (force.value, force.scaled, force.bound, force.within) == ("7.5 N", "0.0077 BW", "0.05 BW", True)
    assert force.share == pytest.approx(figures[0].force_BW / 0.05)
    assert moment.share == pytest.approx(figures[0].moment_BWh / 0.01)
    assert (rms.value, rms.share) == ("1.50 cm", pytest.approx(0.75))
    assert (largest.value, largest.bound, largest.within) == ("2.10 cm", "4 cm", True)


def test_a_figure_beyond_its_bound_says_so_in_words(figures):
    bad = replace(figures[0], marker_max_m=0.2131, hicks=replace(figures[0].hicks, marker_max=False))
    page = quality_table([bad])
    assert page.count("✗ beyond") == 1
    assert page.count("✓ within") == 3
    assert "533\u00a0% of the bound" in page


def test_what_was_not_computed_is_not_judged(figures):
    force, *_ = judged_figures(figures[1])
    assert (force.within, force.share, force.value) == (None, None, "")
    assert quality_table([figures[1]]).count("not computed") == 2


def test_held_out_forces_stand_beside_markers_and_a_worse_fit_is_said_to_be(figures):
    assert held_out_table(figures) is None
    page = held_out_table([replace(figures[0], held_out_layouts=of_layouts(1.5, (1.2, 1.9)))])
    assert "19 blocks in 6 layouts" in page
    assert "20.0\u00a0N at 4 to 6\u00a0Hz" in page
    worse = worse_than_markers([replace(figures[0], held_out_layouts=of_layouts(1.5, (1.2, 1.9)))])
    assert "force 30.0\u00a0N, markers at 4 to 6\u00a0Hz 20.0\u00a0N, 1.50 times" in worse
    assert "1.20 to 1.90: beyond chance" in worse
    assert "moment" not in worse
    assert "perhaps chance" in worse_than_markers(
        [replace(figures[0], held_out_layouts=of_layouts(1.1, (0.9, 1.3)))]
    )
    assert worse_than_markers([replace(figures[0], held_out_layouts=of_layouts(0.8, (0.7, 1.3)))]) is None


def test_bounds_of_a_person():
    assert bounds_of(100.0, 2.0) == pytest.approx((49.03325, 19.6133))
