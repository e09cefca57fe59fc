"""`accept`, `reject`, and the fit after them; the diagnosis' own work is put aside."""

import json
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from addb_viewer.jobs import accepting
from addb_viewer.jobs.accepted_extension import kept_gain
from addb_viewer.jobs.kept_diagnosis import keep
from solver.common.typed_json import plain
from solver.diagnosis.diagnosis import Gain
from solver.diagnosis.diagnosis_report import AcceptedGain, TorqueChanges, told_causes
from solver.dynamics.trajectory.extension import BodyWrench, Cause, Extension, TrialExtension
from solver.fitting.provenance import provenance_of
from solver.fitting.results.extension_log import decisions, standings
from solver.fitting.settings import as_dict, settings_for
from solver.kinematics.label_faults.fault import Exchange
from tests.addb_viewer.told_diagnosis import told

CLOCK = {
    "id": "clock_offset",
    "target": "all",
    "parameters": {"offset_s": {"value": 0.01, "std": 0.001}},
    "frames": [[0, 100]],
}
LOAD = {"id": "carried_mass", "target": "torso", "parameters": {}, "frames": [[0, 100]]}
SWAP = {"id": "marker_swap", "target": "LTOE+LMT5", "parameters": {}, "frames": [[40, 90]]}
SLIP = {
    "id": "marker_slip",
    "target": "LTOE",
    "parameters": {"shift_m": {"value": 0.02, "std": 0.001}},
    "frames": [[0, 100]],
}


@pytest.fixture
def extension():
    wrench = BodyWrench(None, np.zeros((4, 6)), np.ones((4, 6, 1)))
    yes = np.ones(4, dtype=bool)
    cause = Cause("clock_offset", "all", {"offset_s": (0.01, 0.001)})
    return Extension((cause,), np.ones(1), np.ones(1), {"walk": TrialExtension((wrench,), yes, yes)})


GAIN = AcceptedGain(
    (),
    (),
    held_out_linear_residual_N=Gain(41.0, 12.2, (11.0, 13.9)),
    held_out_angular_residual_Nm=Gain(19.5, 8.1, (7.2, 9.0)),
    held_out_linear_drop_N=(20.0, 30.0),
    held_out_angular_drop_Nm=(8.0, 13.0),
    held_out_frames=110,
    held_out_blocks=5,
    joint_torque_change=TorqueChanges({"hip_flexion_r": 12.34}, {"hip_flexion_r": 40.0}, ("hip_flexion_r",)),
)


@dataclass
class Found:
    """In place of the causes that were found again."""

    extension: Extension
    undone: tuple[tuple[str, str], ...] = (("plate_bias", "plate_1"),)
    flagged: tuple[tuple[str, str], ...] = (("off_plate_step", "calcn_r"),)
    fit: str = "of the markers"

    def causes_at(self, x):
        """The clock as the trajectory fit has it; of the drift it knows nothing."""
        return (Cause("clock_offset", "all", {"offset_s": (float(x[0]), 0.001), "odd": (0.0, np.inf)}),)


@pytest.fixture
def asked(monkeypatch, extension):
    """The causes that the solver was asked for; it finds them all."""
    causes = []

    def extension_for(subject, settings, wanted, **_):
        causes.append(wanted)
        if [*wanted] == [("clock_offset", "all")]:
            return Found(extension)
        return Found(replace(extension, causes=tuple(Cause(*key, {}) for key in wanted)))

    def gained(_, causes, exchanges):
        return replace(GAIN, causes=told_causes(causes))

    def extended_fit(fit, of, settings, progress):
        assert fit == "of the markers"
        progress("trajectories", 0.5)
        return SimpleNamespace(fit=SimpleNamespace(extra=np.array([0.011])))

    monkeypatch.setattr(accepting, "extension_for", extension_for)
    monkeypatch.setattr(accepting, "extended_fit", extended_fit)
    monkeypatch.setattr(accepting, "accepted_gain", gained)
    return causes


@pytest.fixture
def diagnosed(command_line):
    def write(*effects):
        subject = command_line.subject
        made_from = {
            "provenance": provenance_of(subject, subject.trials),
            "settings": as_dict(settings_for(subject.folder)),
        }
        figures = {"verdict": "explained", "effects": list(effects), "trials": ["walk"]}
        keep(told(figures), made_from, subject.folder / "results")

    return write


def test_an_accepted_cause_reaches_the_next_fit(command_line, diagnosed, asked, extension):
    folder = command_line.subject.folder
    command_line("fit", folder)
    diagnosed(CLOCK)
    run = command_line("accept", folder, "--author", "Anna")
    assert run.exit_code == 0, run.output
    assert "accepted by Anna: clock_offset (all)" in run.stdout
    assert [set(causes) for causes in asked] == [{("clock_offset", "all")}]
    command_line("fit", folder)
    assert command_line.extensions[-1].fingerprint == extension.fingerprint
    assert len(command_line.solves) == 2
    assert "unchanged" in command_line("fit", folder).stdout
    command_line("fit", folder, "--without-extension")
    assert command_line.extensions[-1] is None


