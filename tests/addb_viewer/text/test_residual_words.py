"""What is wrong, in words: against the noise floor, where, in which phase and in which direction."""

from addb_viewer.text.residual_words import what_is_wrong
from tests.addb_viewer.synthetic_residual import residual, size, trial
from tests.addb_viewer.told_diagnosis import told

EFFECT = {"id": "clock_offset", "target": "all"}


def section(found, verdict="explained", effects=(EFFECT,), rates=None):
    figures = {"verdict": verdict, "effects": list(effects), "rates_Hz": rates or {}, "residual": found}
    return what_is_wrong(told(figures))


def rows(found, **others):
    return dict(section(found, **others).rows)


def text(found, **others):
    return " ".join(section(found, **others).lines)


def test_size_and_noise_floor_are_told_and_compared():
    said = text(residual())
    assert "differ from the measured ones by 41 N" in said
    assert "about the centre of mass that differ by 20 N·m" in said
    assert "shows about 10 N and 5.0 N·m" in said
    assert "That is 4.1 times as much force and 4 times as much moment." in said


def test_only_what_exceeds_the_floor_is_called_more():
    more = text(residual(force=11.0, moment=12.0))
    assert "2.4 times as much moment. The largest excess is in the force along y (vertical): 4 times." in more
    ordinary = residual(force=11.0, moment=5.5)
    assert "What shows the fault is its pattern" in text(ordinary)
    clean = section(ordinary, verdict="clean", effects=())
    assert "times that moment: ordinary." in " ".join(clean.lines)
    assert clean.rows == ()


def test_the_worst_half_second_of_each_trial_the_worst_first():
    told = residual(
        trial("run", (10, 60), force=15.0, moment=5.0),
        trial("walk", (138, 188), force=687.0, moment=32.0),
        trial("hop", (0, 50), force=25.0, moment=30.0),
    )
    said = rows(told, rates={"run": 100.0, "walk": 100.0, "hop": 50.0})["worst half second"]
    assert said == (
        "walk, 1.38 to 1.87 s: 687 N (69 ×), 32 N·m (6.4 ×); hop, 0.00 to 0.98 s: 25 N (2.5 ×), "
        "30 N·m (6 ×); run: no half second beyond twice the ordinary"
    )


def test_many_trials_are_not_all_listed():
    told = residual(*(trial(f"t{k}", (0, 50)) for k in range(8)))
    said = rows(told, rates={f"t{k}": 100.0 for k in range(8)})["over time"]
    assert said.startswith("t0: much the same all the time; t1")
    assert said.endswith("; less in 3 more")


def test_phases_in_order_of_excess_without_those_that_hardly_occur():
    told = residual(
        phases=[
            ("double_support", None, size(9.0, 4.0)),
            ("single_support", "calcn_r", size(45.0, 4.0)),
            ("no_load", None, size(900.0, 4.0, seconds=0.03)),
        ]
    )
    assert rows(told)["in which phase"] == (
        "only the right foot on a plate: 45 N (4.5 ×), 4.0 N·m; both feet on plates: 9.0 N, 4.0 N·m"
    )


def test_directions_in_order_of_size_and_the_mean_where_it_is_more_than_noise():
    said = rows(residual())["in which direction"]
    assert said == "vertical (y) 40 N (4 ×), forward (x) 8.0 N, sideways (z) 3.0 N; " + (
        "on average the plates measured 30 N less upward than the weight and motion of the modelled body "
        "require"
    )
    more = rows(residual(mean_force_N=(1.0, -44.0, 2.0)))["in which direction"]
    assert more.endswith(
        "the plates measured 44 N more upward than the weight and motion of the modelled body require"
    )
    level = rows(residual(mean_force_N=(44.0, 1.0, 2.0)))["in which direction"]
    assert level.endswith("the plates measured 44 N more along −x than the modelled body's motion requires")
    assert rows(residual())["turning"] == "about z 15 N·m (3 ×)"
    assert "on average" not in rows(residual(mean_force_N=(1.0, 2.0, 3.0)))["in which direction"]


def test_markers_alone_are_not_blamed_on_forces():
    assert "with slipped or swapped markers corrected" in text(residual(), effects=({"id": "marker_slip"},))


def test_an_answer_of_an_older_version_has_no_description():
    assert section(None) == type(section(None))("What is wrong")
    assert "Looked for" in text(None, verdict="clean", effects=())
