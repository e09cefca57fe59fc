"""Markers of the pelvis: plainly named, they hold it; where one is missing, a note says so."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_static, read_trial
from solver.fitting.settings import Settings
from solver.kinematics.calibration import calibrate, choose_frames
from solver.kinematics.hip_width import expected_hip_width
from solver.kinematics.inverse_kinematics import inverse_kinematics
from solver.kinematics.marker_naming import name_markers
from solver.kinematics.settings import KinematicsSettings
from solver.kinematics.upright_pelvis import pitch_of_spines
from solver.markers.understanding import understand
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.osim import load_skeleton

SETTINGS = KinematicsSettings()
OWN_MODEL = {"opencap_subject4": "walking1", "overground_camargo2021_AB06": "levelground_ccw_fast_01_01"}
NAMED = re.compile(r"(?i)([rl])[._]?(asis|psis)")
SPELLINGS = (
    "{S}.{L}", "{s}_{l}", "{l}.{S}", "{Side} {L}", "{Side}{L}", "Subj 1:{S}.{L}", "S01_{S}{L}",
    "Pelvis_{S}{L}", "PELVIS.{S}.{L}", "hip_{S}{L}", "waist.{s}{l}", "M_{S}{L}", "{S}-{L}", "{S}{L}_marker",
    "T1.{side}_{l}",
)  # fmt: skip


@cache
def recordings_of(folder, trial):
    subject = open_subject(folder)
    found = [read_trial(next(t for t in subject.trials if t.name == trial), Settings().reading).markers]
    if subject.static:
        found.append(read_static(subject.static, Settings().reading).markers)
    return subject, found


def named_on(subject, recordings, *, default_body):
    model = default_skeleton() if default_body else load_skeleton(subject.model)
    return name_markers(model, recordings, default_body=default_body)


def on_pelvis(named):
    skeleton = named.match.skeleton(named.skeleton)
    pelvis = skeleton.body_index("pelvis")
    return {
        label
        for marker, labels in zip(skeleton.markers, named.match.measured, strict=True)
        if marker.body == pelvis
        for label in labels
    }


def spelled(label, spelling):
    found = NAMED.fullmatch(label)
    if not found:
        return label
    side, spine = found[1].lower(), found[2].lower()
    word = {"r": "right", "l": "left"}[side]
    return spelling.format(
        S=side.upper(), s=side, L=spine.upper(), l=spine, Side=word.capitalize(), side=word
    )


@pytest.mark.parametrize("spelling", SPELLINGS)
@pytest.mark.parametrize("default_body", [False, True])
@pytest.mark.parametrize("folder", OWN_MODEL)
def test_plainly_named_spines_hold_the_pelvis(real_data, folder, default_body, spelling):
    subject, recordings = recordings_of(real_data / folder, OWN_MODEL[folder])
    recordings = [replace(r, names=tuple(spelled(n, spelling) for n in r.names)) for r in recordings]
    spines = {spelled(f"{s}.{n}", spelling) for s in "RL" for n in ("ASIS", "PSIS")}
    assert spines <= on_pelvis(named_on(subject, recordings, default_body=default_body))


def test_points_that_are_made_from_spines_are_none():
    labels = ("RASI", "LASI", "SACR", "mid_ASIS", "RASI_LASI_mid", "virtual_RPSI", "offset.R.ASIS")
    rows = understand(labels).by_label()
    assert [rows[label].landmark for label in labels[:3]] == ["asis_r", "asis_l", "sacrum"]
    assert not any(rows[label].used and rows[label].landmark in ("asis_r", "asis_l") for label in labels[3:])


@pytest.mark.parametrize(
    ("folder", "trial"),
    [
        ("opencap_subject4", "walking1"),
        ("walk_gait2354_subject01", "walk1"),
        ("run_treadmill_hamner2013_subject04", "run400"),
        ("exo_apo_gordon", "NE21"),
        ("c3d_lab_trials/lasem_FAILT01", "Walk01"),
        ("anomalies/tiziana2019_lencioni", "trial"),
    ],
)
def test_a_marker_of_the_pelvis_that_is_gone_is_noted(real_data, folder, trial):
    subject, recordings = recordings_of(real_data / folder, trial)
    spine = re.compile(r"(?i)[rlv]?x?[._]?(asis?|psis?|sacr|sacral)")
    labels = {n for r in recordings for n in r.names if spine.fullmatch(n)}
    assert len(labels) >= 3
    for default_body in [True] if subject.model is None else [True, False]:
        assert not pelvis_note(named_on(subject, recordings, default_body=default_body))
        for gone in labels:
            rest = [without(r, gone) for r in recordings]
            assert pelvis_note(named_on(subject, rest, default_body=default_body)), gone


@pytest.mark.slow
@pytest.mark.parametrize(
    ("folder", "trial"), [("opencap_subject4", "walking1"), ("walk_gait2354_subject01", "walk1")]
)
def test_the_pelvis_stays_where_it_was_when_one_of_its_markers_is_gone(real_data, folder, trial):
    subject, recordings = recordings_of(real_data / folder, trial)
    whole = pelvis_angles(subject, recordings)
    labels = {n for n in recordings[0].names if re.fullmatch(r"(?i)[rl][._]?(asis|psis)", n)}
    assert len(labels) >= 2
    for gone in labels:
        rest = [without(r, gone) for r in recordings]
        off = pelvis_angles(subject, rest) - whole
        assert np.abs(off.mean(axis=0)).max() < 4.0, gone
        assert off.std(axis=0).max() < 3.0, gone


def test_a_pelvis_without_any_marker_in_front_or_behind_is_said_to_have_no_sure_tilt(real_data):
    subject, recordings = recordings_of(real_data / "walk_gait2354_subject01", "walk1")
    for gone, unsure in (("V.Sacral", True), ("R.ASIS", False)):
        rest = [without(r, gone) for r in recordings]
        note = " ".join(pelvis_note(named_on(subject, rest, default_body=True)))
        assert ("only legs and trunk tell its tilt" in note) is unsure


def pelvis_angles(subject, recordings):
    """Of the default body on a fifth of the trial's frames [°]."""
    named = name_markers(default_skeleton(mass_kg=subject.mass_kg), recordings, default_body=True)
    shared, observed = named.match.skeleton(named.skeleton), named.match.observed
    static = observed(recordings[1]) if len(recordings) > 1 else None
    found = calibrate(
        shared,
        choose_frames([observed(recordings[0])], static, SETTINGS),
        SETTINGS,
        hip_width_m=expected_hip_width(named.landmarks, named.match, recordings),
        pitch_of_spines=pitch_of_spines(shared, named.landmarks),
    ).skeleton
    q = inverse_kinematics(found, observed(recordings[0])[::5], recordings[0].rate / 5, SETTINGS)
    return np.degrees(q[:, [found.dofs.index(f"pelvis_{a}") for a in ("tilt", "list", "rotation")]])


def pelvis_note(named):
    return [note for note in named.match.notes if "the pelvis is held by" in note]


def without(recording, label):
    kept = [i for i, name in enumerate(recording.names) if name != label]
    return replace(
        recording,
        names=tuple(recording.names[i] for i in kept),
        positions_ground=recording.positions_ground[:, kept],
    )
