"""The page of a diagnosis: said plainly, no more certain than the figures, and whole."""

import re
from dataclasses import replace

import pytest

from addb_viewer.text import diagnosis_vocabulary as vocabulary
from addb_viewer.text import diagnosis_words as words_of
from addb_viewer.text.diagnosis_vocabulary import amount, certainty, target_in_words, upward
from addb_viewer.text.sections import as_text
from addb_viewer.text.verdict_words import headline
from solver.common.notes import Kind, Note
from solver.common.typed_json import plain
from solver.diagnosis.causes.about import OF_EACH_TRIAL, Reading
from solver.diagnosis.causes.body_masses import CarriedMass
from solver.diagnosis.causes.catalogue import ABOUT, IDS, MARKER_IDS
from solver.diagnosis.causes.plate_readings import PlateBiasTakenOff
from solver.diagnosis.diagnosis import AfterTrial, ToBeSure
from solver.kinematics.unseen_bodies import UNSEEN_MASS
from tests.addb_viewer.synthetic_residual import residual
from tests.addb_viewer.told_diagnosis import told, told_cause


def page(answer):
    return words_of.page(told(answer))


def notes(answer):
    return words_of.notes(told(answer))


def title(cause):
    return vocabulary.title(told_cause(cause))


def amounts(cause):
    return vocabulary.amounts(told_cause(cause))


def sentence(cause):
    return vocabulary.sentence(told_cause(cause))


FORCE = {"before": 41.0, "after": 12.2, "interval": [11.0, 13.9]}


def effect(id="clock_offset", target="all", confidence=0.995, frames=((0, 412),), **parameters):
    return {
        "id": id,
        "target": target,
        "parameters": {name: {"value": value, "std": std} for name, (value, std) in parameters.items()},
        "confidence": confidence,
        "trial": "walk1",
        "frames": [list(f) for f in frames],
        "sentence": "{} is not what it seems.".format(target if target != "all" else "The clock"),
        "remedy": "Look at the cable.",
    }


def rival(id, of, separate_by="a quiet standing trial", target="all"):
    return {"id": id, "target": target, "instead_of": of, "why": "cosine 0.99", "separate_by": separate_by}


def figures(verdict="explained", effects=(), alternatives=(), notes=(), **changes):
    return {
        "verdict": verdict,
        "effects": list(effects),
        "alternatives": list(alternatives),
        "gain": {"held_out_linear_residual_N": FORCE} if effects else {},
        "remaining": {
            "linear_residual_N": 12.2,
            "noise_floor_N": 9.8,
            "location": None,
            "off_the_list": None,
        },
        "trials": ["walk1"],
        "rates_Hz": {"walk1": 100.0, "walk2": 50.0},
        "notes": [note.as_json() for note in notes],
        "residual": residual(),
    } | changes


def said(answer):
    """The page in one line, so that its line breaks do not matter."""
    return " ".join(" ".join(as_text(page(answer))).split())


LATE = effect(offset_s=(0.0123, 0.0004))
PULLED = effect("drag", "pelvis", mean_force_N=(20.0, 1.0))
STEP = effect(
    "off_plate_step", "calcn_r", frames=((126, 190),), force_y_N=(492.0, 1.6), weight_share=(0.7, 0.002)
)


NOTHING_TO_MEASURE = ("plate_swap", "plate_exchange", "axis_convention", "marker_swap")


@pytest.mark.parametrize("id", [*IDS, *MARKER_IDS])
def test_every_cause_of_the_catalogue_has_words(id):
    assert ABOUT[id].title
    assert ABOUT[id].readings or id in NOTHING_TO_MEASURE
    assert "_" not in title({"id": id, "target": "all"})


def test_what_each_trial_has_is_said_trial_by_trial():
    found = effect(
        "trial_clocks", "each trial", **{"offset_s Walk01": (0.006, 0.001), "offset_s b": (-0.02, 0.001)}
    )
    assert amounts(found) == [
        "in Walk01 the forces come 6 ± 2 ms too late",
        "in b the forces come 20 ± 2 ms too early",
    ]


@pytest.mark.parametrize(
    ("of", "words"),
    [
        (effect(offset_s=(0.0123, 0.0004)), ["the forces come 12.3 ± 0.8 ms too late"]),
        (effect(offset_s=(-0.008, 0.001)), ["the forces come 8 ± 2 ms too early"]),
        (effect("plate_gain", "plate_2", gain_error=(-0.041, 0.0015)), ["it reads 4.1 ± 0.3 % too little"]),
        (
            effect("subject_mass", mass_factor=(0.96, 0.004)),
            ["the person is 4.0 ± 0.8 % lighter than entered"],
        ),
        (effect("capture_scale", scale=(1.012, 0.0005)), ["markers lie 1.20 ± 0.10 % too far apart"]),
        (
            effect("plate_yaw", "plate_1", yaw_deg=(-3.0, 0.1)),
            [
                "what was recorded is turned by 3.0 ± 0.2° clockwise, seen from above: turn its forces and "
                "centres of pressure back counter-clockwise about the plate's centre"
            ],
        ),
        (
            effect("marker_slip", "RKNE", shift_m=(0.0152, 0.0004), time_s=(1.23, 0.01)),
            ["by 15.2 ± 0.8 mm", "at 1.23 ± 0.02 s from the trial's start"],
        ),
        (
            effect("plate_bias", "plate_1", bias_x_N=(3.0, 0.5), bias_y_N=(-20.0, 1.0), bias_z_N=(-4.0, 0.5)),
            [
                "it reads 20 ± 2 N too little along y (bias −20 N)",
                "it reads 3.0 ± 1.0 N too far towards +x",
                "it reads 4.0 ± 1.0 N too far towards −z",
            ],
        ),
        (
            effect("plate_position", "plate_1", shift_x_m=(-0.012, 0.001), shift_z_m=(0.003, 0.001)),
            [
                "the files place it 12 ± 2 mm too far towards −x",
                "the files place it 3 ± 2 mm too far towards +z",
            ],
        ),
        (
            effect(
                "carried_mass",
                "tibia_l",
                mass_kg=(2.0, 0.1),
                offset_x_m=(0.03, 0.005),
                offset_y_m=(-0.04, 0.005),
                offset_z_m=(0.0, 0.005),
            ),
            [
                "it weighs 2.0 ± 0.2 kg",
                "its centre lies 50 ± 10 mm from the segment's origin, at x 30 ± 10 mm, y −40 ± 10 mm, "
                "z 0 ± 10 mm in its axes",
            ],
        ),
    ],
)
def test_parameters_are_told_with_their_sense_unit_and_spread(of, words):
    assert amounts(of) == words


