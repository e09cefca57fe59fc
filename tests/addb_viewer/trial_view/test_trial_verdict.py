"""What a trial is good for: by figures, causes and people; what comes next; and the line that says so."""

import pytest

from addb_viewer.text.residual_words import TAKEN_OFF
from addb_viewer.trial_view.trial_verdict import CauseDecisions, cause_against, times_the_limit, trial_verdict
from annotations.events import Edit, FlagRange, Proposal, SetStatus, Status, Unusable
from annotations.folding import folded
from annotations.review_errors import ReviewError
from solver.diagnosis.diagnosis import Remaining
from solver.diagnosis.diagnosis_report import Cause, DiagnosisReport, Figure
from solver.fitting.verdict import Use, Why
from tests.addb_viewer.fit_figures import force, moment, of_trial
from tests.annotations.conftest import FIRST

FEET = ("calcn_r", "calcn_l")
USED = ((0, 100),)
LATE = frozenset({("clock_offset", "all")})


def figures(force_BW=0.02, moment_BWh=0.006, marker_rms_m=0.01, marker_max_m=0.03, **more):
    known = {"marker_max_label": "RASI", "frames_used_ranges": USED} | more
    residuals = {"linear_residual": force(14.0, force_BW), "angular_residual": moment(7.0, moment_BWh)}
    return of_trial(**residuals, marker_rms_m=marker_rms_m, marker_max_m=marker_max_m, **known)


def report(*causes, verdict="explained"):
    return DiagnosisReport(verdict, causes, (), {}, Remaining(30.0, 10.0), ("walk",))


def cause(id="clock_offset", target="all", frames=(("walk", 0, 100),), confidence=0.99, **more):
    return Cause(id, target, {"offset_s": Figure(0.012, 0.0004)}, confidence, frames, **more)


def reviewed(*events):
    return folded("walk", [Edit(k, "walk", "Ada", FIRST, e) for k, e in enumerate(events, start=1)], FEET)


@pytest.mark.parametrize(
    ("known", "use", "why"),
    [
        ({}, Use.TORQUES, ""),
        ({"force_BW": 0.051}, Use.ANGLES, Why.FORCE),
        ({"moment_BWh": 0.051, "force_BW": 0.2}, Use.ANGLES, Why.MOMENT),
        ({"moment_BWh": 0.051, "marker_rms_m": 0.021}, Use.NOTHING, Why.MARKERS),
        ({"marker_max_m": 0.041}, Use.TORQUES, Why.MARKER),
        ({"frames_with_force_used": 0, "mask_source": "none"}, Use.ANGLES, Why.NO_FORCES),
        ({"frames_with_force_used": 0}, Use.ANGLES, Why.NO_FRAMES),
        ({"frames_without_pose_ranges": ((0, 100),)}, Use.NOTHING, Why.NO_POSE),
        ({"marker_rms_m": None, "marker_max_m": None}, Use.NOTHING, Why.NO_POSE),
    ],
)
def test_figures_within_their_limits_are_usable_and_what_is_farthest_beyond_decides(known, use, why):
    verdict = figures(**known).judged()
    assert verdict.use is use
    assert [reason.why for reason in verdict.reasons[:1]] == ([why] if why else [])


def test_frames_are_those_that_count_where_torques_are_usable_and_those_with_a_pose_where_angles_are():
    few = {"frames_with_force_used": 60, "frames_without_pose_ranges": ((90, 100),)}
    assert figures(**few).judged().usable_frames == 60
    assert figures(**few, moment_BWh=0.02).judged().usable_frames == 90
    assert figures(**few, marker_rms_m=0.03).judged().usable_frames == 0


@pytest.mark.parametrize(
    ("found", "use"),
    [
        (cause(), Use.ANGLES),
        (cause("capture_scale", "all"), Use.NOTHING),
        (cause("marker_swap", "LASI+RASI"), Use.TORQUES),  # but near these markers
        (cause(told_as="tentative"), Use.TORQUES),
        (cause(confidence=0.3), Use.TORQUES),
        (cause(confidence=0.3, in_its_class=0.9), Use.ANGLES),  # one of some that leave the same trace
        (cause(sentence=f"It is {TAKEN_OFF}."), None),
    ],
)
def test_a_cause_limits_what_it_spoils(found, use):
    verdict = trial_verdict(figures(), None, report(found)).verdict
    assert verdict.use is (use or Use.TORQUES)
    assert bool(verdict.reasons) is (use is not None)


def test_a_cause_that_the_fit_has_in_its_model_or_that_acts_elsewhere_limits_nothing():
    assert trial_verdict(figures(), None, report(cause()), CauseDecisions(in_fit=LATE)).verdict.within
    assert trial_verdict(figures(), None, report(cause()), CauseDecisions(rejected=LATE)).verdict.within
    assert not trial_verdict(figures(), None, report(cause()), CauseDecisions(accepted=LATE)).verdict.within
    assert trial_verdict(figures(), None, report(cause(frames=(("run", 0, 9),)))).verdict.within


def test_a_step_that_is_left_out_or_flagged_limits_nothing():
    step = cause("off_plate_step", "calcn_r", (("walk", 20, 40),))
    assert not trial_verdict(figures(), None, report(step)).verdict.within
    outside = figures(frames_used_ranges=((0, 22), (40, 100)))
    assert trial_verdict(outside, None, report(step)).verdict.within
    flagged = reviewed(FlagRange(20, 40, "notOverForcePlate", "calcn_r"))
    assert trial_verdict(figures(), flagged, report(step)).verdict.within


