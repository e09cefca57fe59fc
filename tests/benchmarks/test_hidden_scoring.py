import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.hidden.format import CAUSES, NONE, SOMETHING_ELSE, Answer, SubmissionError, read_submission
from benchmarks.hidden.scorer import calibration_error, figures, judge, read_truths
from solver.simulate.faults.cases import IDS

ROOT = Path(__file__).parents[2]
FORMAT = ROOT / "benchmarks" / "hidden" / "FORMAT.md"
FRAMES = 4


def truth(case="case_0000", group="inside", accepted=("clock_offset",), parameters=None):
    still = [[0.0, 0.0, 0.0]] * FRAMES
    return {
        "case": case,
        "group": group,
        "accepted": list(accepted),
        "effects": [{"id": accepted[0], "size": 1.0, "parameters": parameters or {}}]
        if group == "inside"
        else [],
        "held_out": {
            "walk": {
                "first_frame": 16,
                "frames": FRAMES,
                "scored": [0, 1, 2],
                "about_m": [[0.0, 1.0, 0.0]] * FRAMES,
                "force_N": [[0.0, 700.0, 0.0]] * FRAMES,
                "moment_Nm": still,
            }
        },
    }


def judged_as(probabilities, **about):
    return judge(truth(**about), Answer(probabilities))


def test_every_name_of_the_public_list_can_be_hidden():
    assert set(CAUSES) - {NONE, SOMETHING_ELSE} <= set(IDS)


@pytest.mark.parametrize(
    ("said", "outcome"),
    [
        ("clock_offset", "right"),
        ("filter_mismatch", "family"),
        ("plate_gain", "wrong"),
        (SOMETHING_ELSE, "something else"),
        (NONE, "none"),
    ],
)
def test_what_an_answer_is_worth(said, outcome):
    judged = judged_as({said: 0.98, "drag": 0.02})
    assert judged.outcome == outcome
    assert judged.very_sure_and_wrong == (outcome in ("family", "wrong"))
    assert judged.very_sure_of_nothing_and_wrong == (outcome == "none")
    assert not judged_as({said: 0.96, "drag": 0.04}).very_sure_and_wrong


def test_what_is_likelier_wrong_than_right_is_no_name():
    hint, name, sure = (
        judged_as({"drag": p, NONE: 0.09, "plate_gain": 0.91 - p}, group=group, accepted=(accepted,))
        for p, group, accepted in (
            (0.48, "clean", NONE),
            (0.52, "clean", NONE),
            (0.91, "outside", SOMETHING_ELSE),
        )
    )
    rows = dict(figures([hint, name, sure]))
    assert rows["clean: any alarm"].endswith("(2/2)")
    assert rows["clean: a cause named with 50 % and more"].endswith("(1/2)")
    assert rows["outside the list: a wrong cause with 90 % and more"].endswith("(1/1)")


def test_how_often_a_sure_name_is_right():
    judged = [
        judged_as({said: p, NONE: 1 - p})
        for said, p in (("clock_offset", 0.9), ("drag", 0.95), ("drag", 0.8))
    ]
    assert dict(figures(judged))["inside the list: right, of names with 90 % and more"].endswith("(1/2)")


def test_an_effect_of_thirty_sizes_may_be_called_by_its_name_or_not_on_the_list():
    accepted = ("clock_offset", SOMETHING_ELSE)
    judged = judged_as(
        {"clock_offset": 0.5, SOMETHING_ELSE: 0.3, NONE: 0.2}, group="outside", accepted=accepted
    )
    assert judged.right
    assert judged.accepted == pytest.approx(0.8)
    assert judged.brier == pytest.approx(0.2**2 + 0.2**2)
    assert judged.log_score == pytest.approx(-np.log(0.8))


def test_calibration_error_by_hand():
    # bin 0.9 to 1.0: two answers at 0.95, one right: gap |1.9 - 1|; bin 0.5 to 0.6: one at 0.55, right: 0.45
    confidence, right = np.array([0.95, 0.95, 0.55]), np.array([1.0, 0.0, 1.0])
    assert calibration_error(confidence, right) == pytest.approx((0.9 + 0.45) / 3)


def test_certain_and_right_is_perfectly_calibrated_and_costs_nothing():
    rows = dict(figures([judged_as({"clock_offset": 1.0})] * 3))
    assert rows["calibration error"] == rows["Brier score"] == rows["log score [nats]"] == "0 [0, 0]"
    assert rows["inside the list: right"] == "100 % [44, 100] (3/3)"  # Wilson: 3 / (3 + 1.96²) = 0.438
    assert rows["clean: any alarm"] == "-"


def test_forces_are_judged_where_they_were_recorded_and_moments_about_the_person():
    # the true force of 700 N acts through (0, 1, 0), so its moment about the origin is nothing
    predicted = np.zeros((FRAMES, 6))
    predicted[:, :3] = (30.0, 740.0, 0.0)
    predicted[3] = 1e6  # not recorded there
    judged = judge(truth(), Answer({NONE: 1.0}, {}, {"walk": predicted}))
    assert judged.force_N == pytest.approx(50.0)
    assert judged.moment_Nm == pytest.approx(30.0)  # 30 N forward pass 1 m below the point
    assert judge(truth(), Answer({NONE: 1.0})).force_N is None


