"""What others hand in: read whole, or refused with the case and the key."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.hidden.classes import CAUSES

SUM_TOLERANCE = 0.01
KEYS = {"probabilities", "parameters", "held_out"}
SERIES = ("force_N", "moment_Nm")


class SubmissionError(Exception):
    """An answer cannot be used; the message names case and key."""


@dataclass(frozen=True)
class Answer:
    """One case: probabilities of all names, parameters of the likeliest, forces by trial.

    `held_out[trial]` has a row per held-out frame: force [N], moment about the ground origin [N·m].
    """

    probabilities: dict[str, float]
    parameters: dict[str, float] = field(default_factory=dict)
    held_out: dict[str, np.ndarray] = field(default_factory=dict)

    @property
    def likeliest(self) -> str:
        """The name with the largest probability; the first by the alphabet of several."""
        return min(self.probabilities, key=lambda name: (-self.probabilities[name], name))


def read_submission(path: Path, truths: Mapping[str, Mapping[str, Any]]) -> dict[str, Answer]:
    """Read one file {"cases": {NAME: answer}} or a folder of NAME.json.

    Args:
        path: of the file or the folder.
        truths: by case; each must be answered.

    Raises:
        SubmissionError: an answer is missing, unknown or malformed.
    """
    if path.is_dir():
        return checked({file.stem: _json(file) for file in sorted(path.glob("*.json"))}, truths)
    whole = _json(path)
    if not isinstance(whole, dict) or not isinstance(whole.get("cases"), dict):
        raise SubmissionError(f'{path.name}: key "cases" is missing; it holds one answer for each case.')
    return checked(whole["cases"], truths)


def checked(raw: Mapping[str, Any], truths: Mapping[str, Mapping[str, Any]]) -> dict[str, Answer]:
    """Answers as JSON holds them, each found to be whole; errors as in `read_submission`."""
    if unknown := sorted(set(raw) - set(truths)):
        raise SubmissionError(f"{unknown[0]}: this benchmark has no such case.")
    if missing := sorted(set(truths) - set(raw)):
        raise SubmissionError(f"{missing[0]}: no answer. Where nothing is known, say so by probabilities.")
    return {name: _answer(name, raw[name], truths[name]) for name in sorted(raw)}


def _answer(case: str, raw: Any, truth: Mapping[str, Any]) -> Answer:
    if not isinstance(raw, dict):
        raise SubmissionError(f"{case}: an answer is an object with the key probabilities.")
    if unknown := sorted(set(raw) - KEYS):
        raise SubmissionError(f"{case}: key {unknown[0]} is unknown; known are {', '.join(sorted(KEYS))}.")
    if "probabilities" not in raw:
        raise SubmissionError(f"{case}: key probabilities is missing.")
    probabilities = _numbers(case, "probabilities", raw["probabilities"])
    for name, value in probabilities.items():
        if name not in CAUSES:
            raise SubmissionError(f"{case}: probabilities.{name}: no such name; see the list of names.")
        if not 0 <= value <= 1:
            raise SubmissionError(f"{case}: probabilities.{name} is {value:g}; it must lie between 0 and 1.")
    total = sum(probabilities.values())
    if abs(total - 1) > SUM_TOLERANCE:
        raise SubmissionError(f"{case}: probabilities sum to {total:.3g}; they must sum to 1.")
    return Answer(
        {name: value / total for name, value in probabilities.items()},
        _numbers(case, "parameters", raw.get("parameters", {})),
        _held_out(case, raw.get("held_out", {}), truth["held_out"]),
    )


def _held_out(case: str, raw: Any, wanted: Mapping[str, Any]) -> dict[str, np.ndarray]:
    if not isinstance(raw, dict):
        raise SubmissionError(f"{case}: held_out holds an object for each trial.")
    found = {}
    for trial, series in raw.items():
        if trial not in wanted:
            raise SubmissionError(f"{case}: held_out.{trial}: no such trial; {', '.join(wanted)} is known.")
        found[trial] = np.concatenate(
            [_rows(case, f"held_out.{trial}", key, series, wanted[trial]["frames"]) for key in SERIES], axis=1
        )
    return found


def _rows(case: str, where: str, key: str, series: Any, frames: int) -> np.ndarray:
    if not isinstance(series, dict) or key not in series:
        raise SubmissionError(f"{case}: {where}.{key} is missing.")
    try:
        rows = np.asarray(series[key], dtype=float)
    except (TypeError, ValueError):
        raise SubmissionError(f"{case}: {where}.{key} holds something that is no number.") from None
    if rows.shape != (frames, 3):
        raise SubmissionError(
            f"{case}: {where}.{key} is of shape {rows.shape}; wanted are {frames} frames of three numbers."
        )
    if not np.isfinite(rows).all():
        raise SubmissionError(f"{case}: {where}.{key} is not finite in row {_first_bad(rows)}.")
    return rows


def _first_bad(rows: np.ndarray) -> int:
    return int(np.flatnonzero(~np.isfinite(rows).all(axis=1))[0])


def _numbers(case: str, key: str, raw: Any) -> dict[str, float]:
    if not isinstance(raw, dict):
        raise SubmissionError(f"{case}: {key} is an object of names and numbers.")
    for name, value in raw.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
            raise SubmissionError(f"{case}: {key}.{name} is {value!r}; it must be a finite number.")
    return {name: float(value) for name, value in raw.items()}


def _json(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise SubmissionError(f"{path.name}: cannot be read as JSON: {error}") from None
