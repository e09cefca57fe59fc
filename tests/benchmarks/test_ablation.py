"""The ablation's program: what it keeps, what it takes up again, and its page."""

import pytest

from benchmarks.ablation import Ledger, key_of, rows_of
from benchmarks.ablation_page import Rows, arms, bars

STEPS = [(0, 10), (20, 30), (40, 50)]
FIGURES = ("residual_N", "residual_Nm", "marker_rms_m", "hidden_N", "hidden_Nm", "knee_Nm")


def run_with(*, ours, oracle, markers_only=10.0, notes=()):
    """A run in which all of an arm's figures are the same."""
    values = {"ours": ours, "oracle": oracle, "markers only": markers_only}
    return {"arms": {arm: dict.fromkeys(FIGURES, v) for arm, v in values.items()}, "notes": list(notes)}


@pytest.fixture
def ledger(tmp_path):
    return Ledger(tmp_path / "kept.json", "inputs", {}, {})


def test_a_choice_is_known_by_its_steps_in_any_order():
    assert key_of([STEPS[2], STEPS[0]], STEPS) == key_of([STEPS[0], STEPS[2]], STEPS) == "0 2"


def test_conditions_with_the_same_choices_stand_in_one_row(ledger):
    ones = [[step] for step in STEPS]
    choices = {"10%": ones, "20%": ones[::-1], "60%": [STEPS[:2]], "90%": [STEPS]}
    for key in ("0", "1", "0 1"):
        ledger.add(key, run_with(ours=2.0, oracle=1.0))
    first, second = rows_of(choices, STEPS, ledger)  # nothing was made for 90 %
    assert (first.names, first.hidden, first.wanted, len(first.runs)) == (("10%", "20%"), 1, 3, 2)
    assert (second.names, second.hidden) == (("60%",), 2)


def test_the_bars_are_ratios_run_by_run():
    good, bad = run_with(ours=3.0, oracle=3.0), run_with(ours=2.4, oracle=2.0, notes=["did not settle"])
    (_, _, line) = bars([Rows(("30% of the steps",), 1, 3, [good, bad])], 6).splitlines()
    label, steps, made, seen, worst, above, *_, unsettled = (c.strip() for c in line.strip("|").split("|"))
    assert (label, steps, made) == ("30%", "1 of 6", "2 of 3")
    assert (seen, worst, above, unsettled) == ("1.10 ± 0.14", "1.20", "1", "1")


def test_every_arm_has_a_line_and_what_cannot_be_judged_a_dash():
    run = run_with(ours=2.0, oracle=1.0)
    run["arms"]["ours"]["hidden_N"] = None
    lines = arms([Rows(("30%",), 1, 1, [run])]).splitlines()[2:]
    assert [line.split("|")[2].strip() for line in lines] == ["ours", "oracle", "markers only"]
    assert lines[0].split("|")[6].strip() == "–"