def test_parameters_count_where_the_name_is_right():
    about = {"parameters": {"offset_s": 0.01, "other_s": 1.0}}
    answers = [Answer({"clock_offset": 1.0}, {"offset_s": v}) for v in (0.0109, 0.0112)]
    assert [judge(truth(**about), a).parameters for a in answers] == [(True,), (False,)]
    assert judge(truth(**about), Answer({"drag": 1.0}, {"offset_s": 0.01})).parameters == ()


RIGHT = {"probabilities": {"none": 1.0}}


def walk(**series):
    return RIGHT | {
        "held_out": {"walk": {"force_N": [[0, 1, 2]] * FRAMES, "moment_Nm": [[0, 1, 2]] * FRAMES} | series}
    }


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        ({}, "case_0000: key probabilities is missing"),
        ({"probabilities": {"gremlin": 1.0}}, "case_0000: probabilities.gremlin: no such name"),
        ({"probabilities": {"none": 0.7}}, "case_0000: probabilities sum to 0.7"),
        ({"probabilities": {"none": 1.2, "drag": -0.2}}, "case_0000: probabilities.none is 1.2"),
        ({"probabilities": {"none": "1"}}, "case_0000: probabilities.none is '1'"),
        ({"probabilities": {"none": True}}, "case_0000: probabilities.none is True"),
        ({"probabilities": [1.0]}, "case_0000: probabilities is an object"),
        (RIGHT | {"certainty": 1}, "case_0000: key certainty is unknown"),
        (RIGHT | {"parameters": {"offset_s": None}}, "case_0000: parameters.offset_s is None"),
        (RIGHT | {"held_out": {"run": {}}}, "case_0000: held_out.run: no such trial"),
        (
            RIGHT | {"held_out": {"walk": {"force_N": []}}},
            r"case_0000: held_out.walk.force_N is of shape \(0,\)",
        ),
        (walk(moment_Nm=[[0, 1]] * FRAMES), r"case_0000: held_out.walk.moment_Nm is of shape \(4, 2\)"),
        (
            walk(force_N=[[0, 1, 2]] * 3 + [[0, 1, float("nan")]]),
            "held_out.walk.force_N is not finite in row 3",
        ),
        (walk(force_N=[["a", 1, 2]] * FRAMES), "case_0000: held_out.walk.force_N holds something"),
    ],
)
def test_a_malformed_answer_is_refused_by_case_and_key(tmp_path, answer, message):
    (tmp_path / "s.json").write_text(json.dumps({"cases": {"case_0000": answer}}))
    with pytest.raises(SubmissionError, match=message):
        read_submission(tmp_path / "s.json", {"case_0000": truth()})


def test_missing_and_unknown_cases_are_refused(tmp_path):
    (tmp_path / "case_0000.json").write_text(json.dumps(RIGHT))
    with pytest.raises(SubmissionError, match="case_0001: no answer"):
        read_submission(tmp_path, {"case_0000": truth(), "case_0001": truth("case_0001")})
    with pytest.raises(SubmissionError, match="case_0000: this benchmark has no such case"):
        read_submission(tmp_path, {})
    (tmp_path / "case_0000.json").write_text("{")
    with pytest.raises(SubmissionError, match=r"case_0000.json: cannot be read"):
        read_submission(tmp_path, {"case_0000": truth()})


def test_the_example_of_the_format_page_is_read(tmp_path):
    (tmp_path / "s.json").write_text(re.search(r"```json\n(.*?)```", FORMAT.read_text(), re.S).group(1))
    first = truth()
    first["held_out"]["walk"]["frames"] = 2
    answers = read_submission(tmp_path / "s.json", {"case_0000": first, "case_0001": truth("case_0001")})
    assert answers["case_0000"].likeliest == "clock_offset"
    assert answers["case_0000"].held_out["walk"][1].tolist() == [11.8, 702.9, -2.7, 0.9, 4.1, 309.8]


def test_the_format_page_lists_every_name():
    listed = re.findall(r"^\| `(\w+)` \| ([\w ]+) \| (.+) \|$", FORMAT.read_text(), re.M)
    assert listed == [(name, c.family, c.sentence) for name, c in CAUSES.items()]


def test_scoring_needs_numpy_only(tmp_path):
    (tmp_path / "truth").mkdir()
    (tmp_path / "truth" / "case_0000.json").write_text(json.dumps(truth()))
    (tmp_path / "s.json").write_text(json.dumps({"cases": {"case_0000": RIGHT}}))
    assert list(read_truths(tmp_path / "truth")) == ["case_0000"]
    program = (
        "import runpy, sys; sys.argv[1:] = ['score', '--truth', 'truth', '--submission', 's.json'];"
        f"sys.path.insert(0, {str(ROOT)!r}); runpy.run_module('benchmarks.hidden', run_name='__main__');"
        "own = {'solver', 'addb_viewer', 'annotations', 'scipy', 'tests', 'pinocchio'};"
        "assert not own & set(sys.modules), own & set(sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "| inside the list: none | 100 % [21, 100] (1/1) |" in done.stdout
