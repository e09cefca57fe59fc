"""Hold what a program made of a set against what is so; of angles, signs and offsets are conventions."""

import re
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import ezc3d
import numpy as np

from addb_viewer import Subject
from addb_viewer.api.fitted_trial import FittedTrial
from addb_viewer.api.subject_fit import Fit
from benchmarks.zoo.truth import Contact, Interval, TrialTruth, Truth
from benchmarks.zoo.visit import Visit

LEAST_RANGE_DEG = 15.0  # what moves by less is mostly noise and convention
FEWEST = 20
COORDINATES = {
    "HipAngles": "hip_flexion",
    "KneeAngles": "knee_angle",
    "AnkleAngles": "ankle_angle",
    "ElbowAngles": "elbow_flex",
}
SIDES = {"L": "l", "R": "r"}
EDGE_S = 0.1  # contacts are known to 0.05 s, filtered forces spread by as much
LONG_S = 0.06  # a shorter stretch of wrong frames is an edge
LOADED_N = 50.0
UNLOADED_N = 20.0  # whatever a plate reads below it that nobody steps on
SEEN_WITHIN_S = 0.15
COUNTED_SHARE = 0.5  # of a measured stance that has to reach the right foot
FOLLOWS = 0.9  # correlation with angles that move by more than LEAST_RANGE
KNEE_RANGE = re.compile(r'name="knee_angle_r".*?<range>\s*(\S+)\s+(\S+)\s*</range>', re.DOTALL)
NOT_TABLE = re.compile(r"^(?!.*\s[✓✗]).*$")


@dataclass(frozen=True)
class Check:
    """One thing that is right or not."""

    column: str
    right: bool
    figure: str
    told_by: str = r"(?!)"  # what says so if it is not right; matches nothing by itself


@dataclass(frozen=True)
class Answer:
    """What the program says of a set."""

    visit: Visit
    truth: Truth

    @cached_property
    def fits(self) -> list[Fit]:
        """Kept fits, one a subject."""
        found = [Subject.open(folder).last_fit() for folder in self.visit.subjects]
        return [fit for fit in found if fit is not None]

    @cached_property
    def bent_knee(self) -> int:
        """The sign of a bent knee in the set's own model, by its file; without one, the default's."""
        folders = map(Path, self.visit.subjects)
        named = [f / tomllib.loads((f / "subject.toml").read_text("utf-8")).get("model", "") for f in folders]
        ranges = filter(None, (KNEE_RANGE.search(m.read_text("utf-8")) for m in named if m.is_file()))
        return -1 if any(-float(found[1]) > float(found[2]) for found in ranges) else 1

    def trial(self, truth: TrialTruth) -> FittedTrial | None:
        """The fitted trial whose markers come from one of the truth's files."""
        return next((trial for fit in self.fits for trial in fit if _is_of(trial, truth)), None)

    def told(self, check: Check) -> bool:
        """Whether a line outside the tables says what is not right."""
        lines = [line for line in self.visit.everything.splitlines() if NOT_TABLE.match(line)]
        return any(re.search(check.told_by, line, re.IGNORECASE) for line in lines)


def checks(answer: Answer) -> Iterator[Check]:
    """Everything that the truth allows to be checked."""
    truth, said = answer.truth, answer.visit.everything
    missing = [w for w in (*truth.format_told, *truth.choose) if w not in said and Path(w).stem not in said]
    if truth.format_told or truth.choose:
        yield Check("told", not missing, "not named: " + ", ".join(missing) if missing else "named")
    if truth.usable == "none" and not (truth.format_told and answer.fits):
        yield from _refusal(answer)
        return
    if not answer.fits:
        yield Check("fitted", False, "nothing was fitted", r"no trial|too few|cannot|left out")
        return
    yield from _who(answer)
    for one in truth.trials:
        trial = answer.trial(one)
        if trial is not None:
            yield from _trial(answer, one, trial)
    if truth.usable == "torques":
        used = sum(int(trial.used.sum()) for fit in answer.fits for trial in fit)
        yield Check(
            "forces", used > 0, f"{used} frames used", r"no (measured )?force|not measured|forces? .*left out"
        )


def _refusal(answer: Answer) -> Iterator[Check]:
    legs = [
        trial.name
        for fit in answer.fits
        for trial in fit
        if any(name.startswith(("knee_angle", "ankle_angle")) for name in trial.coordinates.names)
        and np.isfinite(_column(trial, "knee_angle_r")).any()
    ]
    refused = not answer.fits or not (legs or answer.truth.legs)
    figure = "refused" if not answer.fits else "legs made up" if legs else "angles of what is seen"
    yield Check("refused", refused, figure, r"no marker of (a|the) leg|legs? (is|are) not seen")


