"""What an answer is worth against what was done to the recording: names that are right, and of its class.

Where no name is given, the loudest direct check tells the class, if it speaks for one. A class holds what
nobody could tell from the fault by this recording or would act on in the same way: the ids of a branch of the
catalogue. A cause that is added for one of these faults is added to what is right.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.faults.editor.draw import CLEAN
from solver.diagnosis.causes.catalogue import ABOUT, MARKER_IDS


@dataclass(frozen=True)
class Names:
    """Ids that are right, ids of the class, and words of notes where reading corrects the fault."""

    right: tuple[str, ...]
    of_class: tuple[str, ...] = ()
    corrected: str = ""  # regular expression; {plate} is the plate's name in the files
    checked: tuple[str, ...] = ()  # classes that a direct check may speak for instead of a name


def _in_branch(trunk: str) -> tuple[str, ...]:
    return tuple(id for id, about in ABOUT.items() if about.branch.startswith(f"{trunk}/"))


OF_ALL_PLATES = ("gravity_tilt",)  # nobody could take it for a fault of one plate
PLATE = (*(id for id in _in_branch("plate") if id not in OF_ALL_PLATES), "plate_sign")
CLOCK = _in_branch("time")
WEIGHT = tuple(id for id, about in ABOUT.items() if about.weight)
MARKERS = MARKER_IDS
ZERO = "{plate}: its zero level is off.*; taken off"

GEOMETRY = ("plate_turned_or_mirrored", "plate_place")

NAMES = {
    "tared_under_load": Names(("zero_level", "plate_bias"), PLATE, ZERO),
    "zero_level": Names(("zero_level", "plate_bias"), PLATE, ZERO),
    "turned_half": Names(("plate_turn", "plate_yaw"), PLATE, checked=GEOMETRY),
    "turned_quarter": Names(("plate_turn", "plate_yaw"), PLATE, checked=GEOMETRY),
    "mirrored": Names(("plate_mirror",), PLATE, checked=GEOMETRY),
    "shifted": Names(("plate_position",), PLATE, checked=GEOMETRY),
    "pounds": Names(("plate_units", "plate_gain"), PLATE, checked=("plate_scale",)),
    "half_gain": Names(("plate_units", "plate_gain"), PLATE, checked=("plate_scale",)),
    "quarter_gain": Names(("plate_units", "plate_gain"), PLATE, checked=("plate_scale",)),
    "sign": Names(("plate_sign",), PLATE, "{plate}: forces point downwards.*sign is turned"),
    "exchanged_plates": Names(("plate_swap", "plate_exchange"), PLATE, checked=GEOMETRY),
    "late": Names(("clock_offset",), CLOCK),
    "two_lags": Names(("clock_offset", "trial_clocks"), CLOCK),
    "one_plate_late": Names(("plate_clock",), CLOCK),
    "drift": Names(("sample_rate",), CLOCK),
    "filtered": Names(("filter_mismatch",), CLOCK),
    "lost_step": Names(("off_plate_step",)),
    "object_on_plate": Names(("object_on_plate",), ("plate_bias", "zero_level", *WEIGHT), ZERO),
    "other_mass": Names(("subject_mass",), WEIGHT),
    "support": Names(("body_weight_support",), WEIGHT),
    "marker_slip": Names(("marker_slip",), MARKERS),
    "exchanged_labels": Names(("marker_swap",), MARKERS, "exchang|labels"),
    "cloth": Names(("soft_tissue", "segment_displaced"), MARKERS),
}


VERY_SURE = 0.97  # what the page calls very sure begins no lower
TENTATIVE_BELOW = 0.9  # below it a name is tentative, not a finding
SIZE_WITHIN = 0.3  # of the true size; or
DEVIATIONS = 3.0  # of the stated ones
OVERLAP = 0.5  # of the frames of an event
TIMED = ("off_plate_step",)  # causes that are events
OF_ONE_MARKER = ("marker_slip", "marker_swap")
ROUNDING = 1e-6
FAULTED = ("right", "right_but_more", "class", "tentative", "unexplained", "missed", "wrong", "failed")
UNTOUCHED = ("silent", "unexplained", "tentative", "alarm", "failed")
PASS_CUTOFF = (2**0.5 - 1) ** -0.25  # of each of two passes, over that at which both together are 3 dB
STATED = {  # by a size of the truth: parameters that state it, what they say then, and their period
    "gain": (("gain_error", lambda gain: gain - 1, 0.0), ("factor", lambda gain: gain, 0.0)),
    "yaw_deg": (("yaw_deg", lambda yaw: yaw, 360.0), ("turn_deg", lambda yaw: yaw, 360.0)),
    "mirrored_axis": (("mirrored_axis_deg", lambda axis: 45.0 * axis, 180.0),),  # 0: x, 2: z
    "cutoff_Hz": (("cutoff_Hz", lambda both: PASS_CUTOFF * both, 0.0),),  # we state that of each pass
    "mass_factor": (("mass_factor", lambda factor: factor, 0.0),),
}


@dataclass(frozen=True)
class Verdict:
    """One case."""

    case: str
    kind: str
    outcome: str  # one of FAULTED, or of UNTOUCHED where nothing was done
    named: tuple[str, ...]  # id, target and confidence
    very_sure_and_wrong: bool = False
    tentative_count: int = 0  # likelier wrong than right, and told so: no names
    beside: tuple[tuple[str, str], ...] = ()  # id and target of names that are not the fault's
    seconds_cpu: float = float("nan")
    also_alone: bool = False  # these names its recording gets as well where nothing was done


def judged(truth: Mapping[str, Any], answer: Mapping[str, Any]) -> Verdict:
    """Compare one answer of the runner with one truth of the editor."""
    case, kind, figures = truth["case"], truth["kind"], answer["diagnosis"]
    seconds = float(answer["seconds_cpu"])
    if figures is None:
        return Verdict(case, kind, "failed", (), seconds_cpu=seconds)
    found = figures["effects"]
    named = tuple(
        f"{e['id']} {e['target']} {e['confidence']:.2f}{' (a tentative)' if _is_tentative(e) else ''}"
        for e in found
    )
    names = [e for e in found if not _is_tentative(e)]
    if kind == CLEAN:
        worth = [1.0] * len(found)
        outcome = _of_clean(found, figures["verdict"])
    else:
        others = figures.get("alternatives", ())
        worth = [0.0 if _in_a_class(e, truth, NAMES[kind], others) else 1.0 for e in found]
        of_names = [wrong for e, wrong in zip(found, worth, strict=True) if not _is_tentative(e)]
        outcome = _of_faulted(names, of_names, truth, figures)
    sure = any(wrong and e["confidence"] >= VERY_SURE for e, wrong in zip(found, worth, strict=True))
    beside = [(e["id"], str(e["target"])) for e, w in zip(found, worth, strict=True) if w and e in names]
    return Verdict(case, kind, outcome, named, sure, len(found) - len(names), tuple(beside), seconds)


def _is_tentative(effect: Mapping[str, Any]) -> bool:
    """Whether the answer itself calls it likelier wrong than right; old answers call nothing so."""
    return effect.get("told_as") == "tentative"


def _of_clean(found: Sequence[Mapping[str, Any]], verdict: str) -> str:
    if found:
        return "alarm" if any(e["confidence"] >= TENTATIVE_BELOW for e in found) else "tentative"
    return "unexplained" if verdict == "unexplained" else "silent"


def _of_faulted(
    found: Sequence[Mapping[str, Any]],
    wrong: Sequence[float],
    truth: Mapping[str, Any],
    figures: Mapping[str, Any],
) -> str:
    names = NAMES[truth["kind"]]
    notes = [note["text"] for note in figures["notes"]]
    hit = any(_is_right(e, truth, names) for e in found) or _is_corrected(truth, notes, names)
    if hit:
        return "right_but_more" if any(wrong) else "right"
    if any(wrong):
        return "wrong"
    if found or _is_checked(truth, figures, names):
        return "class"
    if figures["effects"]:
        return "tentative"
    return "unexplained" if figures["verdict"] == "unexplained" else "missed"


def _is_corrected(truth: Mapping[str, Any], notes: Sequence[str], names: Names) -> bool:
    """Whether reading put it right, and said so."""
    if not names.corrected:
        return False
    plate = re.escape(f"ground_force_{truth['plate']}")
    return any(re.search(names.corrected.format(plate=plate), note) for note in notes)


def _is_checked(truth: Mapping[str, Any], figures: Mapping[str, Any], names: Names) -> bool:
    """Whether the loudest direct check speaks for the fault's class, at its plate; "clean" undoes that."""
    loud = [w for w in figures.get("direct_checks", ()) if w["speaks_for"]]
    if not loud or figures["verdict"] == "clean":
        return False
    first = max(loud, key=lambda w: max(w["nats"].values()))
    at_its_plate = truth["plate"] is None or f"plate_{truth['plate']}" in str(first["target"]).split("+")
    return at_its_plate and bool(set(first["speaks_for"]) & set(names.checked))


