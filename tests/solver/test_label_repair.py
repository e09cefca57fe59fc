"""Labels exchanged and crashed in files: the fit repairs them and says so, the diagnosis names them as ever.

The faults are put into the recording by hand. A repaired exchange gives back the recording, so the poses are
the same to rounding; a masked label is missing, and the pose rests on the others of its segment.
"""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_trial
from solver.common.progress import silent
from solver.common.typed_json import plain
from solver.diagnosis.diagnose_subject import repaired_balance
from solver.dynamics.trajectory.extension import Extension
from solver.fitting.pipeline import resolve, solve
from solver.fitting.results.store import load_fit, save_fit
from solver.fitting.settings import Settings
from solver.fitting.summary import all_notes, summary
from solver.kinematics.label_faults.fault import EXCHANGED, MASKED, Exchange
from solver.simulate.subject_folder import write_subject
from tests.conftest import MARKERS_ALONE
from tests.flagged import flagged
from tests.measured_walk import WOMAN, measured_walk

pytestmark = pytest.mark.slow  # their fixtures take long

UNREPAIRED = replace(MARKERS_ALONE, label_repair=replace(MARKERS_ALONE.label_repair, enabled=False))
SAME_DEG = 1e-3
MASKED_DEG = 1.5  # without a label the others' skin says more: largest change of any angle on any frame


def angles_apart_deg(one, other):
    """The largest difference of any joint angle, on any frame [deg]."""
    turning = [i for i, c in enumerate(one.skeleton.free_coordinates) if c.motion == "rotation"]
    apart = one.trials[0].motion.q[:, turning] - other.trials[0].motion.q[:, turning]
    return float(np.degrees(np.abs(apart).max()))


def spoilt(markers: Markers, pair, swapped, labels, crashed) -> Markers:
    """A pair exchanged on some frames, and on others one label on another one's trajectory."""
    recorded, x = markers.positions_ground, markers.positions_ground.copy()
    a, b, label, onto = (markers.names.index(name) for name in (*pair, *labels))
    x[slice(*swapped), [a, b]] = recorded[slice(*swapped), [b, a]]
    x[slice(*crashed), label] = recorded[slice(*crashed), onto]
    return replace(markers, positions_ground=x)


PAIR, SWAPPED, CRASH, ONTO, CRASHED = ("RTH1", "RTH3"), (60, 130), "LASI", "LPSI", (150, 190)


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """A walker's folder, and the same with an exchanged pair and a label on another one's trajectory."""
    recorded = measured_walk(gaps_per_marker_minute=0.0)
    faulty = replace(recorded, markers=spoilt(recorded.markers, PAIR, SWAPPED, (CRASH, ONTO), CRASHED))
    made = []
    for name, capture in (("sound", recorded), ("faulty", faulty)):
        folder = tmp_path_factory.mktemp(name)
        write_subject(folder, WOMAN, [capture])
        made.append(open_subject(folder))
    return made


@pytest.fixture(scope="module")
def fits(folders):
    sound, faulty = folders
    return solve(sound, MARKERS_ALONE), solve(faulty, MARKERS_ALONE), solve(faulty, UNREPAIRED)


def test_sound_labels_are_left_alone(fits):
    assert fits[0].trials[0].label_faults == ()


def test_both_faults_are_repaired_and_the_pose_is_that_without_them(fits):
    sound, corrected, unrepaired = fits
    swap, crash = corrected.trials[0].label_faults
    assert (set(swap.labels), swap.start, swap.end, swap.done) == (set(PAIR), *SWAPPED, EXCHANGED)
    assert (crash.labels, crash.start, crash.end, crash.onto) == ((CRASH,), *CRASHED, ONTO)
    assert crash.done == MASKED
    assert angles_apart_deg(corrected, sound) < MASKED_DEG < 2.0 < angles_apart_deg(unrepaired, sound)
    assert corrected.trials[0].marker_errors.maximum < 1.1 * sound.trials[0].marker_errors.maximum


