"""The recordings, and the model scaled to them; what plates read under somebody who stands still on them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.capture.capture import Capture, ForcePlate, Subject, TrialFiles, UnreadTrial
from solver.capture.plates.conditioning import condition
from solver.capture.subject.opened_subject import read_trials
from solver.capture.subject.same_motion import shown_by
from solver.capture.trial import read_trial
from solver.common.cpu_timer import CpuTimer
from solver.common.errors import SolverError
from solver.common.memory_release import release_memory
from solver.common.progress import Progress, silent
from solver.contact.needed_segments import UPRIGHT, hips_over_ankles
from solver.contact.sole import independent_feet, soles
from solver.dynamics.com_settings import BLOCK_S
from solver.dynamics.com_trajectory import MassEstimate, Standing
from solver.dynamics.mass import LIGHTEST_KG
from solver.dynamics.root_wrench import centre_of_mass_of
from solver.dynamics.trajectory.extension import Extension
from solver.fitting.failing_trials import about
from solver.fitting.fit_result import Groundwork
from solver.fitting.provenance import provenance_of
from solver.fitting.settings import Settings
from solver.fitting.state import FitState, KeptModel, Recordings
from solver.kinematics.calibration import calibrate, choose_frames, start_poses
from solver.kinematics.hip_width import expected_hip_width
from solver.kinematics.inverse_kinematics import inverse_kinematics
from solver.kinematics.kept_calibration import kept_calibration
from solver.kinematics.label_faults.repair import repair_labels_of
from solver.kinematics.marker_matching import MarkerMatch
from solver.kinematics.marker_naming import name_markers
from solver.kinematics.mirror_image import mirror_notes
from solver.kinematics.model_ownership import Ownership, whose_model
from solver.kinematics.upright_pelvis import pitch_of_spines
from solver.markers.mapping_file import chosen_for
from solver.markers.person_count import of_one_person
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import body_poses
from solver.skeleton.skeleton import Skeleton
from solver.skeleton.subject_model import load_subject_model

POSES = 12  # of somebody who stands still
SHORTEST_S = 0.5
# of the weight: how far it spreads over four fifths of the time; who sways keeps within 5 %
STEADY_SPREAD_SHARE = 0.1
UNDER_M = 0.05  # from below the centre of mass to where it presses: within 2.7 cm there; one of two feet, 10
PRESSED_SOLE_SHARE = 0.75  # of a sole's length and width, about its pieces' middles: pressure spares the rim
RIM_M = 0.03  # by which soles of the model may be misplaced over a plate's edge


def read_recordings(
    subject: Subject,
    chosen: Sequence[TrialFiles],
    settings: Settings,
    *,
    instead: Mapping[str, Capture] | None = None,
    failed: tuple[UnreadTrial, ...] = (),
    extension: Extension | None = None,
    progress: Progress = silent,
) -> FitState:
    """Where a solve begins: recordings as they are, and which of their labels is which marker of the model.

    Args:
        subject: whose.
        chosen: trials to be read.
        settings: of every stage.
        instead: recordings in place of those that the files hold, by trial.
        failed: trials that failed before.
        extension: what acts beside the recorded forces.
        progress: told each trial; may raise `Cancelled`.
    """
    cpu_timer = CpuTimer()
    with cpu_timer("load"):
        generic = _generic(subject)
        read = read_trials(
            subject,
            chosen,
            settings.reading,
            instead=instead,
            progress=lambda name: progress(f"reading {name}", 0.0),
        )
        read = replace(read, unread=(*read.unread, *failed))
    mixed = of_one_person(subject, read.captures, read.static)
    named = name_markers(
        generic,
        [c.markers for c in (*read.captures, *([read.static] if read.static else ()))],
        default_body=subject.model is None,
        chosen=chosen_for(subject),
        settings=settings.kinematics,
    )
    body = named.match.skeleton(named.skeleton)
    notes = (*read.notes, *mixed, *named.match.notes)
    return FitState(
        subject,
        Groundwork(body, named.match, notes, read.unread),
        body,
        extension=extension,
        read=Recordings(generic, tuple(read.captures), read.static, named.landmarks),
        seconds=cpu_timer.seconds,
    )


def repair_labels(state: FitState, settings: Settings) -> FitState:
    """Markers under exchanged or wrong labels are put where they belong, or left out.

    Raises:
        TrialFailedError: from what a trial alone does.
    """
    cpu_timer, recordings, repaired = CpuTimer(), state.recordings, []
    for capture in recordings.captures:
        others = [other.markers for other in recordings.shown if other is not capture]
        with cpu_timer("load"), about(capture.name):
            repaired.append(
                repair_labels_of(
                    capture,
                    others,
                    state.groundwork.match,
                    state.skeleton,
                    settings.label_repair,
                    accepted=state.extension.exchanges if state.extension else (),
                )
            )
    captures, faults = zip(*repaired, strict=True)
    release_memory()
    load = state.seconds["load"] + cpu_timer.seconds["load"]
    return replace(
        state,
        read=replace(recordings, captures=captures, label_faults=faults),
        seconds={**state.seconds, "load": load},
    )


def scale_model(state: FitState, settings: Settings, progress: Progress) -> FitState:
    """The model with the person's proportions and with markers where they are on the body."""
    subject, recordings, match = state.subject, state.recordings, state.groundwork.match
    body, static, cpu_timer = state.skeleton, state.recordings.static, CpuTimer()
    with cpu_timer("scaling"):
        frames = choose_frames(
            [match.observed(c.markers) for c in recordings.captures],
            match.observed(static.markers) if static else None,
            settings.kinematics,
        )
        mirrored = [
            note.in_trial(capture.name)
            for capture, some in zip(recordings.captures, frames.places, strict=True)
            for note in mirror_notes(body, match.observed(capture.markers)[some], settings.kinematics)
        ]
        start_q, _ = start_poses(body, frames.observed_ground, settings.kinematics, subject.height_m)
        frames = replace(frames, start_q=start_q)
        ownership = Ownership(is_scaled=False)
        if subject.model is not None:
            ownership = whose_model(
                recordings.generic,
                body,
                frames,
                settings.kinematics,
                file_name=subject.model.name,
                mass_kg=subject.mass_kg,
                said=subject.model_is,
            )
        names = recordings.generic.marker_names
        calibration = calibrate(
            body,
            frames,
            settings.kinematics,
            registered_std=ownership.offset_std(body, names),
            height_m=subject.height_m,
            mass_kg=subject.mass_kg,
            hip_width_m=expected_hip_width(
                recordings.landmarks, match, [c.markers for c in recordings.shown]
            ),
            pitch_of_spines=pitch_of_spines(body, recordings.landmarks) if subject.model is None else None,
            progress=progress,
        )
    notes = (*state.groundwork.notes, *mirrored, *ownership.notes, *calibration.notes)
    if state.session is not None:
        kept = kept_calibration(calibration, subject.mass_kg, notes)
        state.session.next = KeptModel(kept, made_for(state, settings))
    return replace(
        state,
        groundwork=replace(state.groundwork, skeleton=calibration.skeleton, notes=notes),
        skeleton=calibration.skeleton,
        seconds={**state.seconds, **cpu_timer.seconds},
    )


