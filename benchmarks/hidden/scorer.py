"""Answers against the truth: naming, calibration, alarms, and forces on held-out frames. Needs NumPy only."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.hidden.format import CAUSES, NONE, SOMETHING_ELSE, Answer
from benchmarks.markdown import rate, table

NEAR = 0.10  # relative error of a parameter that counts as right
ABOUT_ONE = ("mass_factor", "scale")  # parameters of which one means nothing happened
TIME_SCALE_S = 1.0  # a tenth of it is right for an instant
VERY_SURE = 0.97
SURE = 0.9
NAMED = 0.5  # what is likelier wrong than right is a hint, and no name
FLOOR = 1e-4  # a probability below counts as this in the log score: one answer cannot cost more than 9.2 nats
BINS = 10  # of equal width, of the calibration error
RESAMPLES = 2000
INSIDE, OUTSIDE, CLEAN = "inside", "outside", "clean"
OUTCOMES = ("right", "family", "something else", "none", "wrong")


@dataclass(frozen=True)
class Judged:
    """One case."""

    group: str
    outcome: str  # right; or what was said: another of the family, something else, none, a wrong name
    confidence: float  # of the likeliest name
    accepted: float  # probability of what is right
    brier: float
    parameters: tuple[bool, ...]  # stated ones of a right name: within a tenth
    force_N: float | None  # RMS on held-out frames
    moment_Nm: float | None

    @property
    def right(self) -> bool:
        """Whether the likeliest name is right."""
        return self.outcome == "right"

    def names_wrongly(self, at_least: float) -> bool:
        """A cause named with so much and more that is not there."""
        return self.confidence >= at_least and self.outcome in ("family", "wrong")

    @property
    def very_sure_and_wrong(self) -> bool:
        """A cause named with 97 % and more that is not there."""
        return self.names_wrongly(VERY_SURE)

    @property
    def very_sure_of_nothing_and_wrong(self) -> bool:
        """Called sound with 97 % and more, and it is not."""
        return self.confidence >= VERY_SURE and self.outcome == "none"

    @property
    def log_score(self) -> float:
        """Minus the log of the probability of what is right [nats]."""
        return -float(np.log(max(self.accepted, FLOOR)))


def read_truths(folder: Path) -> dict[str, dict[str, Any]]:
    """Every truth by case; salts need not be there."""
    truths = [json.loads(p.read_text(encoding="utf-8")) for p in sorted(folder.glob("case_*.json"))]
    return {truth["case"]: truth for truth in truths}


def judge(truth: Mapping[str, Any], answer: Answer) -> Judged:
    """Hold one answer to its truth."""
    said, accepted = answer.likeliest, truth["accepted"]
    right = sum(answer.probabilities.get(name, 0.0) for name in accepted)
    others = [p for name, p in answer.probabilities.items() if name not in accepted]
    force, moment = _errors(truth["held_out"], answer.held_out)
    return Judged(
        group=truth["group"],
        outcome=_outcome(said, accepted),
        confidence=answer.probabilities[said],
        accepted=right,
        brier=(1 - right) ** 2 + float(np.sum(np.square(others))),
        parameters=_near(truth, answer) if said in accepted else (),
        force_N=force,
        moment_Nm=moment,
    )


def bins_of(confidence: np.ndarray) -> np.ndarray:
    """The bin of the calibration error that each lies in, from 0."""
    return np.minimum((confidence * BINS).astype(int), BINS - 1)


def calibration_error(confidence: np.ndarray, right: np.ndarray) -> float:
    """Mean gap between stated confidence and share that is right, over bins weighted by their cases."""
    bins = bins_of(confidence)
    gaps = [abs(np.sum(confidence[bins == b] - right[bins == b])) for b in range(BINS)]
    return float(np.sum(gaps) / len(confidence))


def report(judged: Sequence[Judged]) -> str:
    """The table of one submission."""
    return table(["", "figure"], figures(judged))


def figures(judged: Sequence[Judged]) -> list[tuple[str, str]]:
    """Every figure with its 95 % interval: Wilson's for rates, bootstrap over cases for the others."""
    inside, outside, clean = (_of(judged, group) for group in (INSIDE, OUTSIDE, CLEAN))
    named = [near for j in judged for near in j.parameters]
    sure = [j for j in inside if j.confidence >= SURE and j.outcome in ("right", "family", "wrong")]
    rows = [
        *[(f"inside the list: {o}", _rate(inside, lambda j, o=o: j.outcome == o)) for o in OUTCOMES],
        ("inside the list: right, of names with 90 % and more", _rate(sure, lambda j: j.right)),
        ("outside the list: right", _rate(outside, lambda j: j.right)),
        ("outside the list: a wrong cause named", _rate(outside, lambda j: j.outcome == "wrong")),
        (
            "outside the list: a wrong cause with 90 % and more",
            _rate(outside, lambda j: j.names_wrongly(SURE)),
        ),
        ("clean: any alarm", _rate(clean, lambda j: not j.right)),
        ("clean: a cause named with 50 % and more", _rate(clean, lambda j: j.names_wrongly(NAMED))),
        ("very sure of a cause, and wrong", _rate(judged, lambda j: j.very_sure_and_wrong)),
        ("very sure of nothing, and wrong", _rate(judged, lambda j: j.very_sure_of_nothing_and_wrong)),
        ("calibration error", _bootstrap(judged, _calibration_of)),
        ("log score [nats]", _bootstrap(judged, lambda js: float(np.mean([j.log_score for j in js])))),
        ("Brier score", _bootstrap(judged, lambda js: float(np.mean([j.brier for j in js])))),
        ("stated parameters of right names within a tenth", rate(sum(named), len(named))),
    ]
    for title, part in (("all", judged), ("clean", clean), ("inside", inside), ("outside", outside)):
        predicted = [j for j in part if j.force_N is not None]
        for what, of in (("force [N]", "force_N"), ("torque [N·m]", "moment_Nm")):
            median = _bootstrap(predicted, lambda js, of=of: float(np.median([getattr(j, of) for j in js])))
            rows.append((f"held-out {what}, median RMS, {title} ({len(predicted)} predicted)", median))
    return rows


