"""A subject's rows of the tables that the whole release shares, and its figures."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from addb_viewer.dataset.columns import COORDINATE_NAMES, SIDE_WORDS
from addb_viewer.dataset.frame_rows import TrialRows
from addb_viewer.dataset.grid import Segment
from addb_viewer.dataset.gridded_trial import GriddedTrial
from addb_viewer.dataset.release_subject import ReleaseSubject, age_told
from addb_viewer.dataset.trial_labels import TrialLabels
from solver.common.frames_at_once import by_frames
from solver.common.gravity import GRAVITY
from solver.diagnosis.diagnosis_report import Cause
from solver.dynamics.com_trajectory import MassEstimate, com_data
from solver.dynamics.mass import mass_from_forces
from solver.dynamics.thresholds import verdicts
from solver.dynamics.trajectory.extension import Extension
from solver.fitting.fit_result import Fit
from solver.fitting.seen_part import seen_part
from solver.fitting.settings import Settings
from solver.gait.trial_gait import overground_speed, treadmill_speed
from solver.skeleton.forward import body_poses

Row = dict[str, Any]  # a row of a table: value by column, None for null


def measures(gridded: GriddedTrial, rows: Segment, mass_kg: float, height_m: float) -> Row:
    """Marker errors over all frames; residuals over those that are `used`.

    Args:
        gridded: the trial.
        rows: its frames that are meant.
        mass_kg: fitted.
        height_m: of the person.
    """
    dynamics = gridded.trial.dynamics
    assert dynamics is not None
    distance = gridded.trial.marker_errors.distance[rows.rows]
    seen = distance[np.isfinite(distance)]
    residual = dynamics.residual_root[rows.rows][dynamics.used[rows.rows]]
    weight = mass_kg * GRAVITY
    return {
        "marker_rms_m": _rms(seen) if len(seen) else None,
        "marker_max_m": float(seen.max()) if len(seen) else None,
        "linear_rms_bw": _rms_norm(residual[:, :3], weight),
        "angular_rms_bwh": _rms_norm(residual[:, 3:], weight * height_m),
    }


def verdicts_of(row: Row) -> dict[str, bool | None]:
    """Which limits the residuals keep: linear, angular, and both as the dataset paper has them.

    Args:
        row: of `measures`.
    """
    told = verdicts(row["linear_rms_bw"], row["angular_rms_bwh"])
    linear, angular, paper = told.linear, told.angular, told.angular_paper
    unknown = linear is None or angular is None
    return {
        "linear": linear,
        "angular": angular,
        "hicks": None if unknown else bool(linear and angular),
        "paper": None if unknown else bool(linear and paper),
    }


def phase_shares(gridded: GriddedTrial, rows: Segment, right: int) -> Row:
    """Shares of the counting frames with no foot on a plate, one, or both; None without such frames.

    Args:
        gridded: the trial.
        rows: its frames that are meant.
        right: column of the right foot.
    """
    contacts = gridded.trial.contacts
    assert contacts is not None
    on_plate = contacts.in_contact[rows.rows][gridded.verdicts.counts[rows.rows]]
    names = ("flight_share", "single_right_share", "single_left_share", "double_share")
    if not len(on_plate):
        return dict.fromkeys(names)
    number = on_plate[:, right].astype(int) + 2 * on_plate[:, 1 - right].astype(int)
    return dict(zip(names, (np.bincount(number, minlength=4) / len(number)).tolist(), strict=True))


def held_out(gridded: GriddedTrial) -> Row:
    """Residuals on held-out blocks, RMS; None where none was held out."""
    found = gridded.trial.held_out
    if found is None or not found.frames.any():
        return {"held_out_linear_rms_N": None, "held_out_angular_rms_Nm": None}
    missed: Float[np.ndarray, "frames 6"] = found.residual_root[found.frames]
    return {
        "held_out_linear_rms_N": _rms_norm(missed[:, :3], 1.0),
        "held_out_angular_rms_Nm": _rms_norm(missed[:, 3:], 1.0),
    }


def _rms(values: Float[np.ndarray, " n"]) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _rms_norm(vectors: Float[np.ndarray, "n 3"], unit: float) -> float | None:
    return _rms(np.linalg.norm(vectors, axis=1)) / unit if len(vectors) else None


GAITS = ("walk", "run")


def subject_row(
    fit: Fit, who: ReleaseSubject, settings: Settings, *, key: str, notes: Sequence[str], sides: Sequence[str]
) -> Row:
    """Its row of `subjects`.

    Args:
        fit: solved.
        who: it is.
        settings: of the fit.
        key: SHA-256 of all that it was made from.
        notes: of the fit, without names.
        sides: of its two feet.
    """
    subject, told = fit.subject, _weighed(fit, settings)
    mass, height = subject.mass_kg, subject.height_m
    feet = next(trial.contacts.foot_bodies for trial in fit.trials if trial.contacts)
    return {
        "subject_id": who.subject_id,
        "person_id": who.person_id,
        "source": who.source,
        "laboratory": who.laboratory,
        "licence": who.licence,
        "consent": who.consent,
        "citation": who.citation,
        "url": who.url,
        "sex": subject.sex,
        "age_years": age_told(subject.age_years),
        "height_m": fit.height_m,
        "mass_kg": fit.mass_kg,
        "mass_entered_kg": mass,
        "mass_from_forces_kg": None if told is None else told.mass_kg,
        "mass_from_forces_std_kg": None if told is None else told.std_kg,
        "bmi": None if mass is None or height is None else mass / height**2,
        "model": "default body" if subject.model is None else "own model",
        "bodies": len(fit.skeleton.bodies),
        "dofs": len(fit.skeleton.dofs),
        "arms": any(name.startswith(("humerus", "ulna", "radius")) for name in fit.skeleton.body_names),
        "contact_bodies": [feet[sides.index(side)] for side in SIDE_WORDS],
        "fit_key": key,
        "notes": [str(note) for note in notes],
    }


def _weighed(fit: Fit, settings: Settings) -> MassEstimate | None:
    """What the plates carried, by the markers' motion."""
    before = fit.groundwork.skeleton if fit.groundwork else fit.skeleton
    data = [
        com_data(before, t.kinematics_only.motion if t.kinematics_only else t.motion, t.contacts, t.mask)
        for t in map(seen_part, fit.trials)
        if t.contacts is not None and t.mask is not None
    ]
    return mass_from_forces(data, settings.com)


