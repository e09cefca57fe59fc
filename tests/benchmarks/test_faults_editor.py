"""Known faults edited into recordings: every edit does what its truth says, by laws of mechanics alone."""

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.faults.editor import edits, plates
from benchmarks.faults.editor.draw import CLEAN, KINDS, make
from benchmarks.faults.editor.recording import (
    NoPlaceError,
    Plate,
    Recording,
    Trial,
    read_mot,
    read_trc,
    write_folder,
)
from benchmarks.faults.editor.sources import SOURCES
from benchmarks.faults.judge import NAMES


@pytest.fixture
def recording():
    """Two plates whose loads wander, one of them free for a while; six markers of a body that turns."""
    rng = np.random.default_rng(1)
    times, force_times = np.arange(200) / 100, np.arange(2000) / 1000
    plates_ = []
    for x, lifted in ((0.3, slice(1100, 1800)), (0.9, slice(0, 0))):
        force = np.stack(
            [20 * np.sin(3 * force_times), 350 + 80 * np.sin(5 * force_times), 0 * force_times], 1
        )
        point = np.stack([x + 0.05 * np.sin(4 * force_times), 0 * force_times, 0.02 * force_times], 1)
        force[lifted] = 0
        moment = np.cross(point, force) + np.stack([0 * force_times, 2 + 0 * force_times, 0 * force_times], 1)
        moment[lifted] = 0
        plates_.append(Plate(force, moment, 0.0))
    body = rng.normal(0, 0.08, (6, 3))
    c, s = np.cos(times), np.sin(times)
    R = np.stack(
        [np.stack([c, s, 0 * c], 1), np.stack([-s, c, 0 * c], 1), np.stack([0 * c, 0 * c, 1 + 0 * c], 1)], 1
    )
    positions = np.einsum("tij,mj->tmi", R, body) + np.array([0.0, 1.0, 0.0])
    trial = Trial("trial_a", tuple("ABCDEF"), positions, times, tuple(plates_), force_times)
    return Recording((trial,), mass_kg=70.0)


def edited(recording, edit, seed=0):
    changed, fault = edit(recording, np.random.default_rng(seed))
    return changed, fault


def test_the_editor_knows_nothing_of_what_it_judges():
    """Imported in a process of its own; what is judged must not make the cases."""
    judged = "('solver', 'addb_viewer', 'annotations')"
    asked = (
        "import sys, benchmarks.faults.editor.draw; "
        f"print([m for m in sys.modules if m.split('.')[0] in {judged}])"
    )
    said = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == "[]"


def test_what_is_written_is_read_back(recording, tmp_path):
    """Markers to a hundredth of a micron, wrenches to a milli; the pressure too."""
    trial = recording.trials[0]
    hidden = trial.positions.copy()
    hidden[3:9, 2] = np.nan
    write_folder(tmp_path, replace(recording, trials=(replace(trial, positions=hidden),)))
    labels, positions, times = read_trc(tmp_path / "trial_a.trc")
    read, force_times = read_mot(tmp_path / "trial_a_grf.mot", "free")
    assert labels == trial.labels
    np.testing.assert_allclose(positions, hidden, atol=1e-8)
    np.testing.assert_allclose(times, trial.times, atol=1e-9)
    np.testing.assert_allclose(force_times, trial.force_times, atol=1e-9)
    for plate, original in zip(read, trial.plates, strict=True):
        np.testing.assert_allclose(plate.force, original.force, atol=1e-3)
        np.testing.assert_allclose(plate.moment, original.moment, atol=1e-3)
    assert "mass_kg = 70.0" in (tmp_path / "subject.toml").read_text()


def test_a_turned_plate_turns_force_and_pressure_about_its_middle(recording):
    changed, fault = edited(recording, plates.turned(90.0))
    k = fault.plate - 1
    old, new = recording.trials[0].plates[k], changed.trials[0].plates[k]
    loaded = old.loaded
    np.testing.assert_allclose(new.force[:, 1], old.force[:, 1])
    np.testing.assert_allclose(new.force[:, 2], -old.force[:, 0], atol=1e-9)
    before, after = (p.pressure[loaded] - old.centre for p in (old, new))
    np.testing.assert_allclose(after[:, 0], before[:, 2], atol=1e-9)
    np.testing.assert_allclose(after[:, 2], -before[:, 0], atol=1e-9)
    np.testing.assert_allclose(free_moment(new)[loaded], free_moment(old)[loaded], atol=1e-9)


