"""The tables of a release: the one place where columns are described.

Arrow schemas, the metadata of Parquet files, `schema.json`, `croissant.json` and the tables of
`docs/reference/dataset.md` are made from it.
"""

from typing import Any

from addb_viewer.dataset.columns import (
    FRAME_COLUMNS,
    FRAME_KEYS,
    KINEMATICS_COLUMNS,
    MEASURES,
    Column,
    Table,
    vector,
)

FORMAT_VERSION = 1  # of tables and files; a reader refuses a newer one

_SUBJECT = Column("subject_id", "text", "SOURCE/FOLDER")
_TRIAL = Column("trial_id", "text", "SOURCE/FOLDER/TRIAL")
_START = Column("start_frame", "i32", "the first frame of the range, on the release's grid")
_END = Column("end_frame", "i32", "the first frame after the range")
_REVIEWER = Column("reviewer", "text?", "who said it: reviewer_1, reviewer_2 …")
_ACTIVITY = Column(
    "activity", "text", "class: walk, run, stairs, sit-to-stand, jump, squat, lunge, standing …"
)
_SUBCLASS = Column("activity_sub", "text?", "subclass; null where none was given")
_CONFIDENCE = Column(
    "activity_confidence", "f32?", "0 to 1, of a rule; null where a person or nobody said it"
)
_BY = Column("activity_by", "text", "person: confirmed; rule, rule (unlearnt): suggested; nobody")

SUBJECTS = Table(
    "subjects",
    "subjects.parquet",
    "A row a subject: one folder or file with one scaled skeleton",
    (
        _SUBJECT,
        Column("person_id", "text", "SOURCE/PERSON; a person may have several subjects"),
        Column("source", "text", "publication or laboratory's collection", source="subject.toml"),
        Column("laboratory", "text?", "where it was recorded", source="subject.toml"),
        Column("licence", "text", "SPDX expression", source="subject.toml"),
        Column("consent", "text", "public, restricted or unknown", source="subject.toml"),
        Column("citation", "text?", "what to cite, as BibTeX or text", source="subject.toml"),
        Column("url", "text?", "of the source; a DOI as https://doi.org/…", source="subject.toml"),
        Column("sex", "text?", "female or male; null where not entered"),
        Column("age_years", "f32?", "at the recording; above 89: 90", "year"),
        Column("height_m", "f32", "as entered, else of the scaled skeleton", "m", source="fit"),
        Column("mass_kg", "f32", "of the fitted skeleton", "kg", source="fit"),
        Column("mass_entered_kg", "f32?", "as entered", "kg", source="subject.toml"),
        Column("mass_from_forces_kg", "f32?", "that the plates carried", "kg", source="plates"),
        Column("mass_from_forces_std_kg", "f32?", "its standard deviation", "kg", source="plates"),
        Column("bmi", "f32?", "mass / height², both as entered, else null", "kg/m^2"),
        Column("model", "text", "name of the skeleton's model", source="fit"),
        Column("bodies", "i16", "number of the model's bodies"),
        Column("dofs", "i16", "number of its free coordinates"),
        Column("arms", "bool", "whether the model has arms"),
        Column("contact_bodies", "texts", "the two bodies that forces act on: right, left"),
        Column("fit_key", "text", "SHA-256 of all that the fit was made from"),
        Column("notes", "texts", "what the fit assumed or ignored"),
    ),
    key=("subject_id",),
    order=("subject_id",),
)