@pytest.mark.parametrize(
    ("value", "spread", "text"),
    [
        (492.36, 3.3, "492 ± 3 N"),
        (492.36, 1.2, "492.4 ± 1.2 N"),
        (492.36, 140.0, "492 ± 140 N"),
        (0.12345, 0.00001, "0.1235 ± 0.0001 N"),
        (12.0, None, "12 N"),
        (12.0, float("inf"), "12 N"),
    ],
)
def test_no_more_digits_than_the_spread_leaves(value, spread, text):
    assert amount(value, spread, "N") == text


def test_targets_are_told_as_people_call_them_and_as_files_do():
    assert target_in_words("plate_2") == "plate 2"
    assert target_in_words("plate_1+plate_2") == "plate 1 and plate 2"
    assert target_in_words("calcn_r") == "right foot (calcn_r)"
    assert target_in_words("femur_r+femur_l") == "right thigh and left thigh (femur_r, femur_l)"
    assert target_in_words("RKNE") == "RKNE"
    assert target_in_words("lumbar_5") == "lumbar_5"
    assert sentence(effect("plate_gain", "plate_2")) == "Plate 2 is not what it seems."
    assert sentence(effect()) == "The clock is not what it seems."


def test_directions_of_a_force():
    assert upward((1.0, 40.0, 2.0)) == "up"
    assert upward((0.0, -40.0, 2.0)) == "down"
    assert upward((-30.0, 1.0, 2.0)) == "along −x"
    assert upward((0.0, 20.0, 20.0)) == "up and along +z"
    assert upward((27.0, 1.0, -27.0)) == "along +x and −z"
    assert upward((10.0, 1.0, -27.0)) == "along −z"


def test_certainty_never_exceeds_the_figure():
    words = [certainty(c, 0) for c in (0.995, 0.95, 0.7, 0.3)]
    assert [w.split(" (")[0].split(":")[0] for w in words] == [
        "very sure of the name",
        "fairly sure of the name",
        "not sure",
        "a guess",
    ]
    assert certainty(0.94, 1) == "fairly sure of the name (94 %); another cause remains possible, see below"
    assert "2 other causes remain possible" in certainty(0.94, 2)
    assert "sure" not in certainty(0.89, 1)
    assert "one of 3 causes that come near" in certainty(0.5, 2)


def test_what_is_likelier_wrong_than_right_is_told_as_tentative():
    guess = effect("plate_position", "plate_2", 0.35, shift_x_m=(0.02, 0.005)) | {"told_as": "tentative"}
    beside = said(figures(effects=[LATE, guess]))
    assert (
        "Besides, a tentative cause, likelier wrong than right: wrong position of plate 2 [a guess]."
        in beside
    )
    assert "one cause accounts for it: forces shifted in time" in beside
    assert "TENTATIVE CAUSE 2 OF 2: wrong position of plate 2" in beside
    assert "At fault: the recording." in beside
    assert "`addb-viewer accept` leaves it out" in beside
    alone = said(figures(effects=[guess]))
    assert (
        "no cause is likelier than all others together. A tentative cause, likelier wrong than right" in alone
    )
    assert "for joint torques with care, before somebody has looked" in alone
    assert "At fault" not in alone
    assert "accept SUBJECT` makes every later fit correct" not in alone


def test_an_explained_recording():
    text = said(figures(effects=[LATE]))
    assert text.startswith(
        "VERDICT Something is wrong with the recording 'walk1', and one cause accounts for it: "
        "forces shifted in time against the markers [very sure of the name]."
    )
    assert "differ from the measured ones by 41 N" in text
    assert "how sure very sure of the name (more than 99 %)" in text
    assert "what to do Look at the cable." in text
    assert "41 → 12 N (the latter between 11 and 14 with 95 % certainty)" in text
    assert "falls by 70 %" in text
    assert "Nothing else stands out." in text


@pytest.mark.parametrize(("verdict", "effects"), [("clean", []), ("explained", [LATE])])
def test_a_search_that_ended_early_says_so_with_the_verdict(verdict, effects):
    assert "ended before everything was tried" in said(figures(verdict, effects, ended_early=True))
    assert "ended before everything was tried" not in said(figures(verdict, effects, ended_early=False))


