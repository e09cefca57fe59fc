"""What to do now: every kind of fault has its sentence, the most urgent comes first, doubt is said."""

from dataclasses import replace

import pytest

from addb_viewer.text.diagnosis_vocabulary import short_title
from addb_viewer.watch.judging import FirstLook, FitLook, Look, Step
from addb_viewer.watch.verdict_log import Colour, Stage, VerdictLine
from addb_viewer.watch.what_to_do import (
    APART_S,
    BY_BRANCH,
    BY_CHECK,
    BY_REASON,
    NOTHING,
    broken_told,
    first_told,
    missed_words,
    plan_words,
    told,
)
from solver.capture.capture import PlanItem
from solver.diagnosis.causes.catalogue import ABOUT
from solver.diagnosis.diagnosis import Remaining, ToBeSure
from solver.diagnosis.diagnosis_report import Cause, DiagnosisReport, DirectCheck, Rival
from solver.diagnosis.direct_checks.statement import STATED_NATS, About, Statement
from solver.fitting.verdict import Why
from tests.addb_viewer.fit_figures import force, moment, of_trial

SOUND = Look((), (), True, True)
FIGURES = of_trial(marker_rms_m=0.01, linear_residual=force(9.0, 0.01), angular_residual=moment(9.0, 0.005))
GOOD = FitLook(SOUND, FIGURES, (), "walk")


def step(number, **known):
    return Step(
        **{"number": number, "side": "Right", "whole": True, "missed": False, "plate": 2, "frames": (0, 9)}
        | known
    )


def diagnosed(*causes):
    verdict = "explained" if causes else "clean"
    return DiagnosisReport(verdict, causes, (), {}, Remaining(9.0, 9.8), ("walk",))


def cause(id, target="all", confidence=0.99, **known):
    return Cause(id, target, {}, confidence, (("walk", 10, 30),), **known)


def test_every_cause_every_check_and_every_reason_has_an_act():
    assert {about.branch for about in ABOUT.values()} == set(BY_BRANCH)
    assert set(BY_CHECK) == set(About)
    assert set(BY_CHECK.values()) <= set(BY_BRANCH)
    assert set(Why) - set(BY_REASON) == {Why.NO_FIT, Why.PERSON, Why.CAUSE}  # a cause has its own act


def test_a_sound_trial_is_green_and_nothing_is_to_repeat():
    found = told(GOOD, diagnosed(), ())
    assert (found.colour, found.to_do) == (Colour.GREEN, NOTHING)
    assert found.words == "Torques usable · 100 of 100 frames · marker error 50 % of the limit (20 mm)"


def test_the_fit_alone_asks_for_nothing_that_the_diagnosis_may_take_back():
    limit = replace(FIGURES, angular_residual=moment(30.0, 0.02))
    disagree = replace(GOOD, figures=limit)
    assert told(disagree, None, ()).to_do.startswith(
        "Keep it and record one more: forces and motion disagree"
    )
    assert told(disagree, None, (), is_last=False).to_do == "Wait for the diagnosis"
    missed = replace(disagree, steps=(step(1), step(2, missed=True), step(3)))
    assert told(missed, None, (), is_last=False).to_do == "Repeat: step 2 missed plate 2"


@pytest.mark.parametrize("id", sorted(set(ABOUT) - {"off_plate_step"}))
def test_a_cause_is_named_and_doubted_where_it_is_not_sure(id):
    sure = told(GOOD, diagnosed(cause(id)), ())
    doubted = told(GOOD, diagnosed(cause(id, confidence=0.6)), ())
    assert sure.colour in (Colour.YELLOW, Colour.RED)  # the scale of the cameras spoils angles as well
    assert BY_BRANCH[ABOUT[id].branch] in sure.to_do
    assert doubted.to_do == "May be " + sure.to_do[0].lower() + sure.to_do[1:]


