"""A release written straight from the schema, so that what reads releases is tested without building one."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from addb_viewer.dataset.release_tables import (
    ACTIVITIES,
    CAUSES,
    CONTACTS,
    COORDINATES,
    FRAMES,
    JOINT_CENTRES,
    KINEMATICS,
    LEFT_OUT,
    MARKERS,
    PLATES,
    REVIEWS,
    SEGMENTS,
    SUBJECTS,
    TRIALS,
)

RATE = 100.0
LABELS = ("walk", "run", "transition", "none")
JOINTS = ("hip_r", "knee_r")


def write(folder, table, rows, subject=""):
    """Rows as dicts; columns that they lack are null, false, zero or empty."""
    schema = table.schema()
    columns = {field.name: [row.get(field.name, _nothing(field)) for row in rows] for field in schema}
    path = folder / table.file(subject)
    path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(pa.Table.from_pydict(columns, schema=schema), path)


def _nothing(field):
    if field.nullable:
        return None
    if pa.types.is_list(field.type):
        return []
    if pa.types.is_string(field.type):
        return ""
    return False if pa.types.is_boolean(field.type) else 0


def frame_rows(subject, trial, count, segments, rng):
    """Random figures for the frames of a trial, in so many segments."""
    rows = []
    for frame in range(count):
        counts = bool(rng.random() < 0.7)
        row = {
            "subject_id": subject["subject_id"],
            "trial_id": trial["trial_id"],
            "segment": frame * segments // count,
            "frame": frame,
            "time_s": frame / RATE,
            "pass": "D",
            "activity": trial["activity"] if frame < count // 2 else LABELS[frame % len(LABELS)],
            "counts": counts,
            "detected_ok": bool(rng.random() < 0.9),
            "reviewed": True,
            "used": counts and 10 <= frame < count - 10,
            "phase": int(rng.integers(4)) if counts else None,
            "marker_rms_m": float(rng.random() * 0.03) if rng.random() < 0.95 else None,
            "q_knee_angle_r": float(rng.normal()),
            "tau_knee_angle_r": float(rng.normal(0, 40)),
        }
        for axis in "xyz":
            row[f"residual_force_{axis}_N"] = float(rng.normal(0, 10)) if counts else None
            row[f"residual_moment_{axis}_Nm"] = float(rng.normal(0, 5)) if counts else None
            for side in "rl":
                row[f"grf_{side}_{axis}_N"] = float(rng.random() * 400) if counts else None
        rows.append(row)
    return rows


def write_release(folder, seed=0):
    """Four subjects of three persons in two sources: the rows of the tables, by name."""
    rng = np.random.default_rng(seed)
    subjects, trials, segments, frames, centres = [], [], [], [], []
    people = (("lab/a1", "lab/a", "lab"), ("lab/a2", "lab/a", "lab"), ("lab/b", "lab/b", "lab"),
              ("field/c", "field/c", "field"))  # fmt: skip
    for k, (subject_id, person, source) in enumerate(people):
        subject = {
            "subject_id": subject_id,
            "person_id": person,
            "source": source,
            "licence": "CC-BY-4.0",
            "consent": "public",
            "sex": ("female", "female", "male", None)[k],
            "age_years": (31.0, 31.0, 64.0, None)[k],
            "height_m": 1.6 + 0.1 * k,
            "mass_kg": 60.0 + 5 * k,
            "bmi": (22.5, 22.5, 24.0, None)[k],
            "model": "default",
            "contact_bodies": ["calcn_r", "calcn_l"],
        }
        subjects.append(subject)
        own_frames, own_centres = [], []
        for name in ("one", "two"):
            count = int(rng.integers(60, 140))
            trial = {
                "trial_id": f"{subject_id}/{name}",
                "subject_id": subject_id,
                "name": name,
                "frames": count,
                "duration_s": (count - 1) / RATE,
                "reviewed": not (k == 2 and name == "two"),
                "has_dynamics": name == "one",
                "activity": ("walk", "run")[name == "two"],
                "rate_native_hz": RATE,
            }
            trials.append(trial)
            rows = frame_rows(subject, trial, count, 2, rng)
            own_frames += rows
            own_centres += [
                {"subject_id": subject_id, "trial_id": trial["trial_id"], "joint": joint, "frame": f}
                | {f"root_{axis}_m": float(rng.normal()) for axis in "xyz"}
                for joint in JOINTS
                for f in range(count)
            ]
            for number in range(2):
                inside = [row for row in rows if row["segment"] == number]
                segments.append(
                    {
                        "segment_id": f"{trial['trial_id']}/{number}",
                        "trial_id": trial["trial_id"],
                        "subject_id": subject_id,
                        "segment": number,
                        "start_frame": inside[0]["frame"],
                        "end_frame": inside[-1]["frame"] + 1,
                        "counted": sum(row["counts"] for row in inside),
                        "average_speed_m_s": float(rng.random() * 4) if number else None,
                    }
                )
        stem = subject_id.replace("/", "__")
        write(folder, FRAMES, own_frames, stem)
        write(folder, JOINT_CENTRES, own_centres, stem)
        for table in (KINEMATICS, MARKERS, PLATES):
            write(folder, table, [], stem)
        frames += own_frames
        centres += own_centres
    write(folder, SUBJECTS, subjects)
    write(folder, TRIALS, trials)
    write(folder, SEGMENTS, segments)
    for table in (CONTACTS, ACTIVITIES, COORDINATES, REVIEWS, CAUSES, LEFT_OUT):
        write(folder, table, [])
    return {
        "subjects": subjects,
        "trials": trials,
        "segments": segments,
        "frames": frames,
        "joint_centres": centres,
    }