def test_all_the_time_is_said_for_what_lasts_and_frames_for_what_does_not():
    text = said(figures(effects=[LATE, STEP]))
    assert "when all the time, in walk1" in text
    assert "walk1, frames 126 to 189 (1.26 to 1.89 s)" in text
    assert "2 causes together account for it" in text
    assert "flag SUBJECT walk1 126:190 --foot calcn_r --reason notOverForcePlate" in text

    text = said(figures(effects=[STEP | {"target": "calcn_r+calcn_l"}]))
    assert "flag SUBJECT walk1 126:190 --foot both --reason notOverForcePlate" in text


def test_frames_of_several_trials_with_the_seconds_of_the_recordings_clock():
    both = STEP | {"frames": [["walk1", 126, 190], ["walk2", 3, 80]], "trial": None}
    text = said(told := figures(effects=[both], trials=["walk1", "walk2"]))
    assert "walk1, frames 126 to 189 (1.26 to 1.89 s); walk2, frames 3 to 79 (0.06 to 1.58 s)" in text
    assert "these recordings (walk1 and walk2)" in text
    text = said(told | {"starts_s": {"walk1": 4.01, "walk2": 0.0}})
    assert "walk1, frames 126 to 189 (5.27 to 5.90 s); walk2, frames 3 to 79 (0.06 to 1.58 s)" in text


def test_a_step_whose_moment_rises_on_hidden_stretches_says_why():
    gain = {
        "held_out_linear_residual_N": {"before": 388.0, "after": 149.0, "interval": [97.0, 203.0]},
        "held_out_angular_residual_Nm": {"before": 16.4, "after": 55.9, "interval": [39.2, 69.6]},
    }
    text = said(figures(effects=[STEP], gain=gain))
    assert "moment rises (16 → 56 N·m)" in text
    assert "cannot be predicted" in text
    falls = gain | {"held_out_angular_residual_Nm": {"before": 16.4, "after": 9.0, "interval": [8.0, 10.0]}}
    assert "cannot be predicted" not in said(figures(effects=[STEP], gain=falls))


def test_rivals_are_in_the_verdict_and_with_what_tells_them_apart():
    heavy = rival("subject_mass", "clock_offset all", "the person on a scale")
    unsure = LATE | {"confidence": 0.69}
    text = said(figures(effects=[unsure, STEP], alternatives=[heavy | {"confidence": 0.31}]))
    verdict, _ = text.split("WHAT IS WRONG")
    assert "forces shifted in time against the markers (69 %) — or else wrong body mass (31 %)" in verdict
    sure = said(figures(effects=[LATE, STEP], alternatives=[heavy])).split("WHAT IS WRONG")[0]
    assert "forces shifted in time against the markers [fairly sure of the name]" in sure
    assert "or else" not in sure
    late, step = text.split("CAUSE 1")[1].split("CAUSE 2")
    assert "could also be wrong body mass" in late
    assert "to tell, record the person on a scale" in late
    known = said(figures(effects=[LATE, STEP], alternatives=[heavy | {"confidence": 0.31}]))
    assert "could also be wrong body mass (31 %)" in known
    assert "very sure" not in late
    assert "could also be" not in step


def test_of_the_same_cause_elsewhere_only_the_place_is_told():
    load = effect("carried_mass", "hand_r", confidence=0.4, mass_kg=(3.0, 0.4))
    text = said(
        figures(effects=[load], alternatives=[rival("carried_mass", "carried_mass hand_r", target="ulna_r")])
    )
    both = "a load that is not in the model: right hand (hand_r) (40 %) — or else right forearm (ulna_r)"
    assert both in text.split("WHAT IS WRONG")[0]


def test_the_verdict_is_no_surer_than_its_causes():
    verdict = page(figures(effects=[LATE, STEP | {"confidence": 0.3}]))[0].lines[0]
    assert "(1) forces shifted in time against the markers [very sure of the name]" in verdict
    assert "(2) a step that no plate measured: right foot (calcn_r) [a guess]" in verdict


def test_a_gain_that_may_be_chance_is_not_praised():
    weak = {"held_out_linear_residual_N": {"before": 12.0, "after": 11.5, "interval": [9.0, 14.0]}}
    text = said(figures(effects=[LATE], gain=weak))
    assert "Take the cause as tentative, not as a finding" in text
    assert "falls by" not in text
    assert "accounts for it" not in text
    assert "It is tentative, not a finding" in text.split("WHAT IS WRONG")[0]
    certain = said(figures(effects=[LATE], gain=weak) | {"evidence_nats": 60.0})
    assert "tentative" not in certain
    assert "The evidence for the cause is the recording as a whole" in certain
    left = {"linear_residual_N": 30.0, "noise_floor_N": 12.0, "location": None}
    more = said(figures(effects=[LATE], gain=weak, remaining=left) | {"evidence_nats": 60.0})
    assert "a belt" not in more.split("WHAT REMAINS")[1].split("HOW TO READ")[0]


def test_force_that_gets_worse_is_no_gain_and_neither_summary_praises_it():
    """What remains is told by its multiple, with the moment."""
    gain = {
        "held_out_linear_residual_N": {"before": 18.0, "after": 20.0, "interval": [18.4, 24.0]},
        "held_out_angular_residual_Nm": {"before": 4.2, "after": 3.0, "interval": [2.8, 3.2]},
    }
    left = {"linear_residual_N": 20.0, "noise_floor_N": 12.0, "location": None}
    text = said(figures(effects=[LATE], gain=gain, remaining=left))
    worse = "orce rises (18 → 20 N); moment falls by 29 %, more than by chance (4.2 → 3.0 N·m)"
    assert text.count(worse) == 2
    assert "Nothing else stands out" not in text
    remains = text.split("WHAT REMAINS")[1]
    assert "1.7 times the 12 N of a recording without faults. The moment error is 3.0 N·m." in remains
    assert "First check what is only tentative" in remains


