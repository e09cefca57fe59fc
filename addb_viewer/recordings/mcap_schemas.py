"""JSON schemas of the messages that no well-known schema fits; a title names each in every viewer."""

import json
from collections.abc import Mapping
from typing import Any

NUMBER = {"type": ["number", "null"]}
TEXT = {"type": ["string", "null"]}
VECTOR = {"type": ["array", "null"], "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
FRAME = {"type": "integer", "description": "counted from 0"}
TIME = {"type": "number", "description": "on the recording's clock [s]"}
RANGE = {"type": "array", "items": {"type": "integer"}, "minItems": 2, "maxItems": 2}

RESIDUAL, MARKER_ERROR, PLATES, JOINTS, FLAG, CAUSE = (
    "addb.Residual",
    "addb.MarkerError",
    "addb.PlateForces",
    "addb.Joints",
    "addb.Flag",
    "addb.Cause",
)
ANALOG = "addb.Analog"
METRICS, EDIT, PROGRESS = "addb.TrialMetrics", "addb.ReviewEdit", "addb.SolverProgress"


def _schema(title: str, description: str, **properties: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": title,
        "description": description,
        "type": "object",
        "properties": properties,
        "required": list(properties),
    }


SCHEMAS = {
    schema["title"]: schema
    for schema in (
        _schema(
            RESIDUAL,
            "What the motion demands less what was measured, ground frame; the moment about the root joint's "
            "centre. `used` says whether the frame's forces count.",
            frame=FRAME,
            time_s=TIME,
            used={"type": "boolean"},
            force_N=VECTOR,
            moment_Nm=VECTOR,
            force_norm_N=NUMBER,
            moment_norm_Nm=NUMBER,
            before_force_norm_N=NUMBER,
            before_moment_norm_Nm=NUMBER,
            force_bound_N=NUMBER,
            moment_bound_Nm=NUMBER,
        ),
        _schema(
            MARKER_ERROR,
            "Distance of the model's markers from the measured ones on one frame.",
            frame=FRAME,
            time_s=TIME,
            rms_m=NUMBER,
            largest_m=NUMBER,
            worst=TEXT,
            before_rms_m=NUMBER,
        ),
        _schema(
            PLATES,
            "Unfiltered forces on the person at the samples nearest to the frame, in the ground frame.",
            frame=FRAME,
            time_s=TIME,
            plates={
                "type": "array",
                "items": {
                    "type": "object",
                    "properties": {
                        "name": {"type": "string"},
                        "force_N": VECTOR,
                        "cop_m": VECTOR,
                        "foot": TEXT,
                    },
                },
            },
        ),
        _schema(
            JOINTS,
            "Angles of all joints, and torques of all but the root's, in words: right_knee_flexion_angle. "
            "A torque is positive where its angle grows; `used` says whether the frame's forces count.",
            frame=FRAME,
            time_s=TIME,
            used={"type": ["boolean", "null"]},
            angles_deg={"type": "object", "additionalProperties": NUMBER},
            torques_Nm={"type": "object", "additionalProperties": NUMBER},
        ),
        _schema(
            ANALOG,
            "One sample of the recording's analog channels that are no force plate's, as the file has them; "
            "their units are in the metadata `TRIAL analog`.",
            time_s=TIME,
            values={"type": "object", "additionalProperties": NUMBER},
        ),
        _schema(
            FLAG,
            "A foot's force does not count on frames a to b − 1; `foot` is null for all feet.",
            trial={"type": "string"},
            range=RANGE,
            foot=TEXT,
            reason={"type": "string"},
            source={"type": "string"},
        ),
        _schema(
            CAUSE,
            "What a diagnosis names, in the shape of an effect of `diagnose --json`.",
            trial={"type": "string"},
            range=RANGE,
            effect={"type": "object"},
        ),
        _schema(
            METRICS,
            "A trial's figures, in the shape of `fit --json`.",
            trial={"type": "string"},
            figures={"type": "object"},
        ),
        _schema(
            EDIT,
            "One line of the review log; `kind` and `content` as in the database.",
            number={"type": "integer"},
            trial={"type": "string"},
            author={"type": "string"},
            made_at={"type": "string", "format": "date-time"},
            kind={"type": "string"},
            content={"type": "object"},
        ),
        _schema(
            PROGRESS,
            "A report of the solver; `fraction` of the whole work.",
            stage={"type": "string"},
            fraction={"type": "number"},
            seconds={"type": "number"},
            values={"type": "object"},
        ),
    )
}


def schema_text(title: str) -> bytes:
    """A schema as a file carries it."""
    return json.dumps(SCHEMAS[title]).encode()