def test_a_cause_that_is_likelier_not_there_asks_for_nothing():
    weak = diagnosed(cause("zero_level", "plate_2", 0.4, told_as="tentative"))
    assert told(GOOD, weak, ()).to_do == "Nothing to repeat; a weak sign of wrong zero level of plate 2"
    loud = replace(GOOD, figures=replace(FIGURES, angular_residual=moment(9.0, 0.02)))
    said = told(loud, weak, ()).to_do
    assert said == f"{BY_REASON[Why.MOMENT]}; a weak sign of wrong zero level of plate 2"


def test_a_short_trial_that_would_decide_a_cause_is_what_to_do_about_it():
    asked = ToBeSure(
        *("plate_gain", "plate_2", "zero_level", "plate_2", 3.0),
        trial="stand",
        plates=("plate_2",),
        words="stand still on plate_2 for 3 s",
    )
    unsure = replace(diagnosed(cause("plate_gain", "plate_2", 0.7)), to_be_sure=asked)
    said = told(GOOD, unsure, ()).to_do
    assert said == "May be wrong gain of plate 2: to be sure, stand still on plate 2 for 3 s"
    none_helps = replace(unsure, to_be_sure=replace(asked, trial=None))
    assert BY_BRANCH["plate/scale"] in told(GOOD, none_helps, ()).to_do


def test_a_direct_check_speaks_where_no_cause_is_named_and_the_trial_is_not_sound():
    check = DirectCheck("weight", "", {"entered_mass": 9.0}, ("entered_mass",), "walk")
    loud = replace(GOOD, figures=replace(FIGURES, angular_residual=moment(9.0, 0.02)))
    said = told(loud, replace(diagnosed(), direct_checks=(check,)), ()).to_do
    assert said == ("May be the entered mass, or another person: weigh the person with everything they wear")
    assert told(GOOD, replace(diagnosed(), direct_checks=(check,)), ()).to_do == NOTHING


MISSED = (step(1), step(2, missed=True, whole=False), step(3))
LOOKS = (GOOD, replace(GOOD, look=Look((), ((1, -90.0),), True, True), steps=MISSED))
CONFIDENCES = ((0.99, "name"), (0.6, "name"), (0.3, "name"), (0.3, "tentative"))


@pytest.mark.parametrize("fit", [*LOOKS, replace(GOOD, figures=replace(FIGURES, marker_rms_m=0.03))])
@pytest.mark.parametrize(("confidence", "told_as"), CONFIDENCES)
@pytest.mark.parametrize("check", [None, *About])
def test_whatever_cause_the_verdict_names_the_sentence_names_too(fit, confidence, told_as, check):
    """Of any two causes, in any order, beside what the recording shows by itself and any direct check."""
    loud = () if check is None else (DirectCheck("x", "", {str(check): 9.0}, (str(check),), "walk"),)
    for id in ABOUT:
        for other in ("clock_offset", "off_plate_step", "marker_swap"):
            if id == other:
                continue
            causes = cause(other, confidence=0.9), cause(id, "plate_2", confidence, told_as=told_as)
            for order in (causes, causes[::-1], causes[1:]):
                found = told(fit, replace(diagnosed(*order), direct_checks=loud), ())
                for named in (c for c in order if short_title(c) in found.words):
                    said = any(key.startswith(ABOUT[named.id].branch) for key in found.about)
                    assert said or short_title(named) in found.to_do, found


def test_a_cause_and_a_check_that_differ_are_both_told_as_alternatives():
    check = DirectCheck("weight", "", {"clock": 9.0}, ("clock",), "walk")
    unsure = replace(diagnosed(cause("plate_gain", "plate_2", 0.6)), direct_checks=(check,))
    scale, clock = "wrong gain of plate 2: check the plate's units", "the clocks of forces and markers: check"
    said = told(GOOD, unsure, ())
    assert said.about == ("plate/scale plate_2", "time/clock")
    assert said.to_do.startswith(f"May be {scale}")
    assert f"; or {clock}" in said.to_do
    sure = replace(unsure, effects=(cause("plate_gain", "plate_2"),))
    assert f"; also may be {clock}" in told(GOOD, sure, ()).to_do
    slips = [cause("marker_slip", name, 0.6) for name in ("LPSI", "L5")]  # what to do is told once
    assert told(GOOD, diagnosed(*slips), ()).to_do.endswith(
        "repeat; or a marker that moved on its segment: L5"
    )
    same = DirectCheck("level", "", {"plate_place": 9.0}, ("plate_place",), "walk", "plate_1+plate_2")
    assert "; " not in told(GOOD, replace(unsure, direct_checks=(same,)), ()).to_do


