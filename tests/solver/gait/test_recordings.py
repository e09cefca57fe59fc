"""Events from the feet alone against raw plates: every walk and run among the recordings that has plates."""

from dataclasses import replace

import ezc3d
import numpy as np
import pytest

from solver.capture.plates.force_settings import CONDITIONING
from solver.contact.sole import soles
from solver.gait.gait_events import Kind, Source, events_of
from solver.gait.settings import GAIT
from solver.gait.trial_gait import gait_of
from solver.skeleton.forward import body_poses
from tests.conftest import MARKERS_ALONE

pytestmark = pytest.mark.real

CONTACT_S, OFF_S = 0.020, 0.030  # RMS that is allowed
EDGE_S = 0.03  # a recording's ends, where no filter knows what comes
SEARCH_S = 0.15  # farther off, an event is another one
INNER_S = 0.06  # inside a measured stance, where no event may be

RECORDINGS = {  # with the trials that are taken, where not all are
    "walk_rajagopal2015": None,
    "walk_gait2354_subject01": None,
    "walk_treadmill_stepwidth": None,
    "opencap_subject4": ("walking1", "walkingTO1"),
    "opencap_subject6": ("walking1",),
    "overground_falisse_AdDB": None,
    "overground_camargo2021_AB06": None,
    "c3d_lab_trials/lasem_FAILT01": ("Walk01",),
    "anomalies/tiziana2019_lencioni": None,
    "synthetic_arnold2013_subject01": None,
    "run_treadmill_hamner2013_subject04": None,
    "sprint_overground_dorn2012_JA1_9ms": None,
}


def middles_of_soles(trial, gait, skeleton):
    """Middle of each sole and origin of the root body, frame by frame [m]."""
    R, p = body_poses(skeleton, trial.motion.q)
    return [sole.corners_ground(R, p).mean(axis=1) for sole in soles(skeleton, gait.feet)], p[:, 0]


def compared(trial, gait, skeleton, stances_on_plates):
    """Errors of contacts and foot-offs [s], how many are missed, and how many stand inside a stance."""
    places, root = middles_of_soles(trial, gait, skeleton)
    times, errors, missed, extra = trial.motion.times, {Kind.CONTACT: [], Kind.FOOT_OFF: []}, 0, 0
    for stance in stances_on_plates(trial.capture.plates, places, times):
        own = [event for event in gait.events if event.foot == stance.foot]
        ends = {Kind.CONTACT: stance.on_s, Kind.FOOT_OFF: stance.off_s}
        for kind, measured in ends.items():
            if measured is None:
                continue
            if not times[0] + EDGE_S < measured < times[-1] - EDGE_S or not walks(trial, root, measured):
                continue
            off = [event.time_s - measured for event in own if event.kind == kind]
            nearest = min(off, key=abs, default=np.inf)
            if abs(nearest) > SEARCH_S:
                missed += 1
            else:
                errors[kind].append(nearest)
        first = -np.inf if stance.on_s is None else stance.on_s + INNER_S
        last = np.inf if stance.off_s is None else stance.off_s - INNER_S
        extra += sum(first < event.time_s < last and walks(trial, root, event.time_s) for event in own)
    return errors, missed, extra


def walks(trial, root, time):
    """On a floor: the pelvis goes on by 0.4 m within the second about a time. On a belt: always."""
    near = np.abs(trial.motion.times - time) <= 0.5
    if np.ptp(root[:, [0, 2]], axis=0).max() < 1.0:
        return True
    path = np.diff(root[near][:, [0, 2]], axis=0).sum(axis=0)
    return bool(np.hypot(*path) > 0.4 * np.ptp(trial.motion.times[near]))


def rms(errors):
    return float(np.sqrt(np.mean(np.square(errors)))) if errors else 0.0


@pytest.mark.slow
@pytest.mark.parametrize("recording", RECORDINGS)
def test_feet_alone_against_raw_plates(recorded_fit, recording, stances_on_plates):
    fit = recorded_fit(recording, MARKERS_ALONE, RECORDINGS[recording])
    counted = 0
    for trial in fit.trials:
        gait = gait_of(trial, fit.skeleton, GAIT, CONDITIONING, feet_alone=True)
        assert gait is not None
        assert all(event.source == Source.FEET for event in gait.events)
        errors, missed, extra = compared(trial, gait, fit.skeleton, stances_on_plates)
        contact, off = errors[Kind.CONTACT], errors[Kind.FOOT_OFF]
        print(
            f"| {recording} {trial.capture.name} | {len(contact)} | {1000 * rms(contact):.0f} | {len(off)} | "
            f"{1000 * rms(off):.0f} | {missed} | {extra} |"
        )
        counted += len(contact) + len(off)
        assert (missed, extra) == (0, 0)
        assert rms(contact) < CONTACT_S
        assert rms(off) < OFF_S
    assert counted


def test_with_plates_their_crossings_are_the_events(recorded_fit, stances_on_plates):
    """At the plates' own rate, to a tenth of a millisecond, and each once."""
    fit = recorded_fit("walk_treadmill_stepwidth", MARKERS_ALONE)
    (trial,) = fit.trials
    gait = gait_of(trial, fit.skeleton, GAIT, CONDITIONING)
    assert gait is not None
    places, _ = middles_of_soles(trial, gait, fit.skeleton)
    measured = stances_on_plates(trial.capture.plates, places, trial.motion.times)
    told = {
        (stance.foot, kind, round(time, 2))
        for stance in measured
        for kind, time in ((Kind.CONTACT, stance.on_s), (Kind.FOOT_OFF, stance.off_s))
        if time is not None
    }
    by_force = [event for event in events_of(gait.stances) if event.source == Source.FORCE]
    assert {(event.foot, event.kind, round(event.time_s, 2)) for event in by_force} == told
    assert len(gait.events) == len(told)