TRIALS = Table(
    "trials",
    "trials.parquet",
    "A row a trial: one continuous recording, fitted whole",
    (
        _TRIAL,
        _SUBJECT,
        Column("name", "text", "of the trial in its subject"),
        Column("rate_native_hz", "f32", "of the recording's markers", "Hz", source="markers"),
        Column("filter_cutoff_hz", "f32", "of the low-pass that forces and pass F share", "Hz", source="fit"),
        Column("frames", "i32", "on the release's grid, erroneous stretches included"),
        Column("duration_s", "f32", "from the first frame to the last", "s"),
        *(
            column
            for table in ("frames", "kinematics", "markers", "joint_centres", "plates")
            for column in (
                Column(
                    f"{table}_first_row",
                    "i64",
                    "where the trial's rows begin in the subject's file of that table",
                    family="TABLE_first_row",
                ),
                Column(f"{table}_rows", "i32", "how many there are", family="TABLE_rows"),
            )
        ),
        Column("reviewed", "bool", "whether a person has finished the review", source="review"),
        Column("mask_source", "text", "who decided which forces count", source="review"),
        Column("has_dynamics", "bool", "whether the motion was fitted to the forces", source="fit"),
        _ACTIVITY,
        _SUBCLASS,
        _CONFIDENCE,
        _BY,
        Column("trial_type", "text", "overground, treadmill, static or other"),
        Column("average_speed_m_s", "f32?", "of walking or running", "m/s"),
        Column("speed_kind", "text?", "overground or treadmill: how the speed was found"),
        *MEASURES,
        Column("held_out_linear_rms_N", "f32?", "residual force on held-out blocks, RMS", "N", source="fit"),
        Column(
            "held_out_angular_rms_Nm", "f32?", "residual moment on held-out blocks, RMS", "N*m", source="fit"
        ),
        Column("hicks_linear", "bool?", "residual force ≤ 0.05 body weights"),
        Column("hicks_angular", "bool?", "residual moment ≤ 0.01 body weights · height"),
        Column("hicks_paper", "bool?", "linear ≤ 0.05 body weights and angular ≤ 0.1 · height"),
        Column("extension_applied", "bool", "whether an accepted cause acts beside the forces"),
        Column("concerns", "texts", "what somebody should look at: causes named, notes of the fit"),
    ),
    key=("trial_id",),
    order=("trial_id",),
)

SEGMENTS = Table(
    "segments",
    "segments.parquet",
    "A row a segment: at most 2000 frames of a trial; what statistics count",
    (
        Column("segment_id", "text", "TRIAL_ID/NUMBER"),
        _TRIAL,
        _SUBJECT,
        Column("segment", "i16", "number in the trial, from 0"),
        _START,
        _END,
        Column("counted", "i32", "frames that count"),
        Column("average_speed_m_s", "f32?", "of walking or running", "m/s"),
        Column("speed_kind", "text?", "overground or treadmill: how the speed was found"),
        *MEASURES,
        *(
            Column(
                f"{phase}_share",
                "f32?",
                f"share of the counting frames with {words}; null without such frames",
            )
            for phase, words in (
                ("flight", "no foot on a plate"),
                ("single_right", "the right foot alone"),
                ("single_left", "the left foot alone"),
                ("double", "both feet"),
            )
        ),
        Column("clinical_paper", "bool?", "linear ≤ 0.05 body weights and angular ≤ 0.1 · height"),
        Column("clinical_hicks", "bool?", "linear ≤ 0.05 body weights and angular ≤ 0.01 · height"),
    ),
    key=("segment_id",),
    order=("trial_id", "segment"),
)

CONTACTS = Table(
    "contacts",
    "contacts.parquet",
    "A row a contact of a foot with the ground, from plates and the feet's motion",
    (
        _TRIAL,
        Column("foot", "text", "right or left"),
        _START,
        _END,
        Column("measured_share", "f32", "share of its frames on which a plate carries the foot"),
    ),
    key=("trial_id", "foot", "start_frame"),
    order=("trial_id", "start_frame", "foot"),
)

ACTIVITIES = Table(
    "activities",
    "activities.parquet",
    "A row a labelled stretch",
    (_TRIAL, _START, _END, _ACTIVITY, _SUBCLASS, _BY, _CONFIDENCE, _REVIEWER),
    key=("trial_id", "start_frame", "activity_by"),
    order=("trial_id", "start_frame", "activity_by"),
)

COORDINATES = Table(
    "coordinates",
    "coordinates.parquet",
    "A row a coordinate of a subject's model; those in list `other` are in the lists of `frames`",
    (
        _SUBJECT,
        Column(
            "list",
            "text",
            "default: columns of their own in `frames`; other: places of its lists; still: locked or coupled",
        ),
        Column("place", "i16", "in that list, from 0"),
        Column("name", "text", "as the model has it"),
        Column("unit", "text", "rad or m"),
        Column("locked", "bool", "whether it stands still by the model's word"),
        Column("coupled_to", "text?", "the coordinate that it follows"),
        Column("low", "f32?", "end of its range", "rad or m"),
        Column("high", "f32?", "end of its range", "rad or m"),
    ),
    key=("subject_id", "list", "place"),
    order=("subject_id", "list", "place"),
)

REVIEWS = Table(
    "reviews",
    "reviews.parquet",
    "A row a range of frames whose force does not count, of a foot or of both",
    (
        _TRIAL,
        _START,
        _END,
        Column("foot", "text", "right, left or both"),
        Column("reason", "text", "in the words of the review"),
        Column("source", "text", "review, review.json, proposals (detection) or recording"),
        _REVIEWER,
    ),
    key=("trial_id", "start_frame", "end_frame", "foot", "reason", "source"),
    order=("trial_id", "start_frame", "end_frame", "foot", "reason"),
)