def test_a_moment_that_falls_speaks_for_a_cause_that_leaves_the_force_alone():
    gain = {
        "held_out_linear_residual_N": {"before": 18.0, "after": 18.1, "interval": [17.0, 19.0]},
        "held_out_angular_residual_Nm": {"before": 9.0, "after": 3.0, "interval": [2.8, 3.2]},
    }
    moved = effect("plate_position", "plate_1", shift_x_m=(0.03, 0.001), shift_z_m=(0.0, 0.001))
    text = said(figures(effects=[moved], gain=gain))
    assert "Force stays as it is (18 → 18 N); moment falls by 67 %" in text
    assert "one cause accounts for it" in text
    assert "tentative" not in text


def test_forces_do_not_judge_what_lies_in_the_markers():
    same = {"held_out_linear_residual_N": {"before": 12.0, "after": 12.0, "interval": [9.0, 14.0]}}
    text = said(figures(effects=[effect("marker_slip", "RKNE", shift_m=(0.02, 0.001))], gain=same))
    assert "tentative" not in text
    assert "Correct the markers" in text
    assert "addb-viewer accept" not in text
    soft_tissue = said(figures(effects=[effect("soft_tissue", "femur_l", rms_m=(0.015, 0.001))], gain=same))
    assert "do not trust the joints at that segment" in soft_tissue
    assert "Until then, fits correct nothing" not in soft_tissue  # nothing corrects it
    assert "Correct the markers" not in soft_tissue


def test_exchanged_labels_are_corrected_by_fits_and_can_be_accepted():
    text = said(figures(effects=[effect("marker_swap", "RKNE+RANK")])).split("WHAT NEXT")[1]
    assert "`addb-viewer accept SUBJECT` does it for these frames" in text
    assert "the recording as it is" not in text
    assert "Correct the markers" not in text
    slipped = effect("marker_slip", "RKNE", shift_m=(0.02, 0.001))
    text = said(figures(effects=[effect("marker_swap", "RKNE+RANK"), slipped])).split("WHAT NEXT")[1]
    assert "exchange such labels back" in text
    assert "Correct the markers" in text


def test_what_to_do_next_with_this_recording():
    text = said(figures(effects=[LATE]))
    assert "`addb-viewer accept SUBJECT` makes every later fit correct the causes" in text
    assert "`addb-viewer reject SUBJECT` undoes that" in text
    assert text.count("Until then, fits correct nothing in this recording.") == 1
    assert "First do what each cause says under 'what to do'" in text
    assert "Do not use" not in text
    taken_off = effect("plate_bias", "plate_1", bias_y_N=(8.0, 0.1)) | {
        "sentence": PlateBiasTakenOff.about.sentence.format(target="plate_1")
    }
    text = said(figures(effects=[taken_off], residual=residual()))
    assert "Every fit already corrects the bias" in text
    assert "Every fit takes it off already." in text
    assert "The fault is still in the files" in text
    assert "what the plate read while nobody stood on it" in text
    assert "with the fault left in, as in the files" in text
    assert "its pattern" not in text
    assert "addb-viewer accept" not in text
    assert "for joint torques before the cause" in said(figures("unexplained"))
    assert "WHAT NEXT" not in said(figures("clean"))


def test_without_causes_what_remains_is_all_with_its_moment():
    remains = said(figures("unexplained")).split("WHAT REMAINS")[1]
    assert "force 41 N, 4.1 times what is ordinary; moment 20 N·m, 4 times what is ordinary." in remains


def test_what_is_unexplained_may_be_what_no_marker_shows():
    words = "No marker shows how 68 % of the mass moves, and it may be that."
    bare = Note(Kind.OTHER, "no marker shows", values={UNSEEN_MASS: 0.68})
    assert words in said(figures("unexplained", notes=[bare])).split("WHAT REMAINS")[0]
    assert words in headline(told(figures("unexplained", effects=[LATE], notes=[bare])))
    assert words not in said(figures(effects=[LATE], notes=[bare]))


def test_segments_have_an_article_in_a_sentence():
    load = effect("carried_mass", "tibia_l") | {
        "sentence": CarriedMass.about.sentence.format(target="tibia_l")
    }
    assert "carried on the left shank (tibia_l)." in sentence(load)
    trunk = load | {"target": "pelvis", "sentence": CarriedMass.about.sentence.format(target="pelvis")}
    assert "carried on the pelvis." in sentence(trunk)


def test_a_clean_recording_is_said_to_be_clean_and_what_was_looked_for():
    text = said(figures("clean"))
    assert text.startswith("VERDICT Nothing wrong was found in the recording 'walk1'.")
    for words in ("wrong body mass", "swapped markers", "an elastic band"):
        assert words in text
    assert not re.search(r"CAUSE|REMAINS|HOLD UP|NEXT|wrong with", text)


