"""A diagnosis as plain values, in the shape of `diagnose --json`."""

import math

from solver.diagnosis.diagnosis import Diagnosis, Gain, NamedEffect
from solver.effects.effect import Range


def as_json(diagnosis: Diagnosis) -> dict[str, object]:
    """Plain values; frames are 0-based, end excluded, at the markers' rate."""
    several = len(diagnosis.trials) > 1
    remaining = diagnosis.remaining
    location = remaining.location
    return {
        "verdict": diagnosis.verdict,
        "effects": [_effect(e, several) for e in diagnosis.effects],
        "alternatives": [
            {
                "id": a.id,
                "target": a.target,
                "instead_of": a.instead_of,
                "why": a.why,
                "separate_by": a.separate_by,
            }
            for a in diagnosis.alternatives
        ],
        "gain": {name: _gain(g) for name, g in diagnosis.gain.items()},
        "remaining": {
            "linear_residual_N": remaining.linear_residual_N,
            "noise_floor_N": remaining.noise_floor_N,
            "location": None
            if location is None
            else {
                "body": location.body,
                "rms_force_N": location.rms_force_N,
                "mean_force_N": list(location.mean_force_N),
                "depends_on": location.depends_on,
            },
        },
        "trials": list(diagnosis.trials),
        "notes": list(diagnosis.notes),
    }


def _effect(effect: NamedEffect, several: bool) -> dict[str, object]:
    trials = sorted({r.trial for r in effect.frames})
    return {
        "id": effect.id,
        "target": effect.target,
        "parameters": {
            n: {"value": _finite(e.value), "std": _finite(e.std)} for n, e in effect.parameters.items()
        },
        "confidence": effect.confidence,
        "trial": trials[0] if len(trials) == 1 else None,
        "frames": [_range(r, several) for r in effect.frames],
        "sentence": effect.sentence,
        "remedy": effect.remedy,
    }


def _finite(value: float) -> float | None:
    """None for what the recording says nothing about: JSON knows no infinity."""
    return value if math.isfinite(value) else None


def _range(frames: Range, several: bool) -> list[object]:
    return [frames.trial, frames.start, frames.end] if several else [frames.start, frames.end]


def _gain(gain: Gain) -> dict[str, object]:
    plain: dict[str, object] = {"before": gain.before, "after": gain.after}
    return plain | ({"interval": list(gain.interval)} if gain.interval else {})