def test_what_nobody_can_explain_leaves_the_angles():
    assert trial_verdict(figures(), None, report(verdict="unexplained")).verdict.use is Use.ANGLES
    assert trial_verdict(figures(), None, report(verdict="clean")).verdict.use is Use.TORQUES


@pytest.mark.parametrize(
    ("unusable", "use"),
    [(Unusable.TORQUES, Use.ANGLES), (Unusable.ANGLES, Use.NOTHING), (Unusable.BOTH, Use.NOTHING)],
)
def test_a_persons_word_comes_first_and_goes_with_the_finishing(unusable, use):
    said = SetStatus(Status.FINISHED, "he stumbled", unusable=unusable)
    trial = trial_verdict(figures(moment_BWh=0.09), reviewed(said))
    assert (trial.verdict.use, trial.is_marked) == (use, True)
    assert trial.line.why == "marked unusable by Ada: he stumbled"
    assert trial_verdict(figures(), reviewed(said, SetStatus(Status.IN_WORK))).verdict.within


def test_a_trial_is_marked_unusable_with_a_reason_and_by_finishing_it():
    for wrong in ({"status": Status.FINISHED, "note": " "}, {"status": Status.IN_WORK, "note": "fell"}):
        with pytest.raises(ReviewError, match="with a reason"):
            SetStatus(**wrong, unusable=Unusable.BOTH)


@pytest.mark.parametrize(
    ("trial", "next_"),
    [
        (trial_verdict(None, None), "solve"),
        (trial_verdict(figures(), None), "finish"),
        (trial_verdict(figures(), None, proposals=2, changed=True), "next"),
        (trial_verdict(figures(), None, changed=True), "solve"),
        (trial_verdict(figures(), None, waiting=("Bo",), proposals=1), "compare"),
        (trial_verdict(figures(moment_BWh=0.05), None), "diagnose"),
        (trial_verdict(figures(moment_BWh=0.05), None, report(verdict="clean")), "finish"),
        (trial_verdict(figures(), None, report(cause())), "diagnose"),
        (trial_verdict(figures(), None, report(cause()), CauseDecisions(accepted=LATE)), "solve"),
        (trial_verdict(figures(), None, report(cause()), CauseDecisions(LATE, in_fit=LATE)), "finish"),
        (trial_verdict(figures(), None, report(cause()), CauseDecisions(rejected=LATE)), "finish"),
        (trial_verdict(figures(moment_BWh=0.05), reviewed(SetStatus(Status.FINISHED))), "finish"),
    ],
)
def test_the_next_act_is_the_one_that_the_others_wait_for(trial, next_):
    assert trial.next == next_


def test_the_line_says_what_it_is_good_for_what_decides_and_what_is_open():
    good = trial_verdict(figures(), None)
    assert (
        good.line.text
        == "✓ Torques usable · 100 of 100 frames · marker RASI 75 % of the limit (40 mm) · nothing open"
    )
    over = trial_verdict(figures(moment_BWh=0.051), None, proposals=1)
    told = "! Angles only · 100 of 100 frames · moment 5.1 × the limit (1 % BW·h) · 1 proposal open"
    assert over.line.text == told
    late = trial_verdict(figures(), None, report(cause(confidence=0.9)))
    assert "· forces shifted in time against the markers (90 %) · nothing open" in late.line.text
    assert trial_verdict(None, None).line.text == "– Not fitted"
    known = {"torque_std_Nm": {"hip_flexion_r": 9.0, "knee_angle_r": 1.9, "knee_angle_l": 2.2}}
    told = trial_verdict(figures(**known), None).line.text
    assert told.startswith("✓ Torques usable, ± 4 N·m at the knee · 100 of 100 frames · marker")
    assert "±" not in trial_verdict(figures(**known, moment_BWh=0.051), None).line.text
    elsewhere = trial_verdict(figures(torque_std_Nm={"ankle_angle_l": 0.3, "lumbar_bending": 5.0}), None)
    assert elsewhere.line.band == "± 10 N·m in lumbar bending"
    looked = trial_verdict(figures(), reviewed(SetStatus(Status.SECOND_LOOK, "left foot?")))
    assert looked.line.open == "second look for Ada: left foot?"


def test_a_cause_that_makes_sound_forces_look_wrong_stands_beside_such_a_proposal():
    late, wrong = report(cause()), Proposal(10, 20, "forceDiscrepancy", "calcn_r", 0.9)
    assert cause_against(late, "walk", wrong) == "forces shifted in time against the markers"
    assert cause_against(late, "run", wrong) == ""
    assert cause_against(report(cause(confidence=0.3)), "walk", wrong) == ""
    assert cause_against(late, "walk", Proposal(10, 20, "notOverForcePlate", "calcn_r", 0.9)) == ""


def test_a_share_beyond_the_limit_never_reads_as_within_nor_the_other_way():
    assert [times_the_limit(share) for share in (0.004, 0.62, 0.9999, 1.0)] == [
        "0 % of the limit",
        "62 % of the limit",
        "99 % of the limit",
        "99 % of the limit",
    ]
    assert [times_the_limit(share) for share in (1.0001, 1.04, 1.26, 9.94, 51.2)] == [
        "1.01 × the limit",
        "1.04 × the limit",
        "1.3 × the limit",
        "9.9 × the limit",
        "51 × the limit",
    ]
