"""Smoothed forces, and how steeply forces fall off with frequency where contacts begin and end."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from scipy.signal import butter, filtfilt, freqz

from benchmarks.faults.editor.edits import smoothed as smoothed_files
from benchmarks.faults.editor.recording import write_folder
from benchmarks.faults.editor.sources import SOURCES
from solver.capture.subject.opened_subject import open_subject
from solver.common.filters import low_pass
from solver.diagnosis.causes.contact_edges import fall_off, filtered_nats, log_cutoff, usual_fall_off
from solver.diagnosis.causes.effect import Fitted
from solver.diagnosis.causes.filter_mismatch import FilterMismatch, sharpen, with_tails
from solver.diagnosis.diagnose_subject import diagnose
from solver.fitting.settings import Settings
from solver.simulate.demo_subject import MARKERS
from solver.simulate.laboratory import MeasurementSettings, measure, plates_under

WINDOW = 6  # frames: 0.06 s, over which forces are compared


def smoothed(capture, cutoff_Hz, *, threshold_N, point_from_N=0.0):
    """Forces and moments filtered; zeros where the plate's software then sees no load.

    Below `point_from_N` it writes the point of pressure as zero, so that moments are lost before forces.
    """
    plates = []
    for plate in capture.plates:
        wrench = np.hstack([plate.force_ground, plate.moment_ground])
        wrench = filtfilt(*butter(2, cutoff_Hz, fs=plate.rate), wrench, axis=0)
        if threshold_N:
            wrench[wrench[:, 1] < threshold_N] = 0.0
        wrench[wrench[:, 1] < point_from_N, 3:] = 0.0
        plates.append(replace(plate, force_ground=wrench[:, :3], moment_ground=wrench[:, 3:]))
    return replace(capture, plates=tuple(plates))


def misfit(scene, cutoff_Hz):
    """Sum of squares of what is left of the balance in windows, moments about the centre of mass.

    None as cutoff: of the balance without the effect. Newtons and newton metres count alike.
    """
    given = scene.measured_ground
    if cutoff_Hz is not None:
        given = given + FilterMismatch("all").signature(scene, (np.log(cutoff_Hz),)).fixed
    left = low_pass(scene.required_ground, scene.rate, scene.plates[0].conditioning.cutoff_Hz) - given
    left[:, 3:] -= np.cross(scene.com_ground, left[:, :3])
    inside = left[10:-10]
    count = len(inside) // WINDOW
    return float((inside[: count * WINDOW].reshape(count, WINDOW, 6).mean(axis=1) ** 2).sum())


@pytest.fixture(scope="module", params=[True, False], ids=["zeros while unloaded", "noise while unloaded"])
def noisy(request, walk):
    plates = plates_under(walk.contacts, (0.0, walk.scenario.duration))
    settings = MeasurementSettings(zeroed=request.param)
    return request.param, measure(walk, plates, MARKERS, settings, np.random.default_rng(2))


@pytest.mark.parametrize("cutoff_Hz", [6.0, 10.0])
def test_the_cutoff_of_a_walk_is_found_within_a_tenth(noisy, seen, cutoff_Hz):
    zeroed, capture = noisy
    scene = seen(smoothed(capture, cutoff_Hz, threshold_N=12.0 if zeroed else 0.0))
    found = minimize_scalar(
        lambda log_cutoff: misfit(scene, np.exp(log_cutoff)),
        bounds=(np.log(cutoff_Hz) - 0.5, np.log(cutoff_Hz) + 0.5),
        method="bounded",
    )
    assert np.exp(found.x) == pytest.approx(cutoff_Hz, rel=0.1)
    assert found.fun < 0.2 * misfit(scene, None)


@pytest.mark.parametrize("decimals", [6, 0], ids=["as filtered", "rounded to whole newtons"])
def test_noise_of_single_samples_speaks_against_a_filter_and_rounding_does_not(noisy, seen, decimals):
    zeroed, capture = noisy
    assert FilterMismatch.candidates([seen(capture)]) == []
    smooth = smoothed(capture, 20.0, threshold_N=12.0 if zeroed else 0.0)
    rounded = tuple(replace(p, force_ground=np.round(p.force_ground, decimals)) for p in smooth.plates)
    (found,) = FilterMismatch.candidates([seen(replace(smooth, plates=rounded))])
    assert found.id == "filter_mismatch"


def test_a_point_that_is_lost_before_the_force_does_not_bend_the_tails(walk, seen):
    """Samples between the two thresholds have a moment that is no tail of any filter."""
    plates = plates_under(walk.contacts, (0.0, walk.scenario.duration))
    capture = measure(walk, plates, MARKERS, MeasurementSettings(), np.random.default_rng(2))
    whole, lost = (
        seen(smoothed(capture, 6.0, threshold_N=12.0, point_from_N=least_N)) for least_N in (0.0, 26.0)
    )
    assert misfit(lost, 6.0) < 1.5 * misfit(whole, 6.0)
    assert misfit(lost, 6.0) < 0.2 * misfit(lost, None)


def test_forces_that_were_not_smoothed_are_never_better_sharpened(noisy, seen):
    scene = seen(noisy[1])
    left = [misfit(scene, cutoff) for cutoff in (4.0, 6.0, 8.0, 11.0, 15.0, 20.0)]
    assert min(left) > misfit(scene, None)


@pytest.mark.parametrize("cutoff_Hz", [6.0, 12.0])
def test_what_the_filter_leaves_comes_back(cutoff_Hz):
    """A bump whose spectrum lies below the cutoff is restored; noise grows twentyfold at most."""
    rate = 1000.0
    times = np.arange(3000) / rate
    bump = np.exp(-0.5 * ((times - 1.5) * 2 * np.pi * cutoff_Hz / 3) ** 2)[:, None]
    b, a = butter(2, cutoff_Hz, fs=rate)
    blunt = filtfilt(b, a, bump, axis=0)
    assert np.abs(blunt - bump).max() > 0.01
    np.testing.assert_allclose(sharpen(blunt, rate, cutoff_Hz), bump, atol=0.002)
    for frequency in (1.0, 5.0, 15.0, 30.0, 100.0):
        tone = np.sin(2 * np.pi * frequency * times)[:, None]
        assert np.abs(sharpen(tone, rate, cutoff_Hz)[800:-800]).max() < 20.1


@pytest.mark.parametrize("cutoff_Hz", [6.0, 10.0])
def test_tails_below_a_threshold_are_put_back(cutoff_Hz):
    """A contact with an end; what the filter lets ring beyond it, cut off, follows from where it was cut."""
    rate = 1000.0
    times = np.arange(2000) / rate
    contact = np.where((times > 0.6) & (times < 1.3), np.sin(np.pi * (times - 0.6) / 0.7), 0.0)
    force = contact[:, None] * (90.0, 800.0, -40.0)
    b, a = butter(2, cutoff_Hz, fs=rate)
    smooth = filtfilt(b, a, force, axis=0)
    cut = np.where(smooth[:, [1]] < 12.0, 0.0, smooth)
    assert np.abs(smooth[cut[:, 1] == 0]).max() > 10
    np.testing.assert_allclose(with_tails(cut, rate, cutoff_Hz), smooth, atol=0.3)
    np.testing.assert_array_equal(with_tails(smooth, rate, cutoff_Hz), smooth)


def test_estimates_bounds_and_the_practical_minimum(crisp, seen):
    scene = seen(crisp)
    (candidate,) = FilterMismatch.candidates([scene])
    nothing = np.zeros(0), np.zeros((0, 0))
    estimate = candidate.estimates([scene], Fitted((np.log(6.0),), (0.05,), *nothing))["cutoff_Hz"]
    assert (estimate.value, estimate.std) == pytest.approx((6.0, 6 * np.hypot(0.05, 0.03)))
    assert candidate.is_notable({"cutoff_Hz": estimate})
    assert not candidate.is_notable(candidate.estimates([scene], Fitted((np.log(22.0),), (0.1,), *nothing)))
    assert all(candidate.admissible(eta) for eta in candidate.starts([scene]))
    assert not candidate.admissible((np.log(60.0),))
    assert not candidate.admissible((np.log(6.0), -0.1)), "that would smooth the forces"
    assert FilterMismatch.candidates([replace(scene, plates=())]) == []


def test_markers_that_were_smoothed_as_much_leave_the_forces_as_they_are(walk, seen):
    """But for what rings outside contacts, which are set to zero: less than the markers' own error."""
    plates = plates_under(walk.contacts, (0.0, walk.scenario.duration))
    capture = measure(walk, plates, MARKERS, MeasurementSettings(), np.random.default_rng(2))
    scene = seen(smoothed(capture, 6.0, threshold_N=0.0))
    alike, sharper = (
        FilterMismatch("all").signature(scene, eta).fixed[25:-25, :3]
        for eta in ((np.log(6.0), 0.0), (np.log(6.0),))
    )
    assert np.sqrt((sharper**2).mean()) > 10.0
    assert np.sqrt((alike**2).mean()) < 0.01 * scene.weight_N < np.sqrt((sharper**2).mean())