def made_for(state: FitState, settings: Settings) -> tuple[object, ...]:
    """What has to be the same for a kept model to be of use: all that scaling goes by but the trials."""
    return (
        tuple(provenance_of(state.subject, ()).items()),
        state.skeleton.marker_names,
        state.recordings.landmarks,
        settings.kinematics,
    )


def weigh_who_stands(state: FitState, settings: Settings) -> FitState:
    """Whoever stands still, upright, with the whole weight on plates; asked where nobody entered a mass.

    All plates together press below the centre of mass, or those do that both soles are over: what others
    read is not of this person. Where none do, all count if both soles are over some that carry something: of
    a foot on the floor beside them its force would be missing.
    """
    subject, static = state.subject, state.recordings.static
    if subject.mass_kg is not None:
        return state
    found = []
    for capture in (*_with_plates(subject, static, settings), *state.recordings.captures):
        what = shown_by(capture.markers)
        if not capture.plates or not what.is_still or what.seconds < SHORTEST_S:
            continue
        try:
            who = _who_stands(capture, state.skeleton, state.groundwork.match, subject.foot_bodies, settings)
        except SolverError:  # too few markers for a pose, or a model without feet
            continue
        if who is not None:
            found.append(who)
    return replace(state, groundwork=replace(state.groundwork, standing=tuple(found)))


def _generic(subject: Subject) -> Skeleton:
    if subject.model is not None:
        return load_subject_model(subject.model)
    return default_skeleton(
        **{k: v for k, v in (("mass_kg", subject.mass_kg), ("height_m", subject.height_m)) if v is not None},
        sex=subject.sex,
    )