def _outcome(said: str, accepted: Sequence[str]) -> str:
    if said in accepted:
        return "right"
    if said in (NONE, SOMETHING_ELSE):
        return CAUSES[said].family
    families = {CAUSES[name].family for name in accepted}
    return "family" if CAUSES[said].family in families else "wrong"


def _near(truth: Mapping[str, Any], answer: Answer) -> tuple[bool, ...]:
    true = next((e["parameters"] for e in truth["effects"] if e["id"] == answer.likeliest), {})
    return tuple(
        abs(answer.parameters[name] - value) <= NEAR * scale_of(name, true)
        for name, value in true.items()
        if name in answer.parameters
    )


def scale_of(name: str, parameters: dict[str, float]) -> float:
    """What a share is of: the value, its distance from one, or the length of its vector."""
    if name in ABOUT_ONE:
        return abs(parameters[name] - 1)
    if name == "time_s":
        return TIME_SCALE_S
    for axis in "xyz":
        if f"_{axis}_" in name:
            family = [parameters.get(name.replace(f"_{axis}_", f"_{other}_"), 0.0) for other in "xyz"]
            return float(sum(v * v for v in family) ** 0.5)
    return abs(parameters[name])


def _errors(
    held_out: Mapping[str, Any], predicted: Mapping[str, np.ndarray]
) -> tuple[float | None, float | None]:
    """RMS of force and of moment about the truth's points, over all scored frames of the predicted trials."""
    forces, moments = [], []
    for trial, rows in predicted.items():
        true, scored = held_out[trial], held_out[trial]["scored"]
        about = np.array(true["about_m"])
        moment = rows[:, 3:] - np.cross(about, rows[:, :3])
        forces.append((rows[:, :3] - np.array(true["force_N"]))[scored])
        moments.append((moment - np.array(true["moment_Nm"]))[scored])
    if not forces or not sum(len(f) for f in forces):
        return None, None
    force, moment = (np.sqrt(np.mean(np.sum(np.concatenate(e) ** 2, axis=1))) for e in (forces, moments))
    return float(force), float(moment)


def _of(judged: Sequence[Judged], group: str) -> list[Judged]:
    return [j for j in judged if j.group == group]


def _rate(judged: Sequence[Judged], is_so: Callable[[Judged], bool]) -> str:
    return rate(sum(is_so(j) for j in judged), len(judged))


def _calibration_of(judged: Sequence[Judged]) -> float:
    confidence = np.array([j.confidence for j in judged])
    return calibration_error(confidence, np.array([j.right for j in judged], dtype=float))


def _bootstrap(judged: Sequence[Judged], figure: Callable[[Sequence[Judged]], float]) -> str:
    """`0.12 [0.05, 0.20]`: percentiles over cases drawn anew with replacement, the same draws each time."""
    if not judged:
        return "-"
    rng = np.random.default_rng(0)
    draws = rng.integers(len(judged), size=(RESAMPLES, len(judged)))
    low, high = np.percentile([figure([judged[k] for k in draw]) for draw in draws], [2.5, 97.5])
    return f"{figure(judged):.3g} [{low:.3g}, {high:.3g}]"
