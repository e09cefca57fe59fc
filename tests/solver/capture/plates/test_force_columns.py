"""Plates found in column names of every style."""

import re
from pathlib import Path

import numpy as np
import pytest

from solver.capture.formats.storage import Storage
from solver.capture.plates.force_columns import find_plates
from solver.common.errors import CaptureError


def table(*labels: str) -> Storage:
    return Storage(Path("/lab/grf.mot"), tuple(labels), np.arange(3) / 100, np.zeros((3, len(labels))), 100)


def xyz(*patterns: str) -> list[str]:
    return [pattern.replace("?", axis) for pattern in patterns for axis in "xyz"]


STYLES = {
    "gait2354": xyz(
        "ground_force_v?", "ground_force_p?", "1_ground_force_v?", "1_ground_force_p?",
        "ground_torque_?", "1_ground_torque_?",
    ),
    "sides": xyz(
        "ground_force_r_v?", "ground_force_r_p?", "ground_torque_r_?",
        "ground_force_l_v?", "ground_force_l_p?", "ground_torque_l_?",
    ),
    "sides in front": xyz(
        "R_ground_force_v?", "R_ground_force_p?", "L_ground_force_v?", "L_ground_force_p?",
        "R_ground_torque_?", "L_ground_torque_?",
    ),
    "numbers": xyz(
        "ground_force_1_v?", "ground_force_1_p?", "ground_force_1_m?",
        "ground_force_2_v?", "ground_force_2_p?", "ground_force_2_m?",
    ),
    "numbers without a bar": xyz(
        "ground_force1_v?", "ground_force1_p?", "ground_force2_v?", "ground_force2_p?",
        "ground_torque1_?", "ground_torque2_?",
    ),
    "moment": xyz(
        "ground_force_1_v?", "ground_force_1_p?", "ground_moment_1_m?",
        "ground_force_2_v?", "ground_force_2_p?", "ground_moment_2_m?",
    ),
    "torque with t": xyz(
        "r_force_v?", "r_force_p?", "r_torque_t?", "l_force_v?", "l_force_p?", "l_torque_t?",
    ),
    "bodies": xyz(
        "ground_force_calcn_r_v?", "ground_force_calcn_r_p?", "ground_torque_calcn_r_?",
        "ground_force_calcn_l_v?", "ground_force_calcn_l_p?", "ground_torque_calcn_l_?",
    ),
    "plates": xyz("FP1_v?", "FP1_p?", "FP1_m?", "FP2_v?", "FP2_p?", "FP2_m?"),
    "channels": xyz("F?1", "COP?1", "M?1", "F?2", "COP?2", "M?2"),
    "words": xyz(
        "plate1.force.?", "plate1.cop.?", "plate1.free_moment.?",
        "plate2.force.?", "plate2.cop.?", "plate2.free_moment.?",
    ),
    "capitals": [
        label.upper()
        for label in xyz("Grf_R_v?", "Cop_R_p?", "Grm_R_m?", "Grf_L_v?", "Cop_L_p?", "Grm_L_m?")
    ],
}  # fmt: skip


@pytest.mark.parametrize("labels", STYLES.values(), ids=STYLES)
def test_two_plates_in_every_style(labels):
    plates, notes = find_plates(table(*labels))
    assert len(plates) == 2
    assert notes == ()
    columns = [k for plate in plates for triple in (plate.force, plate.point, plate.moment) for k in triple]
    assert sorted(columns) == list(range(18))
    for plate in plates:
        for triple in (plate.force, plate.point, plate.moment):
            assert triple == (triple[0], triple[0] + 1, triple[0] + 2)
            assert [labels[k].rstrip("12")[-1].lower() for k in triple] == ["x", "y", "z"]
        assert re.search(r"px|cop", labels[plate.point[0]], re.IGNORECASE)
        assert re.search(r"torque|moment|m", labels[plate.moment[0]], re.IGNORECASE)
    assert plates[0].force[0] < plates[1].force[0]