def _with_plates(subject: Subject, static: Capture | None, settings: Settings) -> tuple[Capture, ...]:
    """The static trial with the forces that its own file holds, where they can be read."""
    if static is None or subject.static is None:
        return ()
    try:
        return (read_trial(TrialFiles(static.name, subject.static, prefix=subject.prefix), settings.reading),)
    except SolverError:
        return ()


def _who_stands(
    capture: Capture, skeleton: Skeleton, match: MarkerMatch, foot_bodies: Sequence[str], settings: Settings
) -> Standing | None:
    markers, g = capture.markers, float(np.linalg.norm(skeleton.gravity))
    plates = [condition(plate, markers.times, settings.conditioning) for plate in capture.plates]
    known = np.all([plate.observed for plate in plates], axis=0)
    if known.sum() < SHORTEST_S * markers.rate:
        return None
    force = np.array([plate.force_ground[known] for plate in plates])
    moment = np.array([plate.moment_ground[known] for plate in plates])
    loaded = np.flatnonzero(np.median(force[..., 1], axis=1) > settings.conditioning.threshold_N)
    if not len(loaded):
        return None
    some = np.unique(np.linspace(0, markers.frames - 1, POSES).round().astype(int))
    rate = markers.rate * len(some) / markers.frames
    q = inverse_kinematics(skeleton, match.observed(markers)[some], rate, settings.kinematics)
    q = q[np.isfinite(q).all(axis=1)]
    upright = hips_over_ankles(skeleton, q)
    if upright is None or np.median(upright) < UPRIGHT:
        return None
    below_com = np.median(centre_of_mass_of(skeleton, q), axis=0)[[0, 2]]

    def off_com(some: Int[np.ndarray, " some"]) -> float:
        f, m = (np.median(wrench[some].sum(axis=0), axis=0) for wrench in (force, moment))
        return float(np.linalg.norm(np.array([m[2], -m[0]]) / f[1] - below_com))

    nearest = loaded[np.argsort([off_com(loaded[[k]]) for k in range(len(loaded))])]
    sets = [nearest[:count] for count in range(len(nearest), 0, -1)]
    both = [some for some in sets if _over([capture.plates[k] for k in some], skeleton, q, foot_bodies)]
    pressing = (some for some in (loaded, *both) if off_com(some) < UNDER_M)
    under = next(iter([*pressing, *both]), None)
    if under is None:
        return None
    up = force[under, :, 1].sum(axis=0)
    low, weight, high = np.percentile(up, [10, 50, 90])
    if weight < LIGHTEST_KG * g or high - low > STEADY_SPREAD_SHARE * weight:
        return None
    blocks = max(1.0, len(up) / (BLOCK_S * markers.rate))
    mass, sampling = float(weight) / g, float(np.std(up)) / g / blocks**0.5
    std = float(np.hypot(sampling, settings.com.plate_gain_std * mass))
    of = ", ".join(plates[k].name for k in sorted(under)) if len(under) < len(loaded) else "the plates"
    return Standing(f"{of} of {capture.name}", MassEstimate(mass, std, sampling))


def _over(
    plates: Sequence[ForcePlate],
    skeleton: Skeleton,
    q: Float[np.ndarray, "frames dofs"],
    foot_bodies: Sequence[str],
) -> bool:
    """Whether both soles are over these plates."""
    R, p = body_poses(skeleton, q)
    feet = independent_feet(skeleton, foot_bodies)
    pressed = [sole.middle(PRESSED_SOLE_SHARE) for sole in soles(skeleton, feet)]
    points = [np.median(sole.corners_ground(R, p), axis=0)[:, [0, 2]] for sole in pressed]
    corners = [plate.corners_ground[:, [0, 2]] for plate in plates if plate.corners_ground is not None]
    inside = [_within(np.concatenate(points), own) for own in corners]
    return bool(inside and np.any(inside, axis=0).all())


def _within(
    points: Float[np.ndarray, "points 2"], corners: Float[np.ndarray, "4 2"]
) -> Bool[np.ndarray, " points"]:
    """In a plate, or hardly beside it; in the plate's own axes."""
    along, across = corners[1] - corners[0], corners[-1] - corners[0]
    offset = points - corners.mean(axis=0)
    return np.all(
        [
            np.abs(offset @ axis) / np.linalg.norm(axis) < np.linalg.norm(axis) / 2 + RIM_M
            for axis in (along, across)
        ],
        axis=0,
    )
