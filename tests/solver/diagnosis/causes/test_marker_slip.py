import numpy as np
import pytest

from solver.diagnosis.causes.marker_slip import findings


def slipped(observed, R_ground, column, shift_body, frame):
    altered = observed.copy()
    altered[frame:, column] += R_ground[frame:] @ shift_body
    return altered


def test_a_sound_walk_has_none(sound):
    assert findings(sound) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["RTH2", "LKNE", "RASI", "LTB1", "RHEE", "C7", "LUPA"])
def test_finds_fifteen_millimetres(sound, long_walk, tracked, name):
    observed, skeleton = long_walk
    rng = np.random.default_rng(sum(map(ord, name)))
    shift = rng.standard_normal(3)
    shift *= 0.015 / np.linalg.norm(shift)
    m = skeleton.marker_names.index(name)
    frame = int(rng.integers(120, 280))
    altered = slipped(observed, sound.R_ground_body[:, sound.markers.body[m]], m, shift, frame)
    (found,) = findings(tracked(altered, skeleton))
    assert found.target == name
    assert found.frames.start == pytest.approx(frame, abs=12)  # a gap may hide the moment
    assert found.parameters["time_s"].value == pytest.approx(found.frames.start / 100)
    assert found.parameters["shift_m"].value == pytest.approx(0.015, abs=0.003)
    recovered = [found.parameters[f"shift_{axis}_m"].value for axis in "xyz"]
    assert np.linalg.norm(recovered - shift) < 0.005
    left = found.repair(altered) - observed
    assert np.nanmax(np.linalg.norm(left[frame + 12 :, m], axis=1)) < 0.005


def test_two_markers_that_slip_are_both_found(sound, long_walk, tracked):
    observed, skeleton = long_walk
    altered, truth = observed, {}
    for name, frame, shift in (("RTH1", 150, (0.0, -0.018, 0.004)), ("LWRA", 240, (0.012, 0.0, 0.012))):
        m = skeleton.marker_names.index(name)
        R = sound.R_ground_body[:, sound.markers.body[m]]
        altered = slipped(altered, R, m, np.array(shift), frame)
        truth[name] = frame
    found = {f.target: f.frames.start for f in findings(tracked(altered, skeleton))}
    assert found.keys() == truth.keys()
    assert all(abs(found[name] - truth[name]) <= 12 for name in truth)


def test_a_disturbance_that_passes_is_no_slip(long_walk, tracked):
    observed, skeleton = long_walk
    altered = observed.copy()
    altered[150:158, skeleton.marker_names.index("RTH2")] += 0.03
    assert findings(tracked(altered, skeleton)) == []


def test_fat_that_swings_with_the_knee_is_no_slip(sound, long_walk, tracked):
    observed, skeleton = long_walk
    knee = sound.motion.q[:, skeleton.dofs.index("knee_angle_r")]
    m = skeleton.marker_names.index("RTH2")
    R = sound.R_ground_body[:, sound.markers.body[m]]
    altered = observed.copy()
    altered[:, m] += (R @ np.array([0.01, 0.03, 0.0])) * (knee - knee.mean())[:, None]
    assert findings(tracked(altered, skeleton)) == []


def test_who_slipped_while_out_of_sight_is_named_not_the_neighbours(sound, long_walk, tracked):
    """They seem to jump with the pose that the slipped one turns; nothing says whether its own jump lasts."""
    observed, skeleton = long_walk
    m = skeleton.marker_names.index("RMT5")
    R = sound.R_ground_body[:, sound.markers.body[m]]
    altered = slipped(observed, R, m, np.array([0.025, 0.012, -0.025]), 200)
    altered[186:199, m] = np.nan
    assert [f.target for f in findings(tracked(altered, skeleton))] == ["RMT5"]


def test_one_that_is_knocked_and_then_lost_did_not_slip_with_another(sound, long_walk, tracked):
    """Nobody sees whether it would have stayed there."""
    observed, skeleton = long_walk
    m, knocked = (skeleton.marker_names.index(name) for name in ("RTH2", "C7"))
    R = sound.R_ground_body[:, sound.markers.body[m]]
    altered = slipped(observed, R, m, np.array([0.009, 0.012, 0.0]), 200)
    altered[198:206, knocked] += 0.03
    altered[206:, knocked] = np.nan
    assert [f.target for f in findings(tracked(altered, skeleton))] == ["RTH2"]


def test_a_slip_stands_out_beside_jolts_of_a_third_its_size(sound, long_walk, tracked):
    """Landing jolts a loose marker now and then; a dozen of them make no slip, nor do they hide one."""
    observed, skeleton = long_walk
    m = skeleton.marker_names.index("RTH2")
    R = sound.R_ground_body[:, sound.markers.body[m]]
    along = np.where(np.arange(len(observed)) // 30 % 2, 0.0055, 0.0)[:, None] * np.array([0.0, -0.8, 0.6])
    jolted = observed.copy()
    jolted[:, m] += np.einsum("tij,tj->ti", R, along)
    assert findings(tracked(jolted, skeleton)) == []
    altered = slipped(jolted, R, m, np.array([0.009, 0.012, 0.0]), 215)
    (found,) = findings(tracked(altered, skeleton))
    assert found.target == "RTH2"
    assert found.frames.start == pytest.approx(215, abs=3)


@pytest.mark.real
def test_in_a_recorded_walk(real_walk, tracked):
    observed, skeleton, rate = real_walk
    sound = tracked(observed, skeleton, rate)
    assert findings(sound) == []
    m = skeleton.marker_names.index("R.TH3")
    R = sound.R_ground_body[:, sound.markers.body[m]]
    altered = slipped(observed, R, m, np.array([0.009, -0.012, 0.0]), 130)
    (found,) = findings(tracked(altered, skeleton, rate))
    assert (found.target, found.frames.start) == ("R.TH3", 130)
    assert found.parameters["shift_m"].value == pytest.approx(0.015, abs=0.004)
