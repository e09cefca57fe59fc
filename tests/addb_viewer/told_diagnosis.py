"""Diagnoses as typed answers, from plain values of which only those that matter are given."""

from solver.common.typed_json import from_plain, plain
from solver.diagnosis.diagnosis_report import Cause, DiagnosisReport

NOTHING_LEFT = {"linear_residual_N": 9.0, "noise_floor_N": 9.8}


def told(figures):
    """The report of plain values; a stretch without a trial is of the first one."""
    trials = figures.get("trials", ["walk"])
    effects = [_with_trials(effect, trials[0]) for effect in figures.get("effects", ())]
    usual = {
        "verdict": "explained",
        "alternatives": [],
        "gain": {},
        "remaining": NOTHING_LEFT,
        "trials": trials,
    }
    remaining = figures.get("remaining", NOTHING_LEFT)
    off = remaining.get("off_the_list")
    if off is not None:
        unlisted = {"trial": None, "sentence": "", "gain_nats": 0.0, **off, "frames": []}
        remaining = remaining | {"off_the_list": unlisted}
    return from_plain(usual | figures | {"effects": effects, "remaining": remaining}, DiagnosisReport)


def told_cause(effect):
    """One cause, likewise."""
    return from_plain(_with_trials(effect, "walk"), Cause)


def _with_trials(one, trial):
    one = one if isinstance(one, dict) else plain(one)
    alone = one.get("trial") or trial
    frames = [list(r) if len(r) == 3 else [alone, *r] for r in one.get("frames", ())]
    return {"target": "all", "parameters": {}, "confidence": 1.0, **one, "frames": frames}