def trial_row(rows: TrialRows, fit: Fit, labels: TrialLabels, extended: bool) -> Row:
    """A trial's row of `trials`; where its rows begin in each file is added when they are written.

    Args:
        rows: of the trial.
        fit: of the subject.
        labels: what is said of it.
        extended: whether an accepted cause acts in it.
    """
    grid, trial = rows.gridded.grid, rows.gridded.trial
    figures = measures(rows.gridded, Segment(0, grid.frames), fit.mass_kg, fit.height_m)
    kept = verdicts_of(figures)
    return {
        "trial_id": rows.trial_id,
        "subject_id": rows.subject_id,
        "name": rows.gridded.name,
        "rate_native_hz": grid.native_rate,
        "filter_cutoff_hz": rows.gridded.cutoff_Hz,
        "frames": grid.frames,
        "duration_s": (grid.frames - 1) / grid.rate,
        "reviewed": labels.finished,
        "mask_source": trial.mask.source if trial.mask else "none",
        "has_dynamics": trial.kinematics_only is not None,
        "activity": labels.activity,
        "activity_sub": labels.activity_sub,
        "activity_confidence": labels.confidence,
        "activity_by": labels.by,
        "trial_type": labels.trial_type,
        **average_speed(rows, Segment(0, grid.frames), labels),
        **figures,
        **held_out(rows.gridded),
        "hicks_linear": kept["linear"],
        "hicks_angular": kept["angular"],
        "hicks_paper": kept["paper"],
        "extension_applied": extended,
    }


def segment_rows(rows: TrialRows, fit: Fit, labels: TrialLabels) -> list[Row]:
    """A trial's rows of `segments`."""
    found = []
    for number, segment in enumerate(rows.cuts.kept):
        figures = measures(rows.gridded, segment, fit.mass_kg, fit.height_m)
        kept = verdicts_of(figures)
        found.append(
            {
                "segment_id": f"{rows.trial_id}/{number}",
                "trial_id": rows.trial_id,
                "subject_id": rows.subject_id,
                "segment": number,
                "start_frame": segment.start,
                "end_frame": segment.end,
                "counted": int(rows.gridded.verdicts.counts[segment.rows].sum()),
                **average_speed(rows, segment, labels),
                **figures,
                **phase_shares(rows.gridded, segment, rows.sides.index("r")),
                "clinical_paper": kept["paper"],
                "clinical_hicks": kept["hicks"],
            }
        )
    return found


def contact_rows(rows: TrialRows) -> list[Row]:
    """A trial's rows of `contacts`."""
    return [
        {
            "trial_id": rows.trial_id,
            "foot": SIDE_WORDS[rows.sides[phase.foot]],
            "start_frame": phase.start,
            "end_frame": phase.end,
            "measured_share": phase.loaded,
        }
        for phase in rows.gridded.phases
    ]


def activity_rows(rows: TrialRows, labels: TrialLabels) -> list[Row]:
    """A trial's rows of `activities`."""
    found = []
    for said in labels.stretches:
        start, end = rows.gridded.grid.frames_nearest_to(said.start, said.end)
        if start < end:
            found.append(
                {
                    "trial_id": rows.trial_id,
                    "start_frame": start,
                    "end_frame": end,
                    "activity": said.activity,
                    "activity_sub": said.subclass,
                    "activity_by": said.by,
                    "activity_confidence": said.confidence,
                    "reviewer": said.reviewer,
                }
            )
    return found