def test_what_nobody_can_explain_is_called_that():
    location = {
        "body": "hand_r",
        "rms_force_N": 55.0,
        "mean_force_N": [3.0, 40.0, -2.0],
        "depends_on": "constant",
    }
    remaining = {"linear_residual_N": 60.0, "noise_floor_N": 9.8, "location": location}
    text = said(figures("unexplained", remaining=remaining))
    assert "no cause that this program knows accounts for it" in text
    assert "right hand (hand_r), 55 N (root mean square), on average 40 N up" in text
    assert "shaking camera" not in text
    swinging = location | {"depends_on": "time: it swings 4.2 times a second"}
    shaking = said(figures("unexplained", remaining=remaining | {"location": swinging}))
    assert "look first for a shaking camera" in shaking
    assert ". It swings 4.2 times a second. This is where" in shaking
    named = said(figures("unexplained", effects=[LATE], remaining=remaining | {"location": None}))
    found = "one cause was found (forces shifted in time against the markers [very sure of the name]), but"
    assert found in named
    assert "cannot be tied to one part of the body" in named


def test_what_is_on_no_list_is_told_as_what_it_touches():
    off = {"touches": "plate", "target": "plate_2", "trial": None, "rms_force_N": 120.0}
    remaining = {"linear_residual_N": 60.0, "noise_floor_N": 9.8, "location": None, "off_the_list": off}
    text = said(figures("unexplained", remaining=remaining))
    assert "Something is wrong with plate 2, 120 N (root mean square) while it is loaded" in text
    assert "cannot be tied" not in text
    time = off | {"touches": "time", "target": "walk1", "trial": "walk1"}
    assert "The time of the forces is off" in said(
        figures("unexplained", remaining=remaining | {"off_the_list": time})
    )
    force = off | {"touches": "body", "target": ""}
    assert "cannot be tied" in said(figures("unexplained", remaining=remaining | {"off_the_list": force}))


def test_lines_fit_a_terminal_and_a_longer_name_is_not_lost():
    long = effect("external_contact", "a_body_of_a_model_with_very_long_names_r", force_x_N=(40.0, 2.0))
    lines = as_text(page(figures(effects=[long, STEP], notes=[Note(Kind.OTHER, "a note " * 40)])), 80)
    assert max(map(len, (line for line in lines if not line.startswith("CAUSE")))) <= 80
    assert any("very_long_names_r" in line for line in lines)


def test_a_cause_without_words_is_still_told():
    odd = effect("moon_phase", "all", force_N=(3.0, 1.0))
    assert "moon phase (all)" in said(figures(effects=[odd]))


def test_the_verdict_says_what_the_recording_is_good_for():
    def use(verdict="explained", **more):
        return page(figures(verdict, **more))[0].lines[-1]

    assert use("clean").startswith("Use: no fault that was found speaks against angles and torques;")
    text = "marker RHEE is up to 45 cm off in frames 108-389"
    far = Note(Kind.FAR_MARKERS, text, trial="walk", values={"marker": "RHEE", "cm": 45})
    assert "But there are markers far from the model: RHEE 45 cm; slipped" in use("clean", notes=[far])
    held = "no marker at the left posterior spine (PSIS): the hips' flexion may be off by 15°"
    assert use("clean", notes=[Note(Kind.PELVIS, held)]).endswith(f"But there is {held}.")
    assert "far from" not in use("clean", notes=[Note(Kind.BARE_BODIES, f"{text}: the shoulder rose?")])
    blind = [{"id": "capture_scale", "target": "all", "parameter": "scale", "size": 2.0}]
    cannot = use("clean", detectable=blind)
    assert "torques, but it cannot show wrong scale of the camera calibration;" in cannot
    unknown = use("unexplained")
    assert "not for joint torques, before the cause is understood" in unknown
    assert "joint angles with care" in unknown
    assert "before what remains is understood" in use("unexplained", effects=[LATE])
    rest = {"linear_residual_N": 44.0, "noise_floor_N": 19.0, "location": None}
    assert use(effects=[LATE, PULLED], remaining=rest).endswith(
        "(`addb-viewer accept`), and then with care, since not all is explained (see what remains)."
    )
    assert use(effects=[LATE]).startswith("Use: for joint angles as it is; for joint torques only with the")
    larger = effect("capture_scale", "all", scale=(1.02, 0.001))
    assert (
        use(effects=[larger])
        == "Use: for joint torques only with the cause corrected (`addb-viewer accept`)."
    )
    assert "outside the frames named" in use(effects=[STEP])
    assert use(effects=[LATE, STEP], remaining=rest).endswith(
        "never for joint torques in the frames of the unmeasured step; elsewhere for joint torques only with "
        "the cause corrected (`addb-viewer accept`)."
    )
    slipped = use(effects=[effect("marker_slip", "RKNE", shift_m=(0.02, 0.001))])
    once = "only once this marker is corrected; else as it is."
    assert slipped == f"Use: for angles and torques of the joints near RKNE {once}"
    soft_tissue = use(effects=[effect("soft_tissue", "femur_l", rms_m=(0.015, 0.001))])
    assert soft_tissue == (
        "Use: not for angles and torques of the joints at the left thigh (femur_l): this cannot be corrected "
        "later; else as it is."
    )
    both = [effect("soft_tissue", "femur_l", rms_m=(0.015, 0.001)), effect("marker_swap", "RKNE+RANK")]
    soft_tissue = (
        "not for angles and torques of the joints at the left thigh (femur_l): this cannot be corrected later"
    )
    swapped = "for angles and torques of the joints near RKNE and RANK only once these markers are corrected"
    assert use(effects=both) == f"Use: {soft_tissue}; {swapped}; else as it is."
    assert use(effects=[both[0], LATE]) == (
        f"Use: {soft_tissue}; else for joint angles as it is; for joint torques only with the cause "
        "corrected "
        "(`addb-viewer accept`)."
    )
    heavy = rival("subject_mass", "clock_offset all", "the person on a scale")
    guessed = LATE | {"confidence": 0.6}
    assert "before it is known which cause" in use(effects=[guessed], alternatives=[heavy])
    assert "with the cause corrected" in use(effects=[LATE], alternatives=[heavy])
    elsewhere = rival("clock_offset", "clock_offset all", "a stamp")
    assert "with the cause corrected" in use(effects=[guessed], alternatives=[elsewhere])
    taken_off = effect("plate_bias", "plate_1", bias_y_N=(8.0, 0.1)) | {
        "sentence": PlateBiasTakenOff.about.sentence.format(target="plate_1")
    }
    assert "corrects the fault when it reads the files" in use(effects=[taken_off])
    assert "outside the frames named" in use(effects=[STEP, taken_off])