def _who(answer: Answer) -> Iterator[Check]:
    truth = answer.truth
    if truth.choose:
        return
    yield Check(
        "persons",
        len(answer.fits) == truth.persons,
        f"{len(answer.fits)} of {truth.persons}",
        r"same person|persons|people|several subjects",
    )
    fitted = [trial for fit in answer.fits for trial in fit]
    if truth.trial_count is not None:
        moving = [trial for trial in fitted if not _any_static(truth, trial.name)]
        right = len(moving) == truth.trial_count
        yield Check("trials", right, f"{len(moving)} of {truth.trial_count} trials", r"same (motion|trial)")
    for person, fit in zip(truth.people, answer.fits, strict=False):
        absent = [name for name in person.trials if not _is_fitted(answer, name)]
        if person.trials:
            told = "|".join(map(re.escape, absent)) or r"(?!)"
            yield Check("trials", not absent, "missing: " + ", ".join(absent) if absent else "all", told)
        if person.mass_kg is not None:
            value, within = person.mass_kg
            yield Check(
                "mass",
                abs(fit.mass_kg - value) <= max(within, 0.03 * value),
                f"{fit.mass_kg:.1f} kg for {value:.1f}",
                r"mass.*(guess|average|usual|not (known|measured)|enter|differ|contradict|unlike)",
            )
        if person.height_m is not None:
            value, within = person.height_m
            right = abs(fit.height_m - value) <= within
            yield Check("height", right, f"{fit.height_m:.2f} m for {value:.2f}", r"height")
        if person.static not in (None, ("",)):
            static = fit.solved.subject.static
            place = "" if static is None else static.with_suffix("").as_posix()
            right = any(place.endswith(name) for name in person.static or ())
            figure = "none" if static is None else static.stem
            yield Check("static", right, f"static {figure} for {' or '.join(person.static or ())}", r"static")


def _trial(answer: Answer, truth: TrialTruth, trial: FittedTrial) -> Iterator[Check]:
    yield from _seen(truth, trial)
    yield from _forces(truth, trial)
    yield from _zero_levels(truth, trial)
    yield from _labels(answer.truth, truth, trial)
    yield from _human(answer, trial)
    yield from included_checks(truth, trial)
    if truth.reference:
        yield from reference_checks(answer, truth, trial)
    if truth.force_offset_ms is not None:
        value, _ = truth.force_offset_ms
        told = re.search(r"\b(early|late)\b", answer.visit.said["diagnose"])
        yield Check("clock", told is not None, f"forces {value:.0f} ms early", r"early|late\b")


def _seen(truth: TrialTruth, trial: FittedTrial) -> Iterator[Check]:
    anybody = np.isfinite(trial.markers.values).all(axis=2).sum(axis=1) >= 1
    posed = np.isfinite(trial.coordinates.values).any(axis=1)
    if truth.seen is not None:
        seen = _within(trial.times, truth.seen, -SEEN_WITHIN_S)
    else:
        seen = _near(anybody, SEEN_WITHIN_S * trial.rate)
    lost = int((posed & ~seen).sum())
    told = r"nobody|no markers? (is|are|were) seen|not determined|outside the cameras"
    yield Check("seen", lost == 0, f"{lost} frames with a pose of nobody", told)
    used = int((trial.used & ~seen).sum())
    yield Check("seen", used == 0, f"{used} frames used while nobody is seen")


def _forces(truth: TrialTruth, trial: FittedTrial) -> Iterator[Check]:
    if not trial.feet or not len(trial.forces.names):
        if truth.loaded:
            yield Check("feet", False, f"{truth.name}: no forces read", r"no forces|without forces")
        return
    until = np.inf if truth.listed_until_s is None else truth.listed_until_s
    inside = trial.times <= until - EDGE_S
    for k, foot in enumerate(trial.feet):
        side = "L" if foot.endswith("_l") else "R"
        loaded = np.linalg.norm(trial.forces.values[:, k], axis=1) > LOADED_N
        counts = trial.counts.values[:, k].astype(bool) & inside
        if truth.loaded:
            own = _of_foot(truth.loaded, (side, "-"))
            wrong = loaded & counts & ~_within(trial.times, own, -EDGE_S)
            yield Check(
                "feet", _short(wrong, trial), f"{truth.name} {side}: {_s(wrong, trial)} of a wrong foot"
            )
            due = inside & _within(trial.times, _of_foot(truth.loaded, (side,)), EDGE_S)
            share = float((loaded & due).sum() / max(due.sum(), 1))
            told = r"left out|not used|no foot|off the plate|unused"
            enough = share >= COUNTED_SHARE or not due.any()
            yield Check("feet", enough, f"{truth.name} {side}: {share:.0%} of its stance read", told)
        off = counts & trial.used & _within(trial.times, _of_foot(truth.off_plate, (side,)), EDGE_S)
        yield Check("off", _short(off, trial), f"{truth.name} {side}: {_s(off, trial)} off the plates counts")
        partly = counts & trial.used & _within(trial.times, _of_foot(truth.partly, (side,)), 0.15)
        yield Check(
            "off", _short(partly, trial), f"{truth.name} {side}: {_s(partly, trial)} half on a plate counts"
        )
    if truth.plates_dead:
        yield Check("off", not trial.used.any(), f"{int(trial.used.sum())} frames of dead plates used")