def test_a_mirrored_plate_turns_the_free_moment_the_other_way(recording):
    changed, fault = edited(recording, plates.mirrored(0))
    k = fault.plate - 1
    old, new = recording.trials[0].plates[k], changed.trials[0].plates[k]
    loaded = old.loaded
    np.testing.assert_allclose(new.force * [-1, 1, 1], old.force, atol=1e-9)
    np.testing.assert_allclose(
        (new.pressure - old.centre)[loaded] * [-1, 1, 1], (old.pressure - old.centre)[loaded], atol=1e-9
    )
    np.testing.assert_allclose(free_moment(new)[loaded], -free_moment(old)[loaded], atol=1e-9)


def free_moment(plate):
    return (plate.moment - np.cross(plate.pressure, plate.force))[:, 1]


def test_a_shifted_plate_moves_the_pressure_and_nothing_else(recording):
    changed, fault = edited(recording, plates.shifted(0.2, 30.0))
    old, new = (r.trials[0].plates[fault.plate - 1] for r in (recording, changed))
    shift = [fault.size["shift_x_m"], 0.0, fault.size["shift_z_m"]]
    assert np.hypot(shift[0], shift[2]) == pytest.approx(0.2)
    np.testing.assert_allclose(
        (new.pressure - old.pressure)[old.loaded], [shift] * old.loaded.sum(), atol=1e-9
    )
    np.testing.assert_allclose(free_moment(new)[old.loaded], free_moment(old)[old.loaded], atol=1e-9)


def test_a_plate_tared_under_a_load_reads_it_turned_round_while_empty(recording):
    changed, fault = edited(recording, plates.tared_under_load(600.0, 0.05), seed=3)
    old, new = (r.trials[0].plates[fault.plate - 1] for r in (recording, changed))
    np.testing.assert_allclose(new.force - old.force, [[0.0, -600.0, 0.0]] * len(old.force), atol=1e-9)
    np.testing.assert_allclose(np.ptp(new.moment - old.moment, axis=0), 0, atol=1e-9)


def test_exchanged_plates_keep_their_loads_and_change_places(recording):
    changed, _ = edited(recording, plates.exchanged())
    old, new = recording.trials[0].plates, changed.trials[0].plates
    np.testing.assert_array_equal(new[0].force, old[1].force)
    np.testing.assert_allclose(new[0].centre, old[0].centre, atol=1e-6)
    np.testing.assert_allclose(new[1].centre, old[1].centre, atol=1e-6)


def test_a_lost_step_takes_one_stance(recording):
    changed, fault = edited(recording, plates.lost_step())
    trial = changed.trials[0]
    inside = (trial.force_times >= fault.times_s[0]) & (trial.force_times <= fault.times_s[1])
    k = fault.plate - 1
    assert not trial.plates[k].force[inside].any()
    np.testing.assert_array_equal(
        trial.plates[k].force[~inside], recording.trials[0].plates[k].force[~inside]
    )


def test_an_object_weighs_as_much_loaded_and_empty(recording):
    changed, fault = edited(recording, plates.standing_object(8.0, 0.2))
    old, new = (r.trials[0].plates[fault.plate - 1] for r in (recording, changed))
    np.testing.assert_allclose((new.force - old.force)[:, 1], 8.0 * 9.80665)


@pytest.mark.parametrize("lag", [0.02, 0.15])
def test_late_forces_carry_the_past(recording, lag):
    changed, _ = edited(recording, edits.late([lag]))
    trial, old = changed.trials[0], recording.trials[0]
    assert trial.times[0] >= lag
    was = np.interp(trial.force_times - lag, old.force_times, old.plates[1].force[:, 1])
    np.testing.assert_allclose(trial.plates[1].force[:, 1], was, atol=0.5)


def test_one_late_plate_leaves_the_other(recording):
    changed, fault = edited(recording, edits.one_plate_late(0.03))
    trial, other = changed.trials[0], 1 - (fault.plate - 1)
    kept = np.isin(recording.trials[0].force_times, trial.force_times)
    np.testing.assert_array_equal(trial.plates[other].force, recording.trials[0].plates[other].force[kept])