@pytest.mark.parametrize(("nats", "said"), [(95.0, "certainly"), (25.0, "very likely"), (9.0, "probably")])
def test_the_verdict_says_how_surely_something_is_wrong(nats, said):
    verdict = page(figures(effects=[LATE]) | {"evidence_nats": nats})[0].lines[0]
    assert verdict.startswith(f"Something is {said} wrong with the recording")


def test_a_moment_without_a_place_asks_for_the_plates_moments():
    residual = figures("unexplained")["residual"] | {"force_N": 5.0, "force_floor_N": 10.0}
    text = said(figures("unexplained") | {"residual": residual})
    assert "check the plates' free moments" in text
    pushing = figures("unexplained")["residual"] | {"moment_Nm": 5.0, "moment_floor_Nm": 10.0}
    assert "free moments" not in said(figures("unexplained") | {"residual": pushing})


def test_what_stays_beyond_the_ordinary_is_not_accounted_for():
    left = {"linear_residual_N": 44.0, "noise_floor_N": 19.0, "location": None}
    missing = "Forces are missing from the recording 'walk1', and one cause accounts for most of it"
    assert missing in said(figures(effects=[STEP], remaining=left))
    little = {"held_out_linear_residual_N": {"before": 80.0, "after": 44.0, "interval": [40.0, 48.0]}}
    assert "one cause accounts for much of it" in said(figures(effects=[LATE], remaining=left, gain=little))


def test_errors_that_are_ordinary_without_a_cause_do_not_decide():
    before = {"held_out_linear_residual_N": {"before": 4.7, "after": 2.4, "interval": [2.1, 2.6]}}
    assert "it does not decide" in said(figures(effects=[LATE], gain=before))
    assert "it does not decide" not in said(figures(effects=[LATE]))


def test_advice_from_before_the_causes_is_not_repeated_beside_them():
    carried = "the forces carry 61.2 ± 0.9 kg, 8.2 kg less than entered"
    note = Note(Kind.ENTERED_MASS, carried, advice="check the entered mass")
    assert "check the entered mass" not in said(figures(effects=[LATE], notes=[note]))
    assert "check the entered mass" in said(figures("unexplained", notes=[note]))


def test_a_rival_that_hardly_counts_has_not_no_share_at_all():
    band = rival("elastic_tether", "clock_offset all", target="torso") | {"confidence": 0.001}
    assert "an elastic band: trunk (torso) (less than 1 %)" in said(
        figures(effects=[LATE], alternatives=[band])
    )


def test_a_steady_weight_is_no_lead_only_because_masses_follow_it():
    lifted = effect("body_weight_support", "pelvis", force_N=(122.0, 7.0))
    same = {"held_out_linear_residual_N": {"before": 18.0, "after": 18.1, "interval": [17.0, 19.0]}}
    text = said(figures(effects=[lifted], gain=same))
    assert "tentative" not in text
    assert "how far the weight on the plates is from the entered one" in text


def test_hidden_stretches_say_nothing_of_a_mass():
    heavy = effect("subject_mass", mass_factor=(0.9, 0.01))
    same = {"held_out_linear_residual_N": {"before": 14.0, "after": 14.1, "interval": [12.0, 16.0]}}
    text = said(figures(effects=[heavy], gain=same))
    assert "cannot test a constant weight" in text
    assert "tentative" not in text


def test_a_rise_within_chance_is_no_rise():
    gain = {
        "held_out_linear_residual_N": {"before": 43.0, "after": 50.0, "interval": [42.0, 56.0]},
        "held_out_angular_residual_Nm": {"before": 15.6, "after": 8.9, "interval": [7.6, 10.0]},
    }
    text = said(figures(effects=[LATE], gain=gain))
    assert "Force is higher, but that may be chance (43 → 50 N)" in text
    assert "one cause accounts for it" in text


@pytest.mark.parametrize("verdict", ["explained", "unexplained"])
def test_what_the_plates_carry_is_told_where_it_is_not_what_was_entered(verdict):
    """Where causes account for all, there is no more to check."""
    carried = "the forces carry 67.8 ± 1.6 kg, 10.9 kg more than the 56.9 kg that were entered"
    note = Note(Kind.ENTERED_MASS, carried, advice="check the entered mass")
    text = said(figures(verdict, effects=[LATE], notes=[note, Note(Kind.OTHER, "a gap was bridged")]))
    at_once, wrong = text.split("WHAT IS WRONG")[0], text.split("WHAT IS WRONG")[1].split("CAUSE")[0]
    assert at_once.startswith("VERDICT The forces carry 67.8 ± 1.6 kg") == (verdict == "unexplained")
    assert ("check the entered mass" in at_once) == (verdict == "unexplained")
    assert ("before any cause is corrected" in wrong) == (verdict == "explained")
    assert "a gap was bridged" not in wrong


