"""A diagnosis as plain values, for `diagnose --json`; and what accepting it changes, for `accept --json`."""

import math
from dataclasses import asdict

from solver.diagnosis.causes.catalogue import ABOUT
from solver.diagnosis.causes.effect import Range
from solver.diagnosis.diagnosis import Diagnosis, Gain, NamedEffect, OffTheList
from solver.diagnosis.direct_checks.statement import STATED_NATS, Statement
from solver.diagnosis.extended_fit import ExtendedGain
from solver.diagnosis.force_histories import ForceHistory
from solver.diagnosis.residual_description import InTrial, ResidualDescription, ResidualSize

MOST_CHANGED = 5  # joint torques that are listed
MOST_REFUSED = 5  # causes whose decisions are told though they are not named
NATS_DIGITS = 2  # evidence is no better known
TIME_HISTORY_DIGITS = 2  # [s, N, N·m] what is only drawn


def as_json(diagnosis: Diagnosis, why: str | None = None) -> dict[str, object]:
    """Plain values; frames are 0-based, end excluded, at the markers' rate.

    Args:
        diagnosis: what was found.
        why: id of a cause whose decisions are told in any case.
    """
    several = len(diagnosis.trials) > 1
    remaining = diagnosis.remaining
    location = remaining.location
    return {
        "verdict": diagnosis.verdict,
        "at_fault": list(dict.fromkeys(_at_fault(e) for e in diagnosis.effects)),
        "chances": None if diagnosis.chances is None else asdict(diagnosis.chances),
        "effects": [_effect(e, several) for e in diagnosis.effects],
        "alternatives": [
            {
                "id": a.id,
                "target": a.target,
                "instead_of": a.instead_of,
                "why": a.why,
                "separate_by": a.separate_by,
                "confidence": _finite(a.confidence),
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
            "off_the_list": _off_the_list(remaining.off_the_list, several),
        },
        "trials": list(diagnosis.trials),
        "rates_Hz": dict(diagnosis.rates_Hz),
        "starts_s": dict(diagnosis.starts_s),
        "notes": [note.as_json() for note in diagnosis.notes],
        "evidence_nats": _finite(diagnosis.evidence_nats),
        "certain_nats": diagnosis.certain_nats,
        "ended_early": diagnosis.ended_early,
        "detectable": [asdict(one) for one in diagnosis.detectable],
        "decisions": _decisions(diagnosis, why),
        "residual": None if diagnosis.residual is None else _residual(diagnosis.residual),
        "direct_checks": [_statement(one) for one in diagnosis.direct_checks],
    }


def extended_gain_json(gain: ExtendedGain) -> dict[str, object]:
    """The figures as plain values, in the shape of `accept --json`."""
    plain: dict[str, object] = {}
    for name in ("held_out_linear_residual_N", "held_out_angular_residual_Nm", "marker_rms_m", "mass_kg"):
        figure: Gain = getattr(gain, name)
        known = math.isfinite(figure.before)  # JSON has no NaN
        plain[name] = {k: getattr(figure, k) if known else None for k in ("before", "after")}
        if figure.interval is not None:
            plain[name] |= {"interval": list(figure.interval)}  # type: ignore[operator]
    for name in ("held_out_linear_drop_N", "held_out_angular_drop_Nm"):
        drop = getattr(gain, name)
        plain[name] = None if drop is None else list(drop)
    translations = {c.name for c in gain.fit.skeleton.free_coordinates if c.motion == "translation"}
    most = [dof for dof in gain.joint_torque_change if dof not in translations][:MOST_CHANGED]
    return plain | {
        "held_out_frames": gain.held_out_frames,
        "held_out_blocks": gain.held_out_blocks,
        "joint_torque_change": {
            "rms": gain.joint_torque_change,
            "before_rms": gain.joint_torque_rms,
            "most_changed": most,
        },
        "notes": list(gain.notes),
    }


def _effect(effect: NamedEffect, several: bool) -> dict[str, object]:
    trials = sorted({r.trial for r in effect.frames})
    return {
        "id": effect.id,
        "target": effect.target,
        "at_fault": _at_fault(effect),
        "parameters": {
            n: {"value": _finite(e.value), "std": _finite(e.std)} for n, e in effect.parameters.items()
        },
        "confidence": effect.confidence,
        "in_its_class": _finite(effect.in_its_class),
        "outside_the_list": _finite(effect.outside_the_list),
        "told_as": "tentative" if effect.is_tentative else "name",
        "trial": trials[0] if len(trials) == 1 else None,
        "frames": [_range(r, several) for r in effect.frames],
        "sentence": effect.sentence,
        "remedy": effect.remedy,
        "time_histories": [_time_history(c) for c in effect.time_histories],
    }


def _at_fault(effect: NamedEffect) -> str:
    """Recording, model or movement."""
    return ABOUT[effect.id].at_fault.value


def _decisions(diagnosis: Diagnosis, why: str | None) -> list[dict[str, object]]:
    """Of what is named and of the best refused causes; a limit that is none is None."""
    refused = [c for c in diagnosis.decisions if not c.named]
    told = [c for c in diagnosis.decisions if c.named or c.id == why or c in refused[:MOST_REFUSED]]
    return [
        {
            "id": c.id,
            "target": c.target,
            "named": c.named,
            "odds_nats": _finite(c.odds_nats),
            "checks": [
                {
                    "name": d.name,
                    "passed": d.passed,
                    "nats": None if d.nats is None else _finite(d.nats),
                    "limit": None if d.limit is None else _finite(d.limit),
                    "reason": d.reason,
                }
                for d in c.decisions
            ],
        }
        for c in told
    ]


def _off_the_list(one: OffTheList | None, several: bool) -> dict[str, object] | None:
    if one is None:
        return None
    return {
        "touches": one.kind,
        "target": one.target,
        "trial": one.trial,
        "sentence": one.sentence,
        "frames": [_range(r, several) for r in one.frames],
        "rms_force_N": one.rms_force_N,
        "gain_nats": one.gain_nats,
    }


def _time_history(time_history: ForceHistory) -> dict[str, object]:
    force = time_history.force_ground.round(TIME_HISTORY_DIGITS).tolist()
    return {
        "trial": time_history.trial,
        "start": time_history.start,
        "step": time_history.step,
        "force_N": force,
    }


def _statement(statement: Statement) -> dict[str, object]:
    return {
        "direct_check": statement.direct_check,
        "trial": statement.trial,
        "target": statement.target,
        "sentence": statement.sentence,
        "speaks_for": [str(about) for about in statement.spoken_for(STATED_NATS)],
        "nats": {str(about): round(nats, NATS_DIGITS) for about, nats in statement.nats.items()},
        "figures": dict(statement.figures),
        "against": list(statement.against),
    }


def _residual(residual: ResidualDescription) -> dict[str, object]:
    return {
        **_size(residual.whole),
        "phases": [{"phase": p.phase, "foot": p.foot, **_size(p.size)} for p in residual.phases],
        "axes": [
            {"axis": a.axis, "direction": a.direction, "mean_force_N": a.mean_force_N, **_size(a.size)}
            for a in residual.axes
        ],
        "trials": [_trial(t) for t in residual.trials],
    }


def _trial(trial: InTrial) -> dict[str, object]:
    return {
        "trial": trial.trial,
        **_size(trial.size),
        "worst": {"frames": [trial.worst.start, trial.worst.end], **_size(trial.worst_size)},
        "time_history": {
            n: v.round(TIME_HISTORY_DIGITS).tolist() for n, v in vars(trial.time_history).items()
        },
    }


def _size(size: ResidualSize) -> dict[str, float]:
    return asdict(size)


def _finite(value: float) -> float | None:
    """None for what the recording says nothing about: JSON knows no infinity."""
    return value if math.isfinite(value) else None


def _range(frames: Range, several: bool) -> list[object]:
    return [frames.trial, frames.start, frames.end] if several else [frames.start, frames.end]


def _gain(gain: Gain) -> dict[str, object]:
    plain: dict[str, object] = {"before": gain.before, "after": gain.after}
    return plain | ({"interval": list(gain.interval)} if gain.interval else {})