def test_a_cause_that_is_less_likely_than_others_is_told_with_the_likeliest_of_them():
    weak = diagnosed(cause("zero_level", "plate_2", 0.35))
    rivals = (
        Rival("plate_bias", "plate_2", confidence=0.3),
        Rival("object_on_plate", "plate_2", confidence=0.2),
    )
    said = told(GOOD, replace(weak, alternatives=rivals), ()).to_do
    assert said == (
        "May be wrong zero level of plate 2: tare with nobody on it and repeat; "
        "or an object on plate 2: take it off and repeat"
    )


def test_nothing_to_repeat_is_not_said_beside_something_to_repeat():
    both = told(GOOD, diagnosed(cause("plate_position", "plate_2"), cause("clock_offset")), ()).to_do
    assert both == (
        "Wrong position of plate 2: measure the corners of the plates again; also forces shifted in time "
        "against the markers: check the trigger between cameras and plates, then repeat"
    )
    harmless = diagnosed(cause("plate_position", "plate_2"), cause("subject_mass"))
    assert told(GOOD, harmless, ()).to_do.count("nothing to repeat") == 1


def test_markers_that_no_pose_follows_go_before_a_cause_in_the_forces():
    spoilt = replace(GOOD, figures=replace(FIGURES, marker_rms_m=0.03))
    assert told(spoilt, diagnosed(cause("clock_offset")), ()).to_do.startswith(BY_REASON[Why.MARKERS])
    swapped = told(spoilt, diagnosed(cause("marker_swap", "A+B")), ()).to_do
    assert swapped.startswith("Swapped markers")


def test_a_trial_with_an_untared_plate_is_none_of_the_plan():
    assert told(GOOD, diagnosed(), ()).against == ""
    untared = replace(GOOD, look=Look((), ((1, -90.0),), True, True))
    assert told(untared, diagnosed(), ()).against == "plate 1 is off its zero"
    nowhere = replace(GOOD, figures=replace(FIGURES, frames_with_force_used=0))
    assert told(nowhere, None, ()).against == "no frame has the force of every foot"


def test_a_step_amid_others_that_missed_a_plate():
    steps = (step(2), step(3, missed=True, whole=False), step(4))
    found = told(replace(GOOD, steps=steps), diagnosed(), ())
    assert (found.colour, found.to_do) == (Colour.YELLOW, "Repeat: step 3 missed plate 2")


@pytest.mark.parametrize(
    ("others", "confidence", "said"),
    [
        ((1, 4), 0.99, "Repeat: step 2 missed the plates"),
        ((1, 4), 0.7, "May have to be repeated: step 2 may have missed the plates"),
        ((3, 4), 0.99, "Nothing to repeat, unless step 2 was to be on a plate"),
    ],
)
def test_a_step_that_the_diagnosis_misses_is_counted_among_the_steps(others, confidence, said):
    own = step(2, frames=(9, 31), plate=None, whole=False)
    left = step(5, side="Left", frames=(9, 31), whole=False)
    steps = (own, left, *(step(number, frames=(28, 50)) for number in others))
    cause_of_it = diagnosed(cause("off_plate_step", "calcn_r", confidence))
    assert told(replace(GOOD, steps=steps), cause_of_it, ()).to_do == said
    assert told(GOOD, cause_of_it, ()).to_do.endswith("repeat with every step on a plate")