def test_of_causes_in_the_markers_only_the_markers_figures_are_told():
    """What the forces leave is as it was, and gave nothing away."""
    slip = effect("marker_slip", "RKNE", shift_m=(0.0152, 0.0004), time_s=(1.23, 0.01))
    gain = {"held_out_linear_residual_N": FORCE, "marker_rms_m": {"before": 0.004, "after": 0.002}}
    text = said(figures(effects=[slip], gain=gain))
    assert "4.0 → 2.0 mm" in text
    assert "→ 12 N" not in text
    assert "its pattern" not in text
    assert "Forces are compared with slipped or swapped markers corrected" in text


def test_of_several_trials_the_verdict_says_which_is_wrong():
    """A load that is worn in one of two spoils only that one."""
    worn = effect("carried_mass", "tibia_l", mass_kg=(3.0, 0.1)) | {"frames": [["walk2", 0, 300]]}
    short = page(figures(effects=[worn], trials=["walk1", "walk2"]))[0].lines
    assert "wrong with the recording 'walk2' (of walk1 and walk2)" in short[0]
    assert short[-1].startswith("Use: walk1 as it is. walk2: for joint angles as it is;")
    soft_tissue = effect("soft_tissue", "femur_l", rms_m=(0.015, 0.001)) | {"frames": [["walk2", 0, 300]]}
    short = page(figures(effects=[soft_tissue], trials=["walk1", "walk2"]))[0].lines
    assert "walk1 as it is" not in short[-1]  # soft tissue slides in every trial
    rest = {"linear_residual_N": 44.0, "noise_floor_N": 19.0, "location": None}
    short = page(figures(effects=[worn], trials=["walk1", "walk2"], remaining=rest))[0].lines
    assert "walk1 as it is" not in short[-1]  # who knows where the rest is
    three = ["walk1", "walk2", "walk3"]
    two = worn | {"frames": [["walk1", 0, 300], ["walk2", 0, 300]]}
    short = page(figures(effects=[two], trials=three))[0].lines
    assert "wrong with recordings walk1 and walk2 (of walk1, walk2 and walk3)" in short[0]
    both = worn | {"frames": [["walk1", 0, 300], ["walk2", 0, 300]]}
    short = page(figures(effects=[both], trials=["walk1", "walk2"]))[0].lines
    assert "wrong with these recordings (walk1 and walk2)" in short[0]
    assert short[-1].startswith("Use: for joint angles as it is;")


def test_what_was_tried_is_told_unless_the_answer_is_that_nothing_was_found():
    for verdict, effects in (("explained", [LATE]), ("unexplained", [])):
        text = said(figures(verdict, effects=effects))
        assert "Tried, each alone and together with the others: forces shifted in time" in text
        assert "a drag or tow" in text
    assert "Tried, each alone" not in said(figures("clean"))


def test_a_distance_has_no_more_digits_than_its_place():
    vague = effect(
        "external_contact",
        "pelvis",
        force_y_N=(-45.0, 2.0),
        point_x_m=(-0.011, 0.031),
        point_y_m=(-0.008, 0.099),
        point_z_m=(0.052, 0.048),
    )
    assert amounts(vague)[-1] == "where on the segment it acts, this recording does not show"
    assert amounts(vague)[0] == "45 ± 4 N downwards"
    known = vague | {"parameters": vague["parameters"] | {"point_y_m": {"value": -0.2, "std": 0.099}}}
    assert "it acts 207 ± 198 mm from" in amounts(known)[-1]


def test_what_is_hardly_there_is_told_only_where_nothing_else_is():
    askew = effect("plate_position", "plate_1", shift_x_m=(0.0002, 0.0015), shift_z_m=(-0.012, 0.002))
    assert amounts(askew) == ["the files place it 12 ± 4 mm too far towards −z"]
    nothing = effect("plate_position", "plate_1", shift_x_m=(0.0002, 0.0015), shift_z_m=(-0.001, 0.002))
    assert len(amounts(nothing)) == 2


def test_notes_that_ask_what_the_causes_answer_are_told_as_older():
    noted = [Note(Kind.OTHER, "the fit moved the body's mass: is something carried?")]
    assert notes(figures(notes=noted)).lines == tuple(noted)
    first, second = notes(figures(effects=[LATE], notes=noted)).lines
    assert "before causes were looked for" in first
    assert second == noted[0]
    assert notes(figures(effects=[LATE])).lines == ()


def test_causes_that_look_alike_are_to_be_told_apart_before_they_are_accepted():
    heavy = rival("subject_mass", "clock_offset all", "the person on a scale")
    text = said(figures(effects=[LATE | {"confidence": 0.6}], alternatives=[heavy]))
    assert "First tell apart the causes that look alike here" in text.split("WHAT NEXT")[1]
    stepped = said(figures(effects=[STEP, LATE | {"confidence": 0.6}], alternatives=[heavy]))
    flag = "Flag the frames of the unmeasured step first"
    assert f"{flag}, as shown above, or repeat the trial. Then tell apart the causes" in stepped
    assert flag not in text
    sure = said(figures(effects=[LATE], alternatives=[heavy]))
    assert "First tell apart" not in sure.split("WHAT NEXT")[1]