CAUSES = Table(
    "causes",
    "causes.parquet",
    "A row a cause that the diagnosis named or a person accepted",
    (
        _SUBJECT,
        Column("trial_id", "text?", "null: of all the subject's trials"),
        Column("cause", "text", "its name in docs/reference/causes.md"),
        Column("target", "text", "what it is about: a plate, a body …"),
        Column("parameters", "text", "JSON: value by name, the unit ends the name"),
        Column("std", "text", "JSON: standard deviation by name"),
        Column("sureness", "f32?", "0 to 1"),
        Column("state", "text", "named, or accepted: part of the model"),
    ),
    key=("subject_id", "trial_id", "cause", "target"),
    order=("subject_id", "cause", "target", "trial_id"),
)

LEFT_OUT = Table(
    "left_out",
    "left_out.parquet",
    "A row for everything that is not in the release, and why",
    (
        Column("level", "text", "subject, trial, range or segment"),
        Column("id", "text", "of the subject, trial or segment"),
        Column("reason", "text", "in one word; docs/reference/dataset.md lists them"),
        Column("detail", "text", "one line"),
        Column("start_frame", "i32?", "of a range or segment, on the release's grid"),
        Column("end_frame", "i32?", "the first frame after it"),
        Column("frames", "i64", "how many are lost; 0 where nobody could count them"),
        Column("hours", "f64", "likewise", "h"),
    ),
    key=("level", "id", "reason", "start_frame"),
    order=("level", "id", "start_frame", "reason"),
)

SPLITS = Table(
    "splits",
    "splits/{name}.parquet",
    "A row a person; `addb-viewer dataset split` writes them",
    (
        Column("person_id", "text", "SOURCE/PERSON"),
        Column("split", "text", "train, dev or test; or the name of a fold"),
    ),
    key=("person_id",),
    order=("person_id",),
)

FRAMES = Table(
    "frames",
    "frames/{subject}.parquet",
    "A row a frame: motion, torques, forces, residuals and labels",
    FRAME_COLUMNS,
    key=("trial_id", "frame"),
    order=("trial_id", "frame"),
)

KINEMATICS = Table(
    "kinematics",
    "kinematics/{subject}.parquet",
    "A row a frame: what markers alone say, unfiltered (pass K)",
    KINEMATICS_COLUMNS,
    key=("trial_id", "frame"),
    order=("trial_id", "frame"),
)


def _long(name: str, about: str, what: Column, *columns: Column) -> Table:
    key = ("trial_id", what.name, "frame")
    own = (*FRAME_KEYS[:2], what, FRAME_KEYS[3], *columns)
    return Table(name, f"{name}/{{subject}}.parquet", about, own, key, key)


MARKERS = _long(
    "markers",
    "A row a marker and frame: where it was seen, and where the fitted skeleton has it",
    Column("marker", "text", "its label in the recording"),
    *vector("measured_{}_m", "f32?", "as recorded; null where not seen", "m", source="markers"),
    *vector("modelled_{}_m", "f32?", "on the skeleton; null where it has no such", "m", source="fit"),
)

JOINT_CENTRES = _long(
    "joint_centres",
    "A row a joint and frame",
    Column("joint", "text", "its name in the model"),
    *vector("root_{}_m", "f32", "centre of the joint", "m", frame="root body", source="fit"),
    *vector("ground_{}_m", "f32", "centre of the joint", "m", source="fit"),
)

PLATES = _long(
    "plates",
    "A row a force plate and frame: as recorded, on the person; null where the recording does not reach",
    Column("plate", "text", "its name in the recording"),
    *vector("force_{}_N", "f32?", "on the person", "N", source="plates"),
    *vector("moment_{}_Nm", "f32?", "about the centre of pressure", "N*m", source="plates"),
    *vector("cop_{}_m", "f32?", "centre of pressure; null while unloaded", "m", source="plates"),
)

ROOT_TABLES = (SUBJECTS, TRIALS, SEGMENTS, CONTACTS, ACTIVITIES, COORDINATES, REVIEWS, CAUSES, LEFT_OUT)
SUBJECT_TABLES = (FRAMES, KINEMATICS, MARKERS, JOINT_CENTRES, PLATES)
TABLES = (*ROOT_TABLES, SPLITS, *SUBJECT_TABLES)


def schema_json() -> dict[str, Any]:
    """All tables as `schema.json` has them."""
    return {"format_version": FORMAT_VERSION, "tables": {table.name: table.as_json() for table in TABLES}}