def test_a_lead_is_accepted_only_where_nothing_else_is_named(command_line, diagnosed, asked):
    folder = command_line.subject.folder
    lead = CLOCK | {"id": "plate_position", "target": "plate_1", "told_as": "tentative"}
    for effects in ([CLOCK, lead], [lead]):
        diagnosed(*effects)
        run = command_line("accept", folder, "--author", "Anna")
        assert run.exit_code == 0, run.output
    assert [set(causes) for causes in asked] == [{("clock_offset", "all")}, {("plate_position", "plate_1")}]


def test_what_it_gains_is_told_and_kept_beside_the_decision_until_that_is_rejected(
    command_line, diagnosed, asked, tmp_path
):
    folder, answer = command_line.subject.folder, tmp_path / "gain.json"
    diagnosed(CLOCK)
    run = command_line("accept", folder, "--author", "Anna", "--json", answer)
    assert run.exit_code == 0, run.output
    page = " ".join(run.stdout.split())
    assert "force 41 → 12 N" in page
    assert "right hip flexion by 12.3 N·m (31 %)" in page
    assert "the forces come 11 ± 2 ms too late" in page
    assert "reading the files puts it right in every fit: plate_bias (plate_1)" in page
    assert "its frames are flagged, and no fit uses them: off_plate_step (calcn_r)" in page
    told = json.loads(answer.read_text(encoding="utf-8"))
    assert told == plain(GAIN) | {"causes": told["causes"]}
    (cause,) = told["causes"]
    assert cause["parameters"]["offset_s"] == {"value": 0.011, "std": 0.001}
    assert cause["parameters"]["odd"] == {"value": 0.0, "std": None}
    (decision,) = decisions(folder / "results")
    assert plain(kept_gain(decision, folder / "results")) == told
    run = command_line("reject", folder, "--author", "Bo")
    assert "rejected by Bo: clock_offset (all)" in run.stdout
    assert kept_gain(decisions(folder / "results")[-1], folder / "results") is None
    assert [d.by for d in decisions(folder / "results")] == ["Anna", "Bo"]
    command_line("fit", folder)
    assert command_line.extensions == [None]


def test_a_place_that_is_not_there_is_refused_before_the_work(command_line, diagnosed, asked, tmp_path):
    diagnosed(CLOCK)
    run = command_line("accept", command_line.subject.folder, "--json", tmp_path / "none" / "a.json")
    assert run.exit_code == 2
    assert not asked


def test_causes_in_the_markers_are_left_out_and_that_is_said(command_line, diagnosed, asked):
    folder = command_line.subject.folder
    diagnosed(CLOCK, SLIP)
    run = command_line("accept", folder, "--author", "Anna")
    assert [set(causes) for causes in asked] == [{("clock_offset", "all")}]
    assert "left out, because they lie in the markers alone: marker_slip (LTOE)" in run.stdout
    diagnosed(SLIP)
    run = command_line("accept", folder)
    assert run.exit_code != 0
    assert "correct the markers" in run.output


def test_exchanged_labels_are_exchanged_back_by_the_next_fit(command_line, diagnosed, asked, tmp_path):
    folder, answer = command_line.subject.folder, tmp_path / "accepted.json"
    diagnosed(SWAP, SLIP)
    run = command_line("accept", folder, "--author", "Anna", "--json", answer)
    assert run.exit_code == 0, run.output
    assert not asked  # nothing acts beside the forces
    assert "accepted by Anna: marker_swap (LTOE+LMT5)" in run.stdout
    assert "labels LTOE and LMT5 are swapped back in frames 40-89 of walk, in every fit" in run.stdout
    assert "marker_slip (LTOE)" in run.stdout
    told = json.loads(answer.read_text(encoding="utf-8"))
    assert told["exchanges"] == [{"trial": "walk", "labels": ["LTOE", "LMT5"], "frames": [40, 90]}]
    command_line("fit", folder)
    assert command_line.extensions[-1].exchanges == (Exchange("walk", ("LTOE", "LMT5"), 40, 90),)
    assert command_line.extensions[-1].parameters is None
    (decision,) = decisions(folder / "results")
    assert [(c.id, c.target) for c in decision.causes] == [("marker_swap", "LTOE+LMT5")]


def test_they_are_accepted_beside_what_acts_as_a_force(command_line, diagnosed, asked, extension):
    folder = command_line.subject.folder
    diagnosed(CLOCK, SWAP)
    run = command_line("accept", folder, "--author", "Anna")
    assert run.exit_code == 0, run.output
    assert [set(causes) for causes in asked] == [{("clock_offset", "all")}]
    assert "accepted by Anna: clock_offset (all), marker_swap (LTOE+LMT5)" in run.stdout
    command_line("fit", folder)
    held = command_line.extensions[-1]
    assert held.exchanges
    assert held.fingerprint != extension.fingerprint


@pytest.mark.parametrize(
    ("effects", "says"), [(None, "no diagnosis is kept here"), ((), "it names no cause")]
)
def test_what_cannot_be_accepted_is_said(command_line, diagnosed, asked, effects, says):
    if effects is not None:
        diagnosed(*effects)
    run = command_line("accept", command_line.subject.folder, "--author", "Anna")
    assert run.exit_code == 1
    assert says in run.output
    assert not asked