def test_forces_and_markers_that_were_smoothed_alike_are_named_by_the_contacts_edges(real_data, tmp_path):
    """The markers of this recording are smooth up to 6 Hz; its forces are smoothed here by SciPy."""
    recording = next(s for s in SOURCES if s.name == "treadmill walk A").read(real_data)
    write_folder(tmp_path, smoothed_files(5.0)(recording, np.random.default_rng(0))[0])
    answer = diagnose(open_subject(tmp_path), Settings())
    (named,) = answer.effects
    assert named.id == "filter_mismatch"
    stated = named.parameters["cutoff_Hz"]
    assert abs(stated.value - 5.0 / (np.sqrt(2) - 1) ** 0.25) < 2 * stated.std
    assert 0.5 < named.confidence < 0.97, "the edges alone do not make it certain"


def test_smooth_markers_are_thought_of_where_the_edges_speak_for_a_filter(scene):
    told, silent = FilterMismatch("all", fall=-6.0), FilterMismatch("all", fall=-2.0)
    assert {len(eta) for eta in told.starts([scene])} == {2}
    assert {len(eta) for eta in silent.starts([scene])} == {1}
    for candidate in (told, silent):
        assert len(candidate.prior([scene])) == len(candidate.steps()) == len(candidate.starts([scene])[0])
    assert told.prior([scene])[0][0] < silent.prior([scene])[0][0]


