"""Whether a recording could tell the true fault from another one in its place: the hider's D.

D = ½ min over what the other may be of ‖true − other‖², in the metric of the balance's precision, where the
balance fits the true fault best: what would still speak for the truth if the other were fitted in its place.
The true fault is taken as it was edited, never as it was found. Asked only of faults that one number tells.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize

from solver.capture.subject.subject import open_subject
from solver.common.progress import silent
from solver.diagnosis.causes.catalogue import catalogue
from solver.diagnosis.causes.effect import Candidate, Eta
from solver.diagnosis.diagnose import repaired_balance
from solver.diagnosis.noise.noise_scales import NoiseScale
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.terms import Term
from solver.fitting.settings import settings_for

TOLD_APART = 5.0  # [nats] from which on two faults are no class
LARGEST_CLASS = 3
WIDER = 5.0  # times the usual sizes, within which the other may be of any
TRUE_CAUSES = {"drift": ("sample_rate", "stretch"), "late": ("clock_offset", "offset_s trial_a")}


def undecidable(out: Path, truth: Mapping[str, Any], figures: Mapping[str, Any]) -> bool:
    """Whether the answer names a class of at most three that holds the truth, and no more could be told.

    Args:
        out: folder of the draw; what was asked once is kept there.
        truth: of the case.
        figures: of the answer.
    """
    id, size = TRUE_CAUSES.get(str(truth["kind"]), ("", ""))
    names = [effect for effect in figures["effects"] if effect.get("told_as") != "tentative"]
    others = [a for a in figures["alternatives"] if names and a["instead_of"] == _key(names[0])]
    if len(names) != 1 or len(others) >= LARGEST_CLASS or id not in [a["id"] for a in others]:
        return False
    kept = out / "distances" / f"{truth['case']}.json"
    if not kept.exists():
        folder = out / "subjects" / str(truth["case"])
        settings = settings_for(folder)
        subject = open_subject(folder)
        balance, _, _ = repaired_balance(subject, settings, trials=None, reviews={}, progress=silent)
        by_key = {f"{c.id} {c.target}": c for c in catalogue(balance.scenes)}
        true, named = by_key[f"{id} all"], by_key[_key(names[0])]
        kept.parent.mkdir(exist_ok=True)
        kept.write_text(json.dumps({"nats": distance_nats(balance, true, (truth["size"][size],), named)}))
    return bool(json.loads(kept.read_text())["nats"] < TOLD_APART)


def distance_nats(balance: Balance, true: Candidate, eta: Eta, other: Candidate) -> float:
    """How much would still speak for a fault without free sizes, at its true η, beside another one.

    Args:
        balance: of the recording that has the fault.
        true: the fault.
        eta: its true size.
        other: what may be in its place.
    """
    term = balance.term(true, eta)
    assert term is not None
    assert term.fixed is not None
    noise_scale, fixed = balance.solve([term]).noise_scale, term.fixed

    def left(at: Eta) -> float:
        instead = balance.term(other, at) if other.admissible(at) else None
        return np.inf if instead is None else _left(balance, noise_scale, fixed, instead)

    best = min(other.starts(balance.scenes), key=left)
    if not best:
        return left(best)
    found = minimize(lambda at: left(tuple(at.tolist())), best, method="Nelder-Mead", options={"xatol": 1e-5})
    return float(found.fun)


def _left(balance: Balance, noise_scale: NoiseScale, true: np.ndarray, other: Term) -> float:
    apart = true if other.fixed is None else true - other.fixed
    y, B = (noise_scale.whitened(balance.basis.turned(part)) for part in (apart, other.columns))
    B = B * WIDER * other.prior_std
    x = np.linalg.solve(B.T @ B + np.eye(B.shape[1]), B.T @ y)
    return 0.5 * float(y @ (y - B @ x))


def _key(effect: Mapping[str, Any]) -> str:
    return f"{effect['id']} {effect['target']}"