def _is_right(effect: Mapping[str, Any], truth: Mapping[str, Any], names: Names) -> bool:
    return effect["id"] in names.right and _is_there(effect, truth) and _is_so_large(effect, truth)


def _belongs(effect: Mapping[str, Any], truth: Mapping[str, Any], names: Names) -> bool:
    """Whether the name is the fault's or one of its class, at its place."""
    return effect["id"] in (*names.right, *names.of_class) and _is_there(effect, truth)


def _in_a_class(
    effect: Mapping[str, Any], truth: Mapping[str, Any], names: Names, others: Sequence[Mapping[str, Any]]
) -> bool:
    """Likewise, or whether it is told as one class with a name that belongs."""
    if _belongs(effect, truth, names):
        return True
    own, whole = effect["confidence"], effect.get("in_its_class") or 0.0
    key = f"{effect['id']} {effect['target']}"
    told = [a for a in others if a["instead_of"] == key and a["id"] not in TIMED]
    return any(own + (a["confidence"] or 1.0) <= whole + ROUNDING and _belongs(a, truth, names) for a in told)


def _is_there(effect: Mapping[str, Any], truth: Mapping[str, Any]) -> bool:
    target = set(str(effect["target"]).split("+"))
    if truth["plate"] is not None and "plate_" in str(effect["target"]):
        return f"plate_{truth['plate']}" in target
    if effect["id"] in OF_ONE_MARKER and truth["markers"]:
        return bool(target & set(truth["markers"]))
    if effect["id"] in TIMED:
        return _overlap(effect, truth) >= OVERLAP
    return True