def test_figures_of_a_treadmill_walk(recorded_fit):
    """The belt's speed is the walker's; two steps make a stride; widths are a person's."""
    fit = recorded_fit("walk_gait2354_subject01", MARKERS_ALONE)
    (trial,) = fit.trials
    gait = gait_of(trial, fit.skeleton, GAIT, CONDITIONING)
    assert gait is not None
    assert gait.cycles
    p = body_poses(fit.skeleton, trial.motion.q)[1]
    for cycle in gait.cycles:
        heel = p[:, fit.skeleton.body_index(gait.feet[cycle.foot])]
        standing = (trial.motion.times > cycle.start_s + 0.25) & (trial.motion.times < cycle.start_s + 0.4)
        belt = np.polyfit(trial.motion.times[standing], heel[standing, 0], 1)[0]
        assert cycle.speed_m_s == pytest.approx(-belt, rel=0.08)
        assert cycle.stance_share == pytest.approx(0.63, abs=0.04)
        assert 0.4 < cycle.step_length_m / cycle.stride_length_m < 0.6
        assert 0.03 < cycle.step_width_m < 0.25
        assert cycle.cadence_per_min == pytest.approx(120 / cycle.duration_s)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("recording", "file"),
    [
        ("sprint_overground_dorn2012_JA1_9ms", "JA1Gait35.c3d"),
        ("c3d_lab_trials/lasem_FAILT01", "FAILT01_Walk01.c3d"),
    ],
)
def test_events_that_laboratories_stored(real_data, recorded_fit, recording, file):
    """Contacts within 20 ms, foot-offs within 30 ms of each; those at the very end nobody can see."""
    folder = real_data / recording
    if not (folder / file).is_file():
        pytest.skip(f"{folder / file} is not there")
    content = ezc3d.c3d(str(folder / file))
    stored = content["parameters"]["EVENT"]
    points = content["header"]["points"]
    begin = points["first_frame"] / points["frame_rate"]
    times = np.array(stored["TIMES"]["value"])[0] * 60 + np.array(stored["TIMES"]["value"])[1] - begin
    fit = recorded_fit(recording, MARKERS_ALONE, (file.removesuffix(".c3d").split("_")[-1],))
    (trial,) = fit.trials
    gait = gait_of(trial, fit.skeleton, GAIT, CONDITIONING, feet_alone=True)
    assert gait is not None
    compared_events = 0
    for side, label, time in zip(stored["CONTEXTS"]["value"], stored["LABELS"]["value"], times, strict=True):
        at = time + trial.motion.start_time
        if at > trial.motion.times[-1] - 2 * EDGE_S:
            continue
        kind, allowed = (Kind.CONTACT, CONTACT_S) if "Strike" in label else (Kind.FOOT_OFF, OFF_S)
        foot = next(k for k, name in enumerate(gait.feet) if name.endswith(f"_{side[0].lower()}"))
        own = [event.time_s for event in gait.events if (event.foot, event.kind) == (foot, kind)]
        assert min(abs(event - at) for event in own) < allowed, (label, time)
        compared_events += 1
    assert compared_events >= 6


def test_a_runner_is_as_fast_as_the_belt_was_set(recorded_fit):
    """Hamner & Delp 2013 ran this trial at 4.0 m/s."""
    fit = recorded_fit("run_treadmill_hamner2013_subject04", MARKERS_ALONE)
    gait = gait_of(fit.trials[0], fit.skeleton, GAIT, CONDITIONING)
    assert gait is not None
    assert np.mean([cycle.speed_m_s for cycle in gait.cycles]) == pytest.approx(4.0, rel=0.03)


def test_a_foot_out_of_sight_tells_no_event_and_no_cycle(recorded_fit):
    """For 0.3 s about one contact of the right foot, no camera sees that foot."""
    fit = recorded_fit("walk_treadmill_stepwidth", MARKERS_ALONE)
    (trial,) = fit.trials
    seen = gait_of(trial, fit.skeleton, GAIT, CONDITIONING, feet_alone=True)
    assert seen is not None
    lost = next(s.contact_s for s in seen.stances if s.foot == 0 and s.contact_s and s.contact_s > 1.0)
    frames = np.abs(trial.motion.times - lost) < 0.15
    bodies = [fit.skeleton.body_index(name) for name in (seen.feet[0], "toes_r")]
    on_foot = {marker.name for marker in fit.skeleton.markers if marker.body in bodies}
    distance = trial.marker_errors.distance.copy()
    columns = [i for i, name in enumerate(trial.marker_errors.names) if name in on_foot]
    assert columns
    distance[np.ix_(frames, columns)] = np.nan
    hidden = replace(trial, marker_errors=replace(trial.marker_errors, distance=distance))
    gait = gait_of(hidden, fit.skeleton, GAIT, CONDITIONING, feet_alone=True)
    assert gait is not None
    gone = {event for event in seen.events if event.foot == 0 and abs(event.time_s - lost) < 0.15}
    assert set(seen.events) - set(gait.events) == gone
    assert not set(gait.events) - set(seen.events)
    distance[frames, columns[0]] = trial.marker_errors.distance[frames, columns[0]]
    hardly = replace(trial, marker_errors=replace(trial.marker_errors, distance=distance))
    assert gait_of(hardly, fit.skeleton, GAIT, CONDITIONING, feet_alone=True) == seen
    over = {c for c in seen.cycles if c.foot == 0 and c.start_s <= lost + 0.15 and c.end_s >= lost - 0.15}
    assert {c.start_s for c in seen.cycles} - {c.start_s for c in gait.cycles} == {c.start_s for c in over}
    assert over
