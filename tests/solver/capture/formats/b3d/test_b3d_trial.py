"""Segments that were cut from one recording, with headers as writers have left them."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.formats.b3d.b3d_fields import B3dFile, B3dTrial, Header, SensorFrames, TrialHeader
from solver.capture.formats.b3d.b3d_file import read_b3d, write_b3d
from solver.capture.formats.b3d.b3d_trial import trials_in
from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_trial
from solver.common.errors import CaptureError

MARKERS, RATE, FRAMES = 6, 100.0, 60
CUTS = ((0, 20), (20, 45), (45, 60))


def whole():
    """Six markers that walk at 1.4 m/s, each on its own curve."""
    times = np.arange(FRAMES) / RATE
    places = np.random.default_rng(1).normal(0, 0.3, (MARKERS, 3)) + np.array([0.0, 1.0, 0.0])
    forward = np.array([1.4, 0.0, 0.0]) * times[:, None]
    return places[None] + forward[:, None] + 0.02 * np.sin(9 * times)[:, None, None]


def plate():
    """A steady load of 600 N at a centre of pressure that moves on; and zeros on a cut's first frame."""
    force = np.tile([10.0, 600.0, 5.0], (FRAMES, 1))
    force[[20, 45]] = 0.0
    return force


def segment(start, end, *, stated=True, step=1 / RATE, split=0, name="walk", **more):
    positions, force = whole()[start:end], plate()[start:end]
    return B3dTrial(
        header=TrialHeader(
            name=f"{name}_segment_{split}",
            original_name=name,
            trial_length=end - start,
            trial_timestep=step,
            num_force_plates=1,
            split_index=split,
            original_start_frame=start if stated else 0,
            original_end_frame=end if stated else 0,
            **more,
        ),
        sensors=SensorFrames(
            marker_obs=positions.reshape(end - start, 3 * MARKERS),
            raw_force_plate_cop=np.tile([0.4, 0.0, 0.1], (end - start, 1)),
            raw_force_plate_torque=np.tile([0.0, 2.0, 0.0], (end - start, 1)),
            raw_force_plate_force=force,
        ),
        passes=(),
    )


@pytest.fixture
def written(tmp_path):
    def write(*segments):
        header = Header(
            marker_name=tuple(f"M{k}" for k in range(MARKERS)),
            trial_header=tuple(one.header for one in segments),
            mass_kg=62.0,
            ground_contact_body=("calcn_r", "calcn_l"),
        )
        path = tmp_path / "person.b3d"
        write_b3d(B3dFile(header, tuple(segments)), path)
        return path

    return write


def names(path):
    return [trial.name for trial in trials_in(read_b3d(path))]


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (1, 2, 0)])
@pytest.mark.parametrize("stated", [True, False])
def test_segments_in_any_order_are_one_trial_again(written, order, stated):
    pieces = [segment(*CUTS[k], stated=stated, split=k) for k in range(3)]
    path = written(*(pieces[k] for k in order))
    (files,) = open_subject(path).trials
    capture = read_trial(files)
    assert capture.name == "walk"
    np.testing.assert_array_equal(capture.markers.positions_ground, whole())
    assert any("3 segments of walk are joined again" in note for note in capture.notes)


def test_without_any_numbers_the_names_give_the_order(written):
    pieces = [segment(*CUTS[k], stated=False, split=k) for k in range(3)]
    bare = [replace(one, header=replace(one.header, split_index=0)) for one in pieces]
    path = written(bare[2], bare[0], bare[1])
    np.testing.assert_array_equal(read_trial(open_subject(path).trials[0]).markers.positions_ground, whole())


def test_zeros_on_a_cut_are_not_measured(written):
    """Writers leave a segment's first frame without force; nobody is unloaded for one frame."""
    path = written(*(segment(*CUTS[k], split=k) for k in range(3)))
    (found,) = read_trial(open_subject(path).trials[0]).plates
    assert np.flatnonzero(np.isnan(found.force_ground[:, 1])).tolist() == [20, 45]
    known = np.isfinite(found.force_ground[:, 1])
    np.testing.assert_array_equal(found.force_ground[known], plate()[known])
    moment = np.array([0.0, 2.0, 0.0]) + np.cross([0.4, 0.0, 0.1], [10.0, 600.0, 5.0])
    np.testing.assert_allclose(found.moment_ground[known], np.tile(moment, (known.sum(), 1)), atol=1e-12)


def test_a_gap_keeps_them_apart(written):
    path = written(segment(0, 20, split=0), segment(25, 60, split=1))
    assert names(path) == ["walk_segment_0", "walk_segment_1"]
    assert any(
        "5 frames lie between them" in note for trial in trials_in(read_b3d(path)) for note in trial.notes
    )


def test_an_overlap_keeps_them_apart(written):
    path = written(segment(0, 25, split=0), segment(20, 60, split=1))
    assert any("they share 5 frames" in note for trial in trials_in(read_b3d(path)) for note in trial.notes)
    assert len(names(path)) == 2


def test_another_rate_keeps_them_apart(written):
    path = written(segment(0, 20, split=0), segment(20, 60, split=1, step=1 / 60))
    (note,) = {note for trial in trials_in(read_b3d(path)) for note in trial.notes}
    assert "100 frames a second, the other 60" in note


def test_without_frames_a_jump_keeps_them_apart(written):
    """Twelve centimetres in a hundredth of a second: nobody moves so fast."""
    path = written(segment(0, 20, stated=False, split=0), segment(29, 60, stated=False, split=1))
    assert names(path) == ["walk_segment_0", "walk_segment_1"]
    notes = {note for trial in trials_in(read_b3d(path)) for note in trial.notes}
    assert any("no frames are stated, and between them the markers move by 1" in note for note in notes)


def test_only_the_pieces_that_abut_are_joined(written):
    path = written(segment(0, 20, split=0), segment(20, 40, split=1), segment(45, 60, split=2))
    assert names(path) == ["walk_segment_0", "walk_segment_2"]
    captures = [read_trial(files) for files in open_subject(path).trials]
    assert [capture.markers.frames for capture in captures] == [40, 15]


def test_names_that_lead_elsewhere_or_occur_twice(written):
    path = written(
        segment(0, 20, name="../a"),
        replace(
            segment(0, 20, name="b"),
            header=replace(segment(0, 20, name="b").header, original_name="", name="_a"),
        ),
    )
    assert names(path) == ["_a", "_a_2"]


def test_a_file_without_a_frame(written):
    empty = segment(0, 0)
    with pytest.raises(CaptureError, match="no trial with a frame in it"):
        open_subject(written(empty))