def review_rows(rows: TrialRows, labels: TrialLabels) -> list[Row]:
    """A trial's rows of `reviews`: what does not count, why, and who says so."""
    trial = rows.gridded.trial
    assert trial.mask is not None
    assert trial.contacts is not None
    side = dict(zip(trial.contacts.foot_bodies, rows.sides, strict=True))
    found: dict[tuple, Row] = {}
    for k, (start, end, foot, reason) in enumerate(trial.mask.reasons):
        whose = SIDE_WORDS[side[foot]] if foot else "both"
        source = trial.mask.source_of(k)
        row = {
            "trial_id": rows.trial_id,
            "start_frame": start,
            "end_frame": end,
            "foot": whose,
            "reason": reason,
            "source": source,
            "reviewer": labels.reviewer_of(reason, foot, start, end, rows.gridded.grid),
        }
        found[start, end, whose, reason, source] = row
    return list(found.values())


def coordinate_rows(fit: Fit, subject_id: str) -> list[Row]:
    """A subject's rows of `coordinates`."""
    places: dict[str, int] = {}
    found = []
    for coordinate in fit.skeleton.coordinates:
        known = coordinate.name in COORDINATE_NAMES
        kind = "still" if not coordinate.free else "default" if known else "other"
        place = places.get(kind, 0)
        places[kind] = place + 1
        low, high = coordinate.range
        found.append(
            {
                "subject_id": subject_id,
                "list": kind,
                "place": COORDINATE_NAMES.index(coordinate.name) if kind == "default" else place,
                "name": coordinate.name,
                "unit": "m" if coordinate.motion == "translation" else "rad",
                "locked": coordinate.locked,
                "coupled_to": coordinate.coupled_to,
                "low": low if np.isfinite(low) else None,
                "high": high if np.isfinite(high) else None,
            }
        )
    return found


def cause_rows(who: ReleaseSubject, extension: Extension | None, named: Sequence[Cause]) -> list[Row]:
    """A subject's rows of `causes`: accepted ones, and what the last diagnosis named beside them.

    Args:
        who: it is.
        extension: accepted causes; None: none.
        named: causes of the kept diagnosis.
    """
    found: dict[tuple, Row] = {}
    for effect in named:
        found[effect.id, effect.target] = {
            "subject_id": who.subject_id,
            "trial_id": None if effect.trial is None else who.trial_id(effect.trial),
            "cause": effect.id,
            "target": effect.target,
            "parameters": _json({name: figure.value for name, figure in effect.parameters.items()}),
            "std": _json({name: figure.std for name, figure in effect.parameters.items()}),
            "sureness": effect.confidence,
            "state": "named",
        }
    for cause in extension.named if extension else ():
        before = found.get((cause.id, cause.target), {})
        found[cause.id, cause.target] = {
            "trial_id": None,
            "sureness": None,
            **before,
            "subject_id": who.subject_id,
            "cause": cause.id,
            "target": cause.target,
            "parameters": _json({name: value for name, (value, _) in cause.parameters.items()}),
            "std": _json({name: std for name, (_, std) in cause.parameters.items()}),
            "state": "accepted",
        }
    return list(found.values())


def _json(values: Mapping[str, float | None]) -> str:
    return json.dumps(values, sort_keys=True)


def average_speed(rows: TrialRows, stretch: Segment, labels: TrialLabels) -> Row:
    """Speed [m/s] and how it was found; None where nobody says that it is gait, or where.

    Args:
        rows: of the trial.
        stretch: frames that are meant.
        labels: what people say of the trial.
    """
    kind, speed = labels.trial_type, None
    if labels.activity in GAITS and kind == "overground":
        velocity = np.asarray(rows.first_pass.com_vel)[stretch.rows]
        speed = overground_speed(velocity[np.isfinite(velocity).all(axis=1)])
    elif labels.activity in GAITS and kind == "treadmill":
        speed = _on_belt(rows, stretch)
    return {"average_speed_m_s": speed, "speed_kind": None if speed is None else kind}


def _on_belt(rows: TrialRows, stretch: Segment) -> float | None:
    """By heels and toes of standing feet: origins of the feet and of the bodies that they carry."""
    trial, skeleton = rows.gridded.trial, rows.skeleton
    assert trial.contacts is not None
    grid, places = rows.gridded.grid, []
    for name in trial.contacts.foot_bodies:
        foot = skeleton.body_index(name)
        places.append([foot, *(body for body, joint in enumerate(skeleton.joints) if joint.parent == foot)])
    on_ground = np.zeros((grid.frames, len(rows.sides)), dtype=bool)
    for phase in rows.gridded.phases:
        on_ground[phase.start : phase.end, phase.foot] = True
    low = min(map(len, places))
    low_bodies = [own[:low] for own in places]
    q = (trial.kinematics_only or trial).motion.q[stretch.rows]
    points = by_frames(lambda q: body_poses(skeleton, q)[1][:, low_bodies], q)
    return treadmill_speed(points, on_ground[stretch.rows], grid.rate)