def _zero_levels(truth: TrialTruth, trial: FittedTrial) -> Iterator[Check]:
    for plate in trial._trial.capture.plates:
        number = re.search(r"\d+", plate.name)
        one = truth.plates.get(int(number.group())) if number else None
        if one is None or not np.isfinite(one.tolerance_N):
            continue
        times = plate.times - trial.times[0]
        empty = ~_within(times, tuple((start, end) for _, start, end in one.loaded), -EDGE_S)
        empty &= times < (np.inf if truth.listed_until_s is None else truth.listed_until_s - EDGE_S)
        read = plate.force_ground[empty, 1]
        if empty.sum() > 0.1 * plate.rate and np.isfinite(read).any():
            rest = float(np.nanmedian(read))
            harmless_N = 0.0 if one.loaded else UNLOADED_N
            right = abs(rest) <= max(one.tolerance_N, 0.4 * abs(one.zero_N), harmless_N)
            figure = f"{truth.name} {plate.name}: rests at {rest:.0f} N"
            yield Check("zero", right, figure, r"zero level|tare|rests at")


def _labels(whole: Truth, truth: TrialTruth, trial: FittedTrial) -> Iterator[Check]:
    used = [
        n
        for n, e in zip(trial.marker_errors.names, trial.marker_errors.values.T, strict=True)
        if np.isfinite(e).any()
    ]
    for column, patterns in (
        ("computed", truth.computed_points),
        ("things", tuple(f"^{re.escape(label)}$" for label in whole.not_body)),
    ):
        if patterns:
            taken = [name for name in used if any(re.search(p, name) for p in patterns)]
            figure = (
                f"{truth.name}: {len(taken)} of {len(used)} used ({', '.join(taken[:3])})"
                if taken
                else "none used"
            )
            yield Check(column, not taken, figure)


def _human(answer: Answer, trial: FittedTrial) -> Iterator[Check]:
    limits = answer.truth.wrong_if
    seen = _middle(trial.markers.values)
    if "com_from_markers_m" in limits and len(trial.com.names):
        far = np.nanmax(np.linalg.norm(trial.com.values - seen, axis=1), initial=0.0)
        yield Check(
            "human", bool(far <= limits["com_from_markers_m"]), f"{trial.name}: mass {far:.2f} m from markers"
        )
    for start, key in (("knee_angle", "knee_deg"), ("elbow_flex", "elbow_deg")):
        for name in trial.coordinates.names:
            if name.startswith(start) and key in limits and not name.endswith("beta"):
                degrees = np.degrees(_column(trial, name)) * (answer.bent_knee if "knee" in name else 1)
                low, high = limits[key]
                if np.isfinite(degrees).any():
                    right = low <= np.nanmin(degrees) and np.nanmax(degrees) <= high
                    figure = f"{trial.name} {name} {np.nanmin(degrees):.0f} to {np.nanmax(degrees):.0f}°"
                    yield Check("human", bool(right), figure, f"{name}|{start.split('_')[0]}")
    for name in ("pelvis_tilt", "pelvis_list"):
        if name in trial.coordinates.names and "pelvis_tilt_list_deg" in limits:
            most = np.nanmax(np.abs(np.degrees(_column(trial, name))), initial=0.0)
            right = bool(most <= limits["pelvis_tilt_list_deg"])
            yield Check("human", right, f"{trial.name} {name} up to {most:.0f}°")
    if "marker_rms_m" in limits and trial.marker_errors.shape[1]:
        rms = float(np.sqrt(np.nanmean(trial.marker_errors.values**2)))
        right = rms <= limits["marker_rms_m"]
        yield Check("human", right, f"{trial.name}: markers {100 * rms:.1f} cm off", r"marker.*(✗|far|off)")