def test_a_smoothed_force_has_lost_half_its_power_at_the_cutoff(recording):
    trial = recording.trials[0]
    force = trial.plates[1].force.copy()
    force[:, 1] = 400 + 100 * np.sin(2 * np.pi * 5.0 * trial.force_times)
    recording = recording.with_trial(0, trial.with_plate(1, replace(trial.plates[1], force=force)))
    changed, _ = edited(recording, edits.smoothed(5.0))
    middle = changed.trials[0].plates[1].force[600:1400, 1] - 400
    assert np.abs(middle).max() == pytest.approx(100 / np.sqrt(2), rel=0.02)


def test_a_slip_moves_one_marker_rigidly_from_a_moment_on(recording):
    changed, fault = edited(recording, edits.slipped(0.03))
    old, new = recording.trials[0], changed.trials[0]
    m, first = old.labels.index(fault.markers[0]), np.searchsorted(old.times, fault.times_s[0])
    away = np.linalg.norm(new.positions - old.positions, axis=2)
    np.testing.assert_allclose(away[first:, m], 0.03, atol=1e-9)
    away[first:, m] = 0
    assert not away.any()


def test_cloth_carries_neighbours_without_changing_their_distances(recording):
    changed, fault = edited(recording, edits.carried_by_cloth(0.03))
    old, new = recording.trials[0], changed.trials[0]
    moved = [old.labels.index(name) for name in fault.markers]
    assert len(moved) == 4
    for trial in (old, new):
        apart = np.linalg.norm(trial.positions[:, moved[0]] - trial.positions[:, moved[1]], axis=1)
        np.testing.assert_allclose(apart, apart[0], atol=1e-9)
    assert np.linalg.norm(new.positions[-1, moved] - old.positions[-1, moved], axis=1) == pytest.approx(0.03)


def test_exchanged_labels_change_back(recording):
    changed, fault = edited(recording, edits.labels_exchanged(0.4))
    old, new = recording.trials[0], changed.trials[0]
    a, b = (old.labels.index(name) for name in fault.markers)
    inside = (old.times >= fault.times_s[0]) & (old.times <= fault.times_s[1])
    np.testing.assert_array_equal(new.positions[inside, a], old.positions[inside, b])
    np.testing.assert_array_equal(new.positions[~inside], old.positions[~inside])


def test_a_harness_lightens_the_plates_by_its_pull_at_the_pelvis(recording):
    trial = replace(recording.trials[0], labels=("A", "R.ASIS", "C", "D", "LPSI", "F"))
    both = recording.with_trial(0, trial.cut(0.0, 1.1))
    changed, fault = edited(both, edits.supported(0.2))
    old, new = both.trials[0], changed.trials[0]
    lost = sum(p.force - q.force for p, q in zip(old.plates, new.plates, strict=True))
    np.testing.assert_allclose(lost, np.tile([0.0, fault.size["force_N"], 0.0], (len(lost), 1)), atol=1e-9)
    moment = sum(p.moment - q.moment for p, q in zip(old.plates, new.plates, strict=True))
    at = old.positions[:, [1, 4]].mean(axis=1)  # the line straight up through it has no moment about it
    x, z = (np.interp(old.force_times, old.times, at[:, axis]) for axis in (0, 2))
    expected = fault.size["force_N"] * np.stack([-z, 0 * x, x], axis=1)
    np.testing.assert_allclose(moment, expected, atol=1e-6)
    light = tuple(replace(p, force=0.01 * p.force, moment=0.01 * p.moment) for p in trial.plates)
    too_light = recording.with_trial(0, replace(trial, plates=light))
    with pytest.raises(NoPlaceError):
        edited(too_light, edits.supported(0.2))


def test_every_kind_has_names_that_count_as_right():
    assert {kind.name for kind in KINDS} == set(NAMES)


@pytest.mark.real
def test_a_draw_keeps_truth_apart_and_holds_what_is_asked_of_it(real_data, tmp_path):
    """Sixty faults and more, of eight persons and more, and a third of the pool clean."""
    count = make(tmp_path, real_data, 7)
    truths = [json.loads(p.read_text()) for p in (tmp_path / "truth").glob("*.json")]
    assert len(truths) == count == len(list((tmp_path / "subjects").iterdir()))
    faulted = [t for t in truths if t["kind"] != CLEAN]
    assert len(faulted) >= 60
    assert len({t["person"] for t in faulted}) >= 8
    assert 3 * (count - len(faulted)) >= count
    for folder in (tmp_path / "subjects").iterdir():
        told = (folder / "subject.toml").read_text()
        assert not any(kind.name in told for kind in KINDS)
    assert {s.name for s in SOURCES} == {t["source"] for t in truths}