def test_names_are_the_files_own():
    assert [plate.name for plate in find_plates(table(*STYLES["gait2354"]))[0]] == [
        "ground_force",
        "1_ground_force",
    ]
    assert [plate.name for plate in find_plates(table(*STYLES["numbers"]))[0]] == [
        "ground_force_1",
        "ground_force_2",
    ]


def test_numbered_plates_come_by_number_others_in_file_order():
    labels = [
        *xyz("ground_force_10_v?", "ground_force_10_p?"),
        *xyz("ground_force_2_v?", "ground_force_2_p?"),
    ]
    assert [plate.name for plate in find_plates(table(*labels))[0]] == ["ground_force_2", "ground_force_10"]
    labels = xyz("L_ground_force_v?", "L_ground_force_p?", "3_ground_force_v?", "3_ground_force_p?")
    assert [plate.name for plate in find_plates(table(*labels))[0]] == ["L_ground_force", "3_ground_force"]


def test_columns_of_a_device_are_ignored_and_listed():
    device = xyz("apo_force_v?", "apo_force_p?", "apo_torque_?", "1_apo_torque_?")
    plates, notes = find_plates(table(*STYLES["numbers without a bar"], *device, "emg_soleus"))
    assert [plate.name for plate in plates] == ["ground_force1", "ground_force2"]
    assert len(notes) == 1
    assert all(label in notes[0] for label in (*device, "emg_soleus"))


@pytest.mark.parametrize(
    ("dropped", "named"),
    [
        ("ground_force_2_px", "ground_force_2_px"),
        ("ground_force_2_vy", "ground_force_2_vy"),
        ("ground_force_2_mz", "ground_force_2_mz"),
    ],
)
def test_a_missing_column_is_named(dropped, named):
    labels = [label for label in STYLES["numbers"] if label != dropped]
    with pytest.raises(
        CaptureError, match=rf"grf\.mot: column '{named}' missing; plates found: 1 \(ground_force_1\)"
    ):
        find_plates(table(*labels))


def test_a_force_that_acts_nowhere_is_an_error():
    with pytest.raises(
        CaptureError, match="'ground_force_1_px', 'ground_force_1_py', 'ground_force_1_pz' missing"
    ):
        find_plates(table(*xyz("ground_force_1_v?")))


def test_two_columns_for_the_same_thing_are_an_error():
    with pytest.raises(
        CaptureError, match="'ground_force1_vx' and 'ground_force_1_vx' both look like the force along x"
    ):
        find_plates(table(*xyz("ground_force1_v?", "ground_force1_p?"), "ground_force_1_vx"))


def test_no_force_at_all_says_what_was_expected():
    with pytest.raises(
        CaptureError, match=r"no ground force among the columns pelvis_tx.*expected names such as"
    ):
        find_plates(table("pelvis_tx", "pelvis_ty", "pelvis_tz", "knee_angle_r"))


def test_no_moment_columns_means_no_free_moment_and_is_noted():
    (plate,), notes = find_plates(table(*xyz("ground_force_v?", "ground_force_p?")))
    assert plate.moment is None
    assert "free moment is taken as zero" in notes[0]


def test_a_vertical_moment_alone_is_the_free_moment():
    (plate,), notes = find_plates(table(*xyz("ground_force_v?", "ground_force_p?"), "ground_torque_y"))
    assert plate.moment == (None, 6, None)
    assert "vertical moment only" in notes[0]


def test_no_centre_of_pressure_but_moments():
    (plate,), _ = find_plates(table(*xyz("ground_force_1_v?", "ground_force_1_m?")))
    assert plate.point is None
    assert plate.moment == (3, 4, 5)


def test_repeated_columns_are_a_second_plate():
    names = xyz("ground_force_v?", "ground_force_p?")
    plates, _ = find_plates(table(*names, *(f"{name}#2" for name in names)))
    assert [plate.force for plate in plates] == [(0, 1, 2), (6, 7, 8)]