def included_checks(truth: TrialTruth, trial: FittedTrial) -> Iterator[Check]:
    """Flexions beside the angles that three markers include."""
    for coordinate, *names in truth.included:
        if coordinate not in trial.coordinates.names or not set(names) <= set(trial.markers.names):
            continue
        first, middle, last = (trial.markers[n] for n in names)
        a, b = first - middle, last - middle
        cosine = (a * b).sum(axis=1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)
        bent = 180.0 - np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
        follows = _correlation(_column(trial, coordinate), bent)
        if follows is not None:
            figure = f"{coordinate} r {follows:.2f} with {'-'.join(names)}"
            yield Check("angles", follows >= FOLLOWS, figure, f"{coordinate}|elbow")


def reference_checks(answer: Answer, truth: TrialTruth, trial: FittedTrial) -> Iterator[Check]:
    """Sagittal angles that a C3D file carries itself, of both sides, whatever their sign."""
    file = next((f for f in Path(answer.visit.folder).rglob(truth.files[0])), None)
    if file is None or file.suffix.lower() != ".c3d":
        return
    contents = ezc3d.c3d(str(file))
    points = contents["data"]["points"]
    labels = [label.split(":")[-1] for label in contents["parameters"]["POINT"]["LABELS"]["value"]]
    for output in truth.reference:
        for side, ending in SIDES.items():
            coordinate = f"{COORDINATES[output]}_{ending}"
            if f"{side}{output}" not in labels or coordinate not in trial.coordinates.names:
                continue
            theirs = points[0, labels.index(f"{side}{output}")].astype(float)
            theirs[theirs == 0.0] = np.nan
            follows = _correlation(trial.coordinates[coordinate], theirs)
            if follows is not None:
                figure = f"{trial.name} {coordinate} r {abs(follows):.2f}"
                yield Check("angles", abs(follows) >= FOLLOWS, figure, coordinate.rsplit("_", 1)[0])


def _correlation(ours: np.ndarray, theirs_deg: np.ndarray) -> float | None:
    """Of two angles; None where they are of other frames, or move too little."""
    if len(ours) != len(theirs_deg):
        return None
    known = np.isfinite(ours) & np.isfinite(theirs_deg)
    if known.sum() < FEWEST or np.ptp(theirs_deg[known]) < LEAST_RANGE_DEG:
        return None
    return float(np.corrcoef(ours[known], theirs_deg[known])[0, 1])


def _is_of(trial: FittedTrial, truth: TrialTruth) -> bool:
    names = {Path(file).name.casefold() for file in trial._trial.capture.files}
    return any(Path(file).name.casefold() in names for file in truth.files)


def _names(trial: FittedTrial, name: str) -> bool:
    stems = {Path(file).stem.casefold() for file in trial._trial.capture.files}
    return name.casefold() in stems | {trial.name.casefold()}


def _is_fitted(answer: Answer, name: str) -> bool:
    """Under its own name, or under that of another file which is said to hold the same recording."""
    matched_synthetic = rf"{re.escape(name)}\.\w+: left out, the trial is read from"
    read = re.search(matched_synthetic, answer.visit.everything, re.IGNORECASE)
    return read is not None or any(_names(trial, name) for fit in answer.fits for trial in fit)


def _any_static(truth: Truth, name: str) -> bool:
    return any(name in (person.static or ()) for person in truth.people)


def _column(trial: FittedTrial, name: str) -> np.ndarray:
    if name not in trial.coordinates.names:
        return np.full(trial.frames, np.nan)
    return trial.coordinates[name]


def _of_foot(contacts: Sequence[Contact], sides: Sequence[str]) -> tuple[Interval, ...]:
    return tuple((start, end) for foot, start, end in contacts if foot in sides)


def _within(times: np.ndarray, intervals: Sequence[Interval], shrink_s: float) -> np.ndarray:
    inside = np.zeros(len(times), dtype=bool)
    for start, end in intervals:
        inside |= (times >= start + shrink_s) & (times <= end - shrink_s)
    return inside


def _near(flags: np.ndarray, frames: float) -> np.ndarray:
    width = 2 * int(np.ceil(frames)) + 1
    return np.convolve(flags, np.ones(width), "same")[: len(flags)] > 0


def _short(wrong: np.ndarray, trial: FittedTrial) -> bool:
    return bool(wrong.sum() <= LONG_S * trial.rate)


def _s(frames: np.ndarray, trial: FittedTrial) -> str:
    return f"{frames.sum() / trial.rate:.2f} s"


def _middle(markers: np.ndarray) -> np.ndarray:
    """Mean of the markers that are seen [frames, 3], NaN where none is."""
    known = np.isfinite(markers).all(axis=2, keepdims=True)
    with np.errstate(invalid="ignore"):
        return np.where(known, markers, 0.0).sum(axis=1) / known.sum(axis=1)