@pytest.mark.parametrize(
    ("level_N", "former", "said"),
    [
        (
            -400.0,
            ((), ("plate_1",)),
            "Plate 1 reads −400 N while empty, may be a load at taring: tare and repeat the last 2 trials",
        ),
        (
            -400.0,
            (("plate_1",), ()),
            "Plate 1 reads −400 N while empty, may be a load at taring: tare and repeat this trial",
        ),
        (
            90.0,
            (),
            "Plate 1 reads +90 N while empty, may be an object or no taring: tare and repeat this trial",
        ),
    ],
)
def test_a_plate_that_was_not_tared_well_comes_first(level_N, former, said):
    look = Look((("LKNE", 0.6),), ((1, level_N),), True, True)
    steps = (step(1), step(2, missed=True), step(3))
    for found in (
        told(replace(GOOD, look=look, steps=steps), None, former),
        first_told(FirstLook(look, (), ()), former),
    ):
        assert found.to_do.replace("\u00a0", " ").partition("; ")[0] == said
        assert found.colour is Colour.YELLOW


def test_a_file_that_was_not_replaced_with_the_other_is_never_passed_over():
    kept = ["walk_grf.mot"]
    sound = told(GOOD, diagnosed(), (), kept)
    assert sound.to_do == "Nothing to repeat, if walk_grf.mot is right: it was not replaced"
    assert (sound.colour, sound.against) == (Colour.YELLOW, "")
    for causes in (
        (cause("marker_slip", "A"),),
        (cause("marker_slip", "A"), cause("soft_tissue", "tibia_r")),
    ):
        also = told(GOOD, diagnosed(*causes), (), kept).to_do
        assert also.endswith("; also may be walk_grf.mot of the former recording: export it again")
    loud = replace(GOOD, figures=replace(FIGURES, angular_residual=moment(9.0, 0.02)))
    doubted = told(loud, diagnosed(cause("clock_offset", confidence=0.6)), (), kept)
    assert doubted.to_do.startswith("May be walk_grf.mot of the former recording: export it again; or forces")
    for share, sure in ((0.7, False), (1.4, True)):
        look = replace(SOUND, apart_s=share * APART_S)
        found = told(replace(GOOD, look=look), diagnosed(), (), kept)
        assert (found.colour is Colour.RED, bool(found.against)) == (sure, sure)
        assert first_told(FirstLook(look, (), ()), (), kept).about == ("files/former",)
        assert told(replace(GOOD, look=look), diagnosed(), ()).to_do == NOTHING


@pytest.mark.parametrize(
    ("before", "said"),
    [
        ([["plate/scale plate_2"], ["time/clock all"]], ", as in the trial before"),
        ([[], ["time/clock all"], ["plate/scale plate_2", "time/clock all"]], ", as in the 2 trials before"),
        ([["time/clock all"], ["plate/scale plate_2"]], ""),
    ],
)
def test_what_the_trials_before_had_too_is_the_laboratorys(before, said):
    late = told(GOOD, diagnosed(cause("clock_offset")), before)
    assert late.to_do.startswith(f"Forces shifted in time against the markers{said}: check the trigger")
    slipped = diagnosed(cause("marker_slip", "A"))  # no laboratory has it
    assert "before" not in told(GOOD, slipped, [["markers/one A"]]).to_do


def test_lost_markers_are_told_beside_nothing_to_repeat():
    look = Look((("LKNE", 0.62), ("RKNE", 0.4)), (), True, True)
    assert told(replace(GOOD, look=look), None, ()).to_do == (
        "Nothing to repeat; marker LKNE was lost for 0.6 s, 1 other as well"
    )
    assert first_told(FirstLook(replace(look, lost=look.lost[:1]), (), ()), ()).to_do == (
        "Marker LKNE was lost for 0.6 s"
    )


@pytest.mark.parametrize(
    ("figures", "colour", "said"),
    [
        (replace(FIGURES, marker_rms_m=0.03), Colour.RED, BY_REASON[Why.MARKERS]),
        (
            replace(FIGURES, angular_residual=moment(9.0, 0.02)),
            Colour.YELLOW,
            f"{BY_REASON[Why.MOMENT]}, and no cause is named",
        ),
        (replace(FIGURES, frames_with_force_used=0), Colour.YELLOW, BY_REASON[Why.NO_FRAMES]),
        (replace(FIGURES, marker_max_m=0.06), Colour.YELLOW, BY_REASON[Why.MARKER]),
    ],
)
def test_what_the_figures_alone_say(figures, colour, said):
    found = told(replace(GOOD, figures=figures), diagnosed(), ())
    assert (found.colour, found.to_do) == (colour, said)


