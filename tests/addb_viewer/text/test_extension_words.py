"""What accepting changes, in words: no surer than the held-out blocks allow."""

from dataclasses import replace

import pytest

from addb_viewer.text.extension_words import what_accepting_changes
from solver.common.notes import Kind, Note
from solver.diagnosis.diagnosis import Gain
from solver.diagnosis.diagnosis_report import AcceptedCause, AcceptedGain, Figure, TorqueChanges

CLOCK = AcceptedCause("clock_offset", "all", {"offset_s": Figure(0.012, 0.0004)})
GAIN = AcceptedGain(
    causes=(CLOCK,),
    exchanges=(),
    held_out_linear_residual_N=Gain(41.0, 12.2, (11.0, 13.9)),
    held_out_angular_residual_Nm=Gain(19.5, 8.1, (7.2, 9.0)),
    held_out_linear_drop_N=(20.0, 30.0),
    held_out_angular_drop_Nm=(8.0, 13.0),
    marker_rms_m=Gain(0.0121, 0.0120),
    mass_kg=Gain(71.0, 71.01),
    held_out_frames=110,
    held_out_blocks=5,
    joint_torque_change=TorqueChanges(
        {"hip_flexion_r": 12.34, "tx": 9.0, "ankle_angle_r": 3.0},
        {"hip_flexion_r": 40.0, "tx": 90.0, "ankle_angle_r": 30.0},
        ("hip_flexion_r", "ankle_angle_r"),
    ),
    notes=(Note(Kind.OTHER, "a note"),),
)


def test_every_figure_is_there_before_and_after():
    section = what_accepting_changes(GAIN)
    rows = dict(section.rows)
    assert rows["force"].startswith("41 → 12 N")
    assert "between 7.2 and 9.0" in rows["moment"]
    assert rows["markers"] == "12.1 → 12.0 mm"
    assert rows["joint torques"] == ("right hip flexion by 12.3 N·m (31 %); right ankle by 3.0 N·m (10 %)")
    assert rows["causes"] == (
        "forces shifted in time against the markers: the forces come 12.0 ± 0.8 ms too late"
    )
    assert "body mass" not in rows
    assert "110 frames in 5 blocks" in section.lines[0]
    assert section.lines[1] == "a note"
    assert dict(what_accepting_changes(replace(GAIN, mass_kg=Gain(71.0, 70.2))).rows)["body mass"] == (
        "71.0 → 70.2 kg"
    )


@pytest.mark.parametrize(
    ("linear", "angular", "says"),
    [
        ((20.0, 30.0), (8.0, 13.0), "more than by chance: the residual force and moment."),
        ((20.0, 30.0), (-1.0, 13.0), "Falls, more than by chance: the residual force."),
        ((-2.0, 30.0), (-1.0, 13.0), "On these the gain is not certain."),
        ((20.0, 30.0), (-9.0, -1.0), "Rises, more than by chance: the residual moment. Reconsider"),
        (None, None, "too few held-out blocks to tell whether that is chance"),
    ],
)
def test_chance_is_called_chance(linear, angular, says):
    section = what_accepting_changes(
        replace(GAIN, held_out_linear_drop_N=linear, held_out_angular_drop_Nm=angular)
    )
    assert says in section.lines[0]


def test_where_nothing_could_be_held_out_that_is_said():
    none = dict.fromkeys(("held_out_linear_residual_N", "held_out_angular_residual_Nm"))
    section = what_accepting_changes(replace(GAIN, held_out_blocks=0, held_out_frames=0, **none))
    assert "force" not in dict(section.rows)
    assert "Too few frames have forces" in section.lines[0]
