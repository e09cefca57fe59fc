"""What the panel says, and that nothing from a file becomes part of the page."""

import pytest

from addb_viewer.app.diagnosis.diagnosis_html import gain_html, section_html, verdict_html
from addb_viewer.app.diagnosis.diagnosis_panel import by_key
from addb_viewer.app.jobs.fit_all import Fitting
from addb_viewer.app.jobs.job_queue import Task, TaskProgress
from addb_viewer.app.shell.bar import left_words, work_json
from addb_viewer.text.cause_words import cause
from addb_viewer.text.holding_up_words import what_it_gains
from addb_viewer.text.sections import NO_BREAK, Section

SPITEFUL = "<img src=x onerror='window.hacked=1'>"


@pytest.mark.parametrize(
    ("verdict", "sign", "word"),
    [("clean", "✓", "Clean"), ("explained", "!", "Explained"), ("unexplained", "?", "Unexplained")],
)
def test_a_verdict_is_a_word_and_a_sign_beside_its_colour(effect, figures, verdict, sign, word):
    named = () if verdict == "clean" else (effect("clock_offset", "all", offset_s=0.0123),)
    text = verdict_html(figures(*named, verdict=verdict))
    assert f">{sign}</span>" in text
    assert word in text


def test_without_a_diagnosis_it_says_what_one_would_do():
    assert "No diagnosis yet" in verdict_html(None)


def test_recordings_that_changed_since_are_named(effect, figures):
    text = verdict_html(figures(effect("clock_offset", "all", offset_s=0.01)), ("walk.trc",))
    assert "Out of date" in text
    assert "walk.trc" in text


def test_a_cause_tells_size_with_unit_certainty_and_remedy(effect, figures):
    section = cause(figures(effect("clock_offset", "all", offset_s=0.0123)), 0)
    text = section_html(section, spread=True).replace(NO_BREAK, " ")
    assert "12 ± 2 ms too late" in text
    assert "97 %" in text
    assert "Do something about it." in text
    assert "19 of 20" in text


def test_the_gain_has_before_after_and_interval(effect, figures):
    text = gain_html(what_it_gains(figures(effect("clock_offset", "all", offset_s=0.01))))
    text = text.replace(NO_BREAK, " ")
    assert "41 → 12 N" in text
    assert "between 11 and 14" in text


def test_names_from_files_stay_text(effect, figures):
    named = figures(effect("marker_slip", SPITEFUL, shift_m=0.02))
    shown = (
        verdict_html(named, (SPITEFUL,)),
        section_html(cause(named, 0)),
        section_html(Section("Notes", (SPITEFUL,), ((SPITEFUL, SPITEFUL),))),
        gain_html(Section("", (SPITEFUL,), ((SPITEFUL, SPITEFUL),))),
    )
    for text in shown:
        assert "<img" not in text
        assert "&lt;img" in text


def test_progress_tells_how_long_it_may_still_take():
    task = Task("Diagnosing", "", (), "Zoë")
    (known,) = work_json(TaskProgress(task, "markers", 0.25, 10.0, (task,)), Fitting())
    assert known["text"] == "Diagnosing for Zoë: markers, about 30 s left; then Diagnosing for Zoë."
    assert left_words(TaskProgress(task, "markers", None, 10.0)) == ""


def test_a_step_beside_the_plates_is_flagged_by_key_here(effect, figures):
    found = figures(effect("off_plate_step", "calcn_r", frames=((120, 170),)))
    here, elsewhere = section_html(cause(found, 0, by_key)), str(cause(found, 0))
    assert "select 120–169 (drag over the timeline), choose the foot right (F), press 1." in here
    assert "addb-viewer" not in here
    assert "addb-viewer flag SUBJECT walk 120:170 --foot calcn_r" in elsewhere