def test_the_first_look():
    assert first_told(FirstLook(SOUND, (), ()), ()).colour is Colour.NONE
    late = Statement("lag", "", {About.CLOCK: STATED_NATS}, {}, "walk")
    found = first_told(FirstLook(SOUND, (late,), ()), ())
    clocks = "the clocks of forces and markers: check the trigger between cameras and plates, then repeat"
    assert found.to_do == f"May be {clocks}"
    said = first_told(FirstLook(SOUND, (late,), (1.21,)), ()).to_do
    assert said == f"May have to be repeated: a step may have missed the plates at 1.2 s; or {clocks}"
    empty = Look((), (), True, False)
    assert "were the amplifiers on?" in first_told(FirstLook(empty, (), ()), ()).to_do
    assert told(replace(GOOD, look=empty), None, ()).to_do.startswith("No plate bore a load: repeat")


def test_a_trial_that_cannot_be_judged_says_why():
    assert broken_told("walk.c3d: cut off").to_do == "Export it again, or repeat: walk.c3d: cut off"


def test_the_plan_counts_good_trials_and_whole_steps():
    line = VerdictLine("a", "", Stage.VERDICT, Colour.GREEN, "", "", "", 1.0, True, "walk", 2, 1)
    lines = [
        line,
        replace(line, activity="run", right_steps=1),
        replace(line, good=False),
        replace(line, stage=Stage.FIT),
    ]
    plan = [
        PlanItem(wanted, 3) for wanted in ("trials", "walks", "runs", "steps", "right_steps", "left_steps")
    ]
    assert [words for words, _ in plan_words(plan, lines)][: len(plan)] == [
        "2 of 3 good trials",
        "1 of 3 good walks",
        "1 of 3 good runs",
        "5 of 3 good steps",
        "3 of 3 good right steps",
        "2 of 3 good left steps",
    ]
    assert [done for _, done in plan_words(plan, lines)][: len(plan)] == [
        False,
        False,
        False,
        True,
        True,
        False,
    ]
    assert plan_words(plan[:1], []) == [("0 of 3 good trials", False)]


@pytest.mark.parametrize(
    ("wanted", "known", "why"),
    [
        ("walks", {"good": False, "against": "left foot missed plate 2"}, "left foot missed plate 2"),
        ("right_steps", {"right_steps": 0, "missed": ("a", "b")}, "a and b"),
        ("right_steps", {"right_steps": 0}, "no right step lies wholly on a plate"),
        ("walks", {"activity": "standing"}, "it is no walk"),
        ("walks", {"missed": ("left foot missed plate 2",)}, ""),  # it counts
    ],
)
def test_the_plan_says_why_the_newest_trial_does_not_count(wanted, known, why):
    line = VerdictLine("walk3", "", Stage.VERDICT, Colour.GREEN, "", "", "", 1.0, True, "walk", 2, 1)
    words = plan_words([PlanItem(wanted, 3)], [line, replace(line, **known)])
    assert words[1:] == ([(f"trial walk3 does not count: {why}", None)] if why else [])
    later = plan_words([PlanItem(wanted, 3)], [replace(line, **known), line])
    assert len(later) == 1


def test_a_step_that_missed_is_told_by_its_foot():
    steps = (step(1), step(2, side="Left", missed=True), step(3, missed=True, plate=None))
    found = replace(GOOD, steps=steps)
    assert missed_words(found) == ("left foot missed plate 2", "right foot missed the plates")
    loud = replace(found, figures=replace(FIGURES, angular_residual=moment(9.0, 0.02)))
    assert told(loud, diagnosed(), ()).against == "left foot missed plate 2"