def test_what_is_left_for_other_causes_is_told_with_those_that_are_listed():
    heavy = rival("subject_mass", "clock_offset all", "the person on a scale") | {"confidence": 0.2}
    unsure = said(figures(effects=[LATE | {"confidence": 0.5}], alternatives=[heavy]))
    assert "wrong body mass (20 %); anything else (30 %)" in unsure
    sure = said(figures(effects=[LATE | {"confidence": 0.78}], alternatives=[heavy]))
    assert "anything else" not in sure


def test_how_frames_are_counted_is_told_where_frames_are():
    counted = "Frames are counted from 0; `flag` takes the first one and the one after the last."
    assert counted in said(figures(effects=[STEP]))
    assert counted not in said(figures(effects=[LATE]))


@pytest.mark.parametrize("id", [*IDS, *MARKER_IDS])
@pytest.mark.parametrize("size", [0.5, -0.5])
def test_every_reading_of_every_cause_can_be_said(id, size):
    """Whatever its sense and sign: a reading that lacks a word would take the whole page with it."""
    for reading in ABOUT[id].readings:
        if isinstance(reading, Reading):
            parameter = reading.parameter.replace(OF_EACH_TRIAL, "Walk 01")
            told = amounts(effect(id, "plate_1", **{parameter: (reading.zero + size, 0.01)}))
            assert told
            assert "{" not in " ".join(told)


def test_the_verdict_says_whose_fault_it_is():
    assert "At fault: the recording." in said(figures(effects=[LATE]))
    both = said(figures(effects=[LATE, PULLED, LATE]))
    assert "At fault: the recording (1, 3); a force that no plate measures" in both
    doubtful = effect(confidence=0.6)
    instead = rival("wobbling_mass", "clock_offset all", target="torso")
    assert "At fault: the recording, or else the model" in said(
        figures(effects=[doubtful], alternatives=[instead])
    )


def test_where_nothing_is_named_a_chance_is_stated():
    chances = {"nothing": 0.88, "on_the_list": 0.09, "something_else": 0.03}
    assert "The chance that nothing is wrong: 88 %" in said(figures("clean", chances=chances))
    chances = {"nothing": 0.01, "on_the_list": 0.04, "something_else": 0.95}
    assert "The chance that it is none of the known causes: 95 %" in said(
        figures("unexplained", chances=chances)
    )


def test_what_is_only_large_is_not_called_wrong_with_a_chance_of_one_percent():
    chances = {"nothing": 0.88, "on_the_list": 0.11, "something_else": 0.01}
    text = said(figures("unexplained", chances=chances))
    assert "differ by more than they do in sound recordings" in text
    assert "recording or model may be at fault" in text
    assert "The chance" not in text
    assert "Something is" not in text


ASKED = ToBeSure(
    *("plate_gain", "plate_2", "body_weight_support", "pelvis", 9.0),
    odds_after=310.4,
    trial="stand",
    plates=("plate_2",),
    words="stand still on plate_2 for 3 s",
    nats=10.6,
)
GAIN = effect("plate_gain", "plate_2", confidence=0.8, gain_error=(-0.041, 0.0015))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, "Stand still on plate 2 for 3 s. That tells it from an unmeasured support: pelvis; expected, "),
        ({}, "expected, if it is right: 9 to 1 become 310 to 1."),
        ({"odds": 1.2, "odds_after": 1e5}, "if it is right: even odds become more than 1000 to 1."),
        ({"odds": 0.25, "odds_after": 4.0}, "if it is right: 1 to 4 become 4 to 1."),
        ({"other_id": "plate_gain", "other_target": "plate_1"}, "That tells it from the same at plate 1;"),
        ({"other_id": "nothing", "other_target": ""}, "That tells it from nothing being wrong;"),
        ({"other_id": "outside_the_list"}, "That tells it from something that is on no list;"),
        ({"trial": None}, "no short trial of the list would tell it from an unmeasured support: pelvis"),
    ],
)
def test_the_trial_that_would_decide_stands_with_its_cause_alone(changes, words):
    answer = figures(effects=[GAIN, LATE], to_be_sure=plain(replace(ASKED, **changes)))
    first, second = said(answer).split("CAUSE 2")
    assert words in first.split("to be sure, record ")[1]
    assert "to be sure" not in second
    on_a_screen = " ".join(" ".join(as_text(words_of.screen(told(answer)))).split())
    assert words in on_a_screen
    assert "to be sure" not in said(figures(effects=[GAIN, LATE]))


def test_a_screen_points_to_nothing_that_it_does_not_print():
    seen = Note(Kind.DETECTED, "detection sees calcn_r stand on no plate", trial="walk1")
    answer = figures(effects=[LATE, STEP], notes=[seen])
    on_a_screen = " ".join(" ".join(as_text(words_of.screen(told(answer)))).split())
    assert seen in on_a_screen
    assert "what next" not in on_a_screen


@pytest.mark.parametrize(
    ("decided", "confidence", "words"),
    [
        (
            True,
            0.97,
            "Stand decided between wrong gain of plate 2 (now 97 %) and an unmeasured support: pelvis.",
        ),
        (
            True,
            0.0,
            "Stand decided between wrong gain of plate 2 (not named any more) and an unmeasured support",
        ),
        (
            False,
            0.7,
            "Stand did not decide between wrong gain of plate 2 (now 70 %) and an unmeasured support",
        ),
    ],
)
def test_what_the_further_trial_decided_is_said(decided, confidence, words):
    answer = figures(effects=[GAIN], after_trial=plain(AfterTrial(ASKED, ("stand",), decided, confidence)))
    assert words in said(answer)
    assert words in " ".join(" ".join(as_text(words_of.screen(told(answer)))).split())
