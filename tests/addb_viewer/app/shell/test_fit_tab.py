from dataclasses import replace

from addb_viewer.app.scene.camera import VIEWS
from addb_viewer.app.scene.legend import legend_html
from addb_viewer.app.shell.commands import COMMANDS
from addb_viewer.app.shell.fit_tab import notes_html, summary_html
from addb_viewer.app.subjects.library import Library
from solver.common.notes import Kind, noted
from solver.fitting.fit_summary import ChangeFigures, GainFigures
from tests.addb_viewer.fit_figures import of_layouts, of_trial

SPITEFUL = "<script>alert(1)</script>"


def test_the_summary_shows_figures_with_units_and_verdicts(small_fit, make_replay):
    library = Library(small_fit.subject, small_fit)
    text = summary_html(library.figures("walk"), {"mass_kg": 100.0, "height_m": 2.0}, make_replay())
    for part in (
        "100.0 kg",
        "2.00 m",
        "1.50 cm\u00a0✓",
        "2.10 cm\u00a0✓",
        "7.5 N = 0.0077 BW\u00a0✓",
        "N·m",
        "BW·h",
        "3 (force known)",
    ):
        assert part in text, part


def test_held_out_forces_stand_beside_markers_and_a_worse_fit_is_said_to_be(make_replay):
    text = summary_html(of_trial(held_out_layouts=of_layouts(1.5, (1.2, 1.9))), {}, make_replay())
    assert "30.0 N ✗ (markers 20.0 at 4 to 6 Hz)" in text
    assert "9.0 N·m ✓ (markers 10.0 at 6 Hz)" in text
    assert "90 % interval over blocks 1.20 to 1.90: beyond chance" in text


def test_what_the_fit_to_forces_changed_stands_beside_the_residuals(small_fit, make_replay):
    gain = GainFigures((4.0, 6.0), 0.934, 0.0, 1.5)
    figures = Library(small_fit.subject, small_fit).figures("walk")
    changed = replace(figures, change=ChangeFigures(6.0, (), 0.82, 0.3, gain, ()))
    text = summary_html(changed, {}, make_replay())
    assert "0.8° RMS by forces" in text
    assert "Gain, 4–6 Hz" in text
    assert "0.93 of the markers" in text
    assert "by forces" not in summary_html(figures, {}, make_replay())


def test_a_trial_without_dynamics_has_no_residual_rows(small_fit, make_replay):
    text = summary_html(Library(small_fit.subject, small_fit).figures("no/forces"), {}, make_replay())
    assert "Residual" not in text
    assert "Marker error, RMS" in text


def test_without_a_fit_it_says_so(make_replay):
    assert "Not fitted yet" in summary_html(None, {}, make_replay(fitted=False))


def test_texts_from_files_are_escaped(make_replay):
    assert "<script>" not in notes_html(noted(Kind.OTHER, SPITEFUL))
    replay = make_replay()
    object.__setattr__(replay, "feet", (SPITEFUL,))
    assert "<script>" not in legend_html(replay)


def test_the_legend_names_what_is_there(make_replay):
    assert "right foot" in legend_html(make_replay())
    assert "marker error" not in legend_html(make_replay(fitted=False))
    assert "foot" not in legend_html(make_replay(plates=0))


def test_every_view_has_a_command():
    assert {f"view_{name.lower()}" for name in VIEWS} <= {command.action for command in COMMANDS}


def test_notes_are_folded_by_kind_and_open_where_somebody_has_to_decide():
    good_to_know = noted(Kind.PLATES, "walk: plate 1 was not tared")
    to_look_at = noted(Kind.FORCES_AGAINST_BODY, "run: plates read -4.7 % against the body's mass")
    page = notes_html((*good_to_know, *to_look_at))
    first, second = page.split("</details>")[:2]
    assert first.index("To look at") < first.index("<details open") < first.index("Forces against the body")
    assert (
        second.index("Good to know") < second.index("<details style") < second.index("Axes, units and plates")
    )