RATE = 500.0


def contacts(rise_s=0.05):
    """Two stances of 0.6 s on one plate."""
    t = np.arange(0, 3, 1 / RATE)
    force = np.zeros(len(t))
    for start in (0.6, 1.8):
        force += 800 * np.clip((t - start) / rise_s, 0, 1) * np.clip((start + 0.6 - t) / rise_s, 0, 1)
    return force


@pytest.mark.parametrize("cutoff_Hz", [5.0, 8.0])
def test_a_filter_steepens_it_by_its_own_gains(cutoff_Hz):
    """Those that SciPy has of a single pass, squared; windows see a few Hz about 8 and 20."""
    b, a = butter(2, cutoff_Hz, fs=RATE)
    sound, smooth = contacts(), filtfilt(b, a, contacts())
    _, gain = freqz(b, a, [8.0, 20.0], fs=RATE)
    steeper = usual_fall_off(fall_off(smooth, RATE)) - usual_fall_off(fall_off(sound, RATE))
    assert steeper == pytest.approx(2 * np.log(abs(gain[1]) / abs(gain[0])), rel=0.2)


def test_a_load_that_is_cut_at_the_ends_of_the_file_is_no_edge():
    force = contacts()[int(0.9 * RATE) : int(2.1 * RATE)]  # from one stance into the next
    assert len(fall_off(force, RATE)) == 2
    assert fall_off(np.full(1500, 800.0), RATE) == []
    assert usual_fall_off([]) is None


def test_slow_recordings_and_short_ones_tell_nothing():
    assert fall_off(contacts(), 40.0) == []
    assert fall_off(contacts()[:60], RATE) == []


def median_of(recording):
    edges = [e for t in recording.trials for p in t.plates for e in fall_off(p.force[:, 1], t.force_rate)]
    return usual_fall_off(edges)


@pytest.fixture(scope="module")
def moving(real_data):
    return [s.read(real_data) for s in SOURCES if s.activity in ("walk", "run", "jump")]


def test_sound_recordings_speak_against_a_filter_and_smoothed_ones_for_it(moving):
    """Sound ones were looked at when the figures were set; smoothed ones were made by another program."""
    rng = np.random.default_rng(0)
    spoken, told = [], []
    for recording in moving:
        assert filtered_nats(median_of(recording)) < 0
        edited, _ = smoothed_files(5.0)(recording, rng)
        spoken.append(filtered_nats(median_of(edited)))
        told.append(log_cutoff(median_of(edited)))
    assert min(spoken) > 0
    assert np.median(spoken) > 5
    log_Hz, std = np.array(told).T
    away = (log_Hz - np.log(5.0 / (np.sqrt(2) - 1) ** 0.25)) / std
    assert np.abs(away).max() < 2.5
    assert abs(away.mean()) < 1.0


def test_a_fall_that_speaks_for_no_filter_tells_no_cutoff():
    assert log_cutoff(-1.9) is None
    assert log_cutoff(-7.0)[0] < log_cutoff(-5.0)[0]


def test_it_is_evidence_for_the_filter_and_none_against_it():
    assert FilterMismatch("all", fall=-6.0).seen_elsewhere > 5
    assert FilterMismatch("all", fall=-1.5).seen_elsewhere == 0
    assert FilterMismatch("all").seen_elsewhere == 0