def test_notes_and_figures_tell(fits):
    corrected = fits[1]
    notes = [note for note in all_notes(corrected) if "label" in note]
    assert any(note.startswith("walk: labels ") and "frames 60-129" in note for note in notes)
    assert any(f"label {CRASH} lay on the trajectory of {ONTO} in frames 150-189" in note for note in notes)
    swap, crash = plain(summary(corrected))["trials"][0]["label_faults"]
    assert (swap["done"], swap["frames"], swap["frames_with_markers"]) == ("exchanged", [60, 130], 70)
    assert (crash["done"], crash["frames"], crash["onto"]) == ("masked", [150, 190], ONTO)
    column = corrected.trials[0].marker_errors.names.index(CRASH)
    unseen = ~np.isfinite(corrected.trials[0].marker_errors.distance[:, column])
    np.testing.assert_array_equal(np.flatnonzero(unseen), np.arange(*CRASHED))  # left out of every figure


def test_kept_with_the_fit_and_through_an_edit(fits, tmp_path):
    corrected = fits[1]
    save_fit(corrected, tmp_path)
    kept = load_fit(tmp_path, corrected.subject.folder)
    assert kept.trials[0].label_faults == corrected.trials[0].label_faults
    again = resolve(kept, {"walk": flagged((0, 20, None, "manualReview"))}, MARKERS_ALONE)
    assert again.trials[0].label_faults == corrected.trials[0].label_faults
    assert angles_apart_deg(again, corrected) < SAME_DEG


def test_a_persons_word_alone_exchanges_back(folders, fits):
    sound, faulty = folders
    word = Exchange("walk", PAIR, *SWAPPED)
    accepted = Extension((), np.zeros(0), np.zeros(0), exchanges=(word,))
    fit = solve(faulty, UNREPAIRED, extension=accepted)
    (swap,) = fit.trials[0].label_faults
    assert swap.accepted
    assert any("marker_swap (RTH1+RTH3)" in note for note in fit.notes)
    before, after = solve(sound, UNREPAIRED).trials[0].capture, fit.trials[0].capture
    columns = [before.markers.names.index(name) for name in PAIR]
    np.testing.assert_array_equal(
        after.markers.positions_ground[:, columns], before.markers.positions_ground[:, columns]
    )


def test_the_diagnosis_names_the_exchange_as_if_no_fit_repaired_it(folders):
    _, seen, fit = repaired_balance(folders[1], Settings(), trials=None, reviews={}, progress=silent)
    (swap,) = [f for f in seen.findings if f.id == "marker_swap"]
    assert set(swap.target.split("+")) == set(PAIR)
    assert (swap.frames.start, swap.frames.end) == SWAPPED
    assert fit.trials[0].label_faults == ()


@pytest.mark.real
def test_in_a_recorded_walk(real_data):
    """Beside two static trials and all the skin of a real person."""
    subject = open_subject(real_data / "walk_rajagopal2015")
    (files,) = subject.trials
    capture = read_trial(files)
    fault = spoilt(capture.markers, ("R.ASIS", "L.ASIS"), (70, 120), ("L.TH2", "L.TH3"), (140, 175))
    sound = solve(subject, MARKERS_ALONE)
    corrected, unrepaired = (
        solve(subject, settings, captures={files.name: replace(capture, markers=fault)})
        for settings in (MARKERS_ALONE, UNREPAIRED)
    )
    assert sound.trials[0].label_faults == ()
    swap, crash = corrected.trials[0].label_faults
    assert (set(swap.labels), swap.start, swap.end) == ({"R.ASIS", "L.ASIS"}, 70, 120)
    assert (crash.labels, crash.start, crash.end, crash.onto) == (("L.TH2",), 140, 175, "L.TH3")
    assert angles_apart_deg(corrected, sound) < MASKED_DEG < 5.0 < angles_apart_deg(unrepaired, sound)


@pytest.mark.real
def test_a_flickering_label_of_a_recording_is_masked_and_nothing_else(real_data):
    """R_ASIS leaves the pelvis on three frames of a second in which it comes and goes, 8 cm in the mean."""
    subject = open_subject(real_data / "overground_camargo2021_AB06")
    (trial,) = solve(subject, MARKERS_ALONE).trials
    (fault,) = trial.label_faults
    assert (fault.labels, fault.start, fault.end, fault.frames) == (("R_ASIS",), 293, 302, 3)