def _overlap(effect: Mapping[str, Any], truth: Mapping[str, Any]) -> float:
    """Intersection over union of what is said and what is true, in frames of a hundredth of a second."""
    start, end = truth["times_s"]
    true = set(range(round(100 * start), round(100 * end)))
    said = {k for first, last in effect["seconds"] for k in range(round(100 * first), round(100 * last))}
    return len(true & said) / max(len(true | said), 1)


def _is_so_large(effect: Mapping[str, Any], truth: Mapping[str, Any]) -> bool:
    """Every size that both state; a vector's parts are held to its length."""
    pairs = []
    for name, true in truth["size"].items():
        for parameter, says, period in STATED.get(name, ((name, lambda value: value, 0.0),)):
            stated = effect["parameters"].get(parameter)
            if stated is not None and stated["value"] is not None:
                value = _nearest(stated["value"], says(true), period)
                pairs.append((says(true), value, stated["std"] or 0.0))
    lags = [true for name, true in truth["size"].items() if name.startswith("offset_s ")]
    if lags and not pairs:  # clocks by trial are told by trial, or as one where they are one
        stated = effect["parameters"].get("offset_s")
        if stated is None or np.ptp(lags) > SIZE_WITHIN * max(map(abs, lags)):
            return False
        pairs.append((lags[0], stated["value"], stated["std"] or 0.0))
    if "mass_factor" in truth["size"]:
        pairs = [(true - 1, value - 1, std) for true, value, std in pairs]
    if not pairs:
        return True
    true, value, std = np.array(pairs, dtype=float).T
    away = np.linalg.norm(value - true)
    return bool(away <= max(SIZE_WITHIN * np.linalg.norm(true), DEVIATIONS * np.linalg.norm(std)))


def _nearest(value: float, true: float, period: float) -> float:
    """The value, or what says the same a whole number of periods away."""
    return value + period * round((true - value) / period) if period else value


def with_seconds(figures: Mapping[str, Any]) -> dict[str, Any]:
    """The answer's figures, each cause with its stretches in seconds on the recording's clock."""
    effects = []
    for effect in figures["effects"]:
        stretches = []
        for stretch in effect["frames"]:
            *trial, first, end = stretch
            name = trial[0] if trial else figures["trials"][0]
            rate, start = figures["rates_Hz"][name], figures["starts_s"][name]
            stretches.append((start + first / rate, start + end / rate))
        effects.append({**effect, "seconds": stretches})
    return {**figures, "effects": effects}
