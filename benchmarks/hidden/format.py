"""The format: names that an answer may give, what is handed in, and the seals of truths. Needs NumPy only."""

import hashlib
import json
import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

NONE, SOMETHING_ELSE = "none", "something_else"


@dataclass(frozen=True)
class Cause:
    """What an answer may name."""

    family: str
    sentence: str


CAUSES = {
    NONE: Cause("none", "nothing is wrong beyond noise, soft tissue and an ordinary model"),
    SOMETHING_ELSE: Cause("something else", "something is wrong that is not in this list"),
    "clock_offset": Cause("time", "forces recorded late or early against the markers"),
    "sample_rate": Cause("time", "the forces' rate is wrong: they are stretched in time"),
    "filter_mismatch": Cause("time", "forces low-passed far below what the motion holds"),
    "plate_gain": Cause("plate", "one plate reads a wrong multiple"),
    "plate_bias": Cause("plate", "one plate reads a constant force too much"),
    "plate_position": Cause("plate", "one plate lies elsewhere than the file says"),
    "plate_yaw": Cause("plate", "one plate is turned about the vertical"),
    "plate_swap": Cause("plate", "two plates' columns are exchanged"),
    "axis_convention": Cause("plate", "a horizontal axis has the wrong sign, or two are exchanged"),
    "gravity_tilt": Cause("plate", "the plates' vertical is tilted against gravity"),
    "off_plate_step": Cause("ground", "a step that no plate recorded"),
    "belt_acceleration": Cause("ground", "the belt or platform accelerates"),
    "external_contact": Cause("person", "something touches a segment for part of the trial"),
    "body_weight_support": Cause("person", "a constant upward force on the trunk or pelvis"),
    "elastic_tether": Cause("person", "an elastic band from a fixed point to the trunk or pelvis"),
    "drag": Cause("person", "a force against the velocity of the trunk or pelvis"),
    "carried_mass": Cause("person", "a load on a segment"),
    "subject_mass": Cause("body", "the entered mass of the person is wrong"),
    "segment_mass": Cause("body", "segments weigh otherwise than in the model"),
    "wobbling_mass": Cause("body", "a share of the trunk swings on a spring"),
    "marker_slip": Cause("markers", "one marker moves on its segment at some instant"),
    "marker_swap": Cause("markers", "two markers' labels are exchanged for a while"),
    "capture_scale": Cause("markers", "the cameras' length scale is wrong"),
    "soft_tissue": Cause("markers", "one segment's markers slide with the joint's angle, more than usual"),
}


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


SALT_BYTES = 32
SALTS = "salts.json"
LISTING = "cases.json"


class SealError(Exception):
    """A truth is not the one that was published."""


@dataclass(frozen=True)
class Salts:
    """What only the keeper of the truth knows: one salt for the draw of all cases, and one for each truth.

    The draw has its own salt because a seed of few digits could be found by making the cases for every seed.
    """

    draw: str  # hexadecimal
    cases: dict[str, str]

    def seed(self, seed: int) -> int:
        """The seed of the draw."""
        return int.from_bytes(hashlib.sha256(bytes.fromhex(self.draw) + str(seed).encode()).digest())


def kept_salts(truth: Path, names: Sequence[str]) -> Salts:
    """The salts of TRUTH/salts.json; those that are not there yet are drawn and written first."""
    path = truth / SALTS
    held = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    own = held.get("cases", {})
    salts = Salts(held.get("draw") or _drawn(), own | {n: _drawn() for n in names if n not in own})
    truth.mkdir(parents=True, exist_ok=True)
    text = json.dumps({"draw": salts.draw, "cases": salts.cases}, indent=1) + "\n"
    path.write_text(text, encoding="utf-8")
    return salts


def seal(salt: str, truth: bytes) -> str:
    """SHA-256 of the salt's bytes followed by the bytes of the truth's file."""
    return hashlib.sha256(bytes.fromhex(salt) + truth).hexdigest()


def write_listing(out: Path, truth: Path, names: Sequence[str]) -> None:
    """Write OUT/cases.json: names and seals, nothing else."""
    salts = kept_salts(truth, names)
    cases = [{"name": n, "sha256": seal(salts.cases[n], _bytes_of(truth, n))} for n in sorted(names)]
    (out / LISTING).write_text(json.dumps({"cases": cases}, indent=1) + "\n", encoding="utf-8")


def check_seals(listing: Path, truth: Path) -> int:
    """How many truths are those that were published.

    Raises:
        SealError: one is missing or another.
    """
    published = json.loads(listing.read_text(encoding="utf-8"))["cases"]
    salts = json.loads((truth / SALTS).read_text(encoding="utf-8"))["cases"]
    for case in published:
        name = case["name"]
        if name not in salts or not (truth / f"{name}.json").exists():
            raise SealError(f"{name}: {truth} holds no truth or no salt for it, but {listing} lists it.")
        if seal(salts[name], _bytes_of(truth, name)) != case["sha256"]:
            raise SealError(f"{name}: this truth is not the one whose hash {listing} holds.")
    return len(published)


def _bytes_of(truth: Path, name: str) -> bytes:
    return (truth / f"{name}.json").read_bytes()


def _drawn() -> str:
    return secrets.token_hex(SALT_BYTES)
