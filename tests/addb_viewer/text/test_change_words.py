"""What the fit to forces changed, in words."""

import re
from dataclasses import replace

import pytest

from addb_viewer.app.shell.fit_tab import change_html
from addb_viewer.report.motion_part import changed_part
from addb_viewer.text.change_words import (
    band_in_words,
    change_key_findings,
    change_rows,
    change_sentence,
    signed,
)
from solver.fitting.fit_summary import ChangeFigures, CoordinateFigures, GainFigures
from tests.addb_viewer.fit_figures import of_trial


def gain(value, low=4.0, high=6.0):
    return GainFigures((low, high), value, -3.2, 1.5)


def coordinate(name, rms, unit="deg", root=False, gains=(None,) * 5):
    bands = tuple(share * rms for share in (0.5, 0.4, 0.3, 0.2, 0.1))
    return CoordinateFigures(name, unit, root, rms, -0.6 * rms, bands, gains, 57.0, 60.0, 420.0, 400.0)


@pytest.fixture
def change():
    """Of a walk."""
    return ChangeFigures(
        limit_hz=6.0,
        bands_hz=((0.0, 2.0), (2.0, 4.0), (4.0, 6.0), (6.0, 10.0), (10.0, None)),
        joints_rms_deg=0.82,
        joints_offset_deg=0.31,
        joints_gain=gain(0.934),
        coordinates=(
            coordinate("pelvis_tilt", 5.0, root=True),
            coordinate("pelvis_tx", 7.2, unit="mm", root=True),
            coordinate("hip_rotation_r", 2.14),
            coordinate("knee_angle_l", 0.3, gains=(None, None, gain(0.88), None, None)),
            coordinate("lumbar_extension", 1.06),
            coordinate("wrist_flex_l", 0.01),
        ),
    )


def test_one_line_tells_how_much_where_and_what_remains(change):
    assert change_sentence(change) == (
        "The fit to forces moved the joints by 0.8° RMS (0.3° of it constant); most: right hip rotation "
        "2.1°, lumbar extension 1.1°; 93 % of their movement at 4–6 Hz is left"
    )
    assert change_key_findings(change) == "0.8° RMS; gain 0.93 at 4–6 Hz"


def test_without_content_in_the_band_nothing_is_said_of_it(change):
    assert change_sentence(replace(change, joints_gain=None)).endswith("lumbar extension 1.1°")


def test_without_a_fit_to_forces_there_is_nothing_to_tell(change):
    for nothing in (None, replace(change, joints_rms_deg=None)):
        assert change_sentence(nothing) == change_key_findings(nothing) == ""
    assert "markers alone" in change_html(None)
    assert changed_part([of_trial()]) == ""


def test_rows_have_units_and_what_range_and_peak_lost(change):
    rows = {row.coordinate: row for row in change_rows(change)}
    assert "left wrist flex" not in rows  # moved by nothing that could be seen
    assert rows["left knee angle"].gains == ("", "", "0.88, -3°", "", "")
    assert rows["right hip rotation"].range == "57° (-5 %)"
    assert rows["right hip rotation"].peak_speed == "420°/s (+5 %)"
    assert (rows["pelvis position x"].rms, rows["pelvis position x"].offset) == ("7 mm", "-4 mm")
    assert (signed(-0.04, 1), signed(0.3), signed(-3.2), signed(2.5, 1)) == ("0.0", "0", "-3", "+2.5")
    assert band_in_words((10.0, None)) == "above 10 Hz"


def test_the_app_shows_the_largest_first_with_the_gain_below_the_limit(change):
    page = change_html(change)
    order = [
        page.index(f">{name}<")
        for name in ("pelvis tilt", "right hip rotation", "left knee angle", "pelvis position x")
    ]
    assert order == sorted(order)
    assert "gain at 4–6 Hz" in page
    assert re.search(r"left knee angle</td>(<td[^>]*>[^<]*</td>){2}<td[^>]*>0\.88<", page)


def test_names_from_files_are_text(change):
    spiteful = replace(change, coordinates=(coordinate("<script>", 3.0),))
    assert "<script>" not in change_html(spiteful)
    assert "<script>" not in changed_part([of_trial(name="<script>", change=spiteful)])
