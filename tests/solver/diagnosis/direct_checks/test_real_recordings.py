"""Direct checks on real people: quiet on sound stretches, and heard once a fault was edited in."""

import numpy as np
import pytest

from benchmarks.faults.editor import edits, plates
from benchmarks.faults.editor.recording import write_folder
from benchmarks.faults.editor.sources import SOURCES
from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import READING, read_trial
from solver.diagnosis.direct_checks.measured import measure_trials
from solver.diagnosis.direct_checks.run_checks import run_checks
from solver.diagnosis.direct_checks.statement import STATED_NATS, About

pytestmark = pytest.mark.real
SET_ON = ("walk_rajagopal2015", "overground_falisse_AdDB", "opencap_subject6")
JUDGING = [source for source in SOURCES if source.person not in SET_ON]
BY_NAME = {source.name: source for source in JUDGING}


def with_evidence(folder, recording):
    """What the direct checks say of a recording, through the files as anybody's."""
    write_folder(folder, recording)
    subject = open_subject(folder)
    captures = [read_trial(files, READING, subject.mass_kg) for files in subject.trials]
    return run_checks(measure_trials(captures, READING), subject.mass_kg)


def spoken(said):
    return {about for one in said for about in one.spoken_for(STATED_NATS)}


@pytest.mark.parametrize("source", JUDGING, ids=lambda source: source.name)
def test_sound_stretches_leave_all_direct_checks_quiet(real_data, tmp_path, source):
    said = with_evidence(tmp_path / "as it is", source.read(real_data))
    assert len(said) > 3
    assert {one.sentence for one in said if one.spoken_for(STATED_NATS)} == set()


@pytest.mark.parametrize(
    ("name", "edit", "heard_of"),
    [
        ("walk over plates F", edits.late([0.06]), (About.CLOCK, "lag")),
        ("treadmill run C", edits.late([0.04]), (About.CLOCK, "lag")),
        ("two walks over plates F", edits.late([0.0, 0.03]), (About.CLOCK, "lag")),
        ("treadmill walk A", plates.pounds(), (About.PLATE_SCALE, "weight")),
        ("treadmill run C", plates.gain(0.5), (About.PLATE_SCALE, "weight")),
        ("standing on two plates D", plates.gain(0.5), (About.PLATE_SCALE, "exchange between plates")),
        ("treadmill walk A", edits.somebody_elses_mass(1.25), (About.ENTERED_MASS, "weight")),
        ("standing on two plates D", plates.standing_object(16.0, 0.2), (About.LOAD, "weight")),
        ("two treadmill walks A", plates.standing_object(9.0, 0.2), (About.LOAD, "weight")),
        ("standing on two plates D", edits.supported(0.2), (About.LOAD, "weight")),
        ("treadmill walk I", plates.turned(180.0), (About.PLATE_TURN, "path of the pressure")),
        ("treadmill run C", plates.turned(90.0), (About.PLATE_TURN, "path of the pressure")),
        ("walk over plates F", plates.mirrored(0), (About.PLATE_TURN, "path of the pressure")),
        ("drop jump H", plates.shifted(0.2, 70.0), (About.PLATE_PLACE, "path of the pressure")),
        ("treadmill walk A", plates.shifted(0.15, 200.0), (About.PLATE_PLACE, "path of the pressure")),
        ("squats F", plates.shifted(0.2, 10.0), (About.PLATE_PLACE, "path of the pressure")),
    ],
)
def test_a_fault_edited_in_is_heard(real_data, tmp_path, name, edit, heard_of):
    about, direct_check = heard_of
    recording, fault = edit(BY_NAME[name].read(real_data), np.random.default_rng(4))
    said = [one for one in with_evidence(tmp_path / "edited", recording) if one.direct_check == direct_check]
    assert about in spoken(said), fault.what


@pytest.mark.parametrize(
    ("name", "late_s"), [("treadmill run C", 0.06), ("treadmill run C", -0.06), ("treadmill walk I", 0.1)]
)
def test_beside_a_lag_nothing_is_said_that_it_explains(real_data, tmp_path, name, late_s):
    """Plates seemed to be elsewhere, turned, or to read multiples."""
    recording, _ = edits.late([late_s])(BY_NAME[name].read(real_data), np.random.default_rng(4))
    assert spoken(with_evidence(tmp_path / "late", recording)) == {About.CLOCK}


WHOLE = {  # recordings as they are, and what their files are known to hold
    "exo_apo_gordon": set(),  # a device of 7 kg in one trial: as much as stated masses are off
    "overground_camargo2021_AB06": {About.PLATE_SCALE, About.PLATE_ZERO, About.OFF_PLATE},  # 30 kg beside
    "walk_gait2354_subject01": set(),
    "run_treadmill_hamner2013_subject04": set(),
    "opencap_subject4": set(),  # with a chair that bears the person for a while
    "opencap_reviewed": set(),  # with a box that does
    "c3d_lab_trials/opensim_core": set(),
    "anomalies/tiziana2019_lencioni": set(),
    "anomalies/UpsideDownData": set(),  # nobody on any plate
}


@pytest.mark.parametrize("folder", WHOLE)
def test_of_whole_recordings_those_are_heard_whose_files_are_known_to_hold_something(real_data, folder):
    """Figures are finite whatever the recording lacks: they go into JSON."""
    subject = open_subject(real_data / folder)
    captures = [read_trial(files, READING, subject.mass_kg) for files in subject.trials]
    said = run_checks(measure_trials(captures, READING), subject.mass_kg)
    assert spoken(said) == WHOLE[folder]
    figures = [value for one in said for value in (*one.nats.values(), *one.figures.values())]
    assert np.isfinite(figures).all()


def test_a_marker_that_slips_is_named(real_data, tmp_path):
    source = BY_NAME["treadmill walk A"]
    edit = edits.slipped(0.04)
    recording, fault = edit(source.read(real_data), np.random.default_rng(1))
    said = [
        one for one in with_evidence(tmp_path / "slipped", recording) if one.direct_check == "rigid distances"
    ]
    loud = max(said, key=lambda one: one.loudest)
    assert fault.markers[0] in loud.target.split("+")
    assert loud.figures["time_s"] == pytest.approx(fault.times_s[0], abs=0.05)


def test_a_run_that_was_low_passed_at_5_Hz_has_lost_its_edges(real_data, tmp_path):
    recording, _ = edits.smoothed(5.0)(BY_NAME["treadmill run C"].read(real_data), np.random.default_rng(0))
    said = [
        one
        for one in with_evidence(tmp_path / "smooth", recording)
        if one.direct_check == "edges of contacts"
    ]
    assert said[0].figures["quick_share"] < 0.3 * said[0].figures["usual_share"]
    assert said[0].nats[About.FILTER] > 0