def test_a_diagnosis_of_other_recordings_is_refused(command_line, diagnosed, asked):
    diagnosed(CLOCK)
    command_line.subject.trials[0].markers.write_text("other markers")
    run = command_line("accept", command_line.subject.folder, "--author", "Anna")
    assert run.exit_code == 1
    assert "trials/walk/markers.trc" in run.output
    assert not asked


def test_an_extension_of_other_recordings_is_not_used(command_line, diagnosed, asked):
    folder = command_line.subject.folder
    diagnosed(CLOCK)
    command_line("accept", folder, "--author", "Anna")
    command_line.subject.trials[0].markers.write_text("other markers")
    command_line("fit", folder)
    assert command_line.extensions == [None]
    (note,) = [n for n in command_line.notes[-1] if "clock_offset" in n]
    assert "is not used" in note
    assert "trials/walk/markers.trc" in note


def test_reject_needs_something_to_reject(command_line):
    run = command_line("reject", command_line.subject.folder, "--author", "Bo")
    assert run.exit_code == 1
    assert "nothing to reject" in run.output


@pytest.fixture
def decide(command_line):
    """Accepts or rejects causes, one by one, and says what then holds."""
    folder = command_line.subject.folder

    def run(command, *causes, by="Anna"):
        options = [f"--cause={cause}" for cause in causes]
        done = command_line(command, folder, "--author", by, *options)
        assert done.exit_code == 0, done.output
        held = standings(decisions(folder / "results"))
        return {key: (standing.kind, standing.by) for key, standing in held.items()}

    return run


def in_next_fit(command_line):
    """The causes that the next fit has in its model."""
    command_line("fit", command_line.subject.folder)
    held = command_line.extensions[-1]
    return set() if held is None else {cause.id for cause in held.named}


def test_one_cause_is_accepted_alone_and_the_other_rejected(command_line, diagnosed, asked, decide):
    diagnosed(CLOCK, LOAD)
    clock, load = ("clock_offset", "all"), ("carried_mass", "torso")
    assert decide("accept", "clock_offset") == {clock: ("accept", "Anna")}
    assert in_next_fit(command_line) == {"clock_offset"}
    assert decide("reject", "carried_mass:torso", by="Bo") == {
        clock: ("accept", "Anna"),
        load: ("reject", "Bo"),
    }
    assert [set(causes) for causes in asked] == [{clock}]  # nothing that holds has changed: no new fit of it
    assert in_next_fit(command_line) == {"clock_offset"}


def test_a_second_cause_is_accepted_beside_the_first_and_taken_out_again(
    command_line, diagnosed, asked, decide
):
    diagnosed(CLOCK, LOAD)
    decide("reject", "carried_mass")
    assert in_next_fit(command_line) == set()
    decide("accept", "clock_offset")
    assert decide("accept", "carried_mass") == {
        ("clock_offset", "all"): ("accept", "Anna"),
        ("carried_mass", "torso"): ("accept", "Anna"),
    }
    assert set(asked[-1]) == {("clock_offset", "all"), ("carried_mass", "torso")}
    assert in_next_fit(command_line) == {"clock_offset", "carried_mass"}
    decide("reject", "clock_offset", by="Bo")
    assert set(asked[-1]) == {("carried_mass", "torso")}  # the one that stays is fitted anew
    assert in_next_fit(command_line) == {"carried_mass"}
    decide("reject", "carried_mass", by="Bo")
    assert in_next_fit(command_line) == set()


def test_accepting_all_leaves_a_lead_rejected(command_line, diagnosed, asked, decide):
    diagnosed(CLOCK, {**LOAD, "told_as": "tentative"})
    decide("reject", "carried_mass", by="Bo")
    assert decide("accept") == {
        ("clock_offset", "all"): ("accept", "Anna"),
        ("carried_mass", "torso"): ("reject", "Bo"),
    }
    assert in_next_fit(command_line) == {"clock_offset"}


def test_a_cause_that_is_not_named_is_refused_with_those_that_are(command_line, diagnosed, asked):
    folder = command_line.subject.folder
    diagnosed(CLOCK, LOAD)
    for command in ("accept", "reject"):
        run = command_line(command, folder, "--cause", "drag:torso")
        assert run.exit_code == 1
        assert "clock_offset (all), carried_mass (torso)" in " ".join(run.output.split())
    diagnosed(LOAD, {**LOAD, "target": "hand_r"})
    run = command_line("accept", folder, "--cause", "carried_mass")
    assert run.exit_code == 2
    assert not decisions(folder / "results")
    assert not asked


def test_a_slip_alone_is_not_accepted_beside_what_holds(command_line, diagnosed, asked, decide):
    diagnosed(CLOCK, SLIP)
    decide("accept", "clock_offset")
    run = command_line("accept", command_line.subject.folder, "--cause", "marker_slip")
    assert run.exit_code == 1
    assert "correct the markers" in run.output
    assert len(asked) == 1
