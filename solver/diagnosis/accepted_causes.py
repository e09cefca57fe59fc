"""The causes that a diagnosis has named, found again, as extra wrenches of the trajectory fit.

A cause's signature becomes a fixed part and columns; where it has parameters η that act otherwise than
linearly, it is linearized about the η that was found: fixed(η) + columns(η) x + T (η' − η), and η' is fitted
like x.

Joint torques ask for more than the balance of the whole body: on which segment it acts. A cause whose target
is a segment acts there. One that changes what plates read, plate by plate, acts on the foot that stands on
each. Of any other that is not known; it counts for F = ma and leaves torques to the motion that it changes.
Causes that lie in the markers alone (a slip, a swap) add no wrench; they are corrected in the markers.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import Subject
from solver.common.errors import FitError
from solver.common.progress import Progress, part, silent
from solver.contact.force_review import ForceReview
from solver.diagnosis.causes.about import Named
from solver.diagnosis.causes.catalogue import catalogue
from solver.diagnosis.causes.effect import Candidate, Corrected, Eta, Range, Signature
from solver.diagnosis.causes.observed_trial import Scene
from solver.diagnosis.diagnose_subject import repaired_balance
from solver.diagnosis.search.selection import select
from solver.diagnosis.search.terms import Solved, Term
from solver.dynamics.trajectory.extension import BodyWrench, Cause, Extension, TrialExtension
from solver.fitting.fit_result import Fit
from solver.fitting.settings import Settings

STILL_COUNT = 0.2  # of a cause's frames may count, though its flag is there: borders are set by eye
FITTED = 0.8  # share of the work that is done once the markers are fitted
SMALL_STEP = 0.1  # of the search's first step, for derivatives by η
SAME_SHARE = 1e-6  # of its size, to which plates one by one must add up to the whole

Placed = dict[str | None, tuple[np.ndarray, np.ndarray]]  # by segment: fixed, columns


@dataclass(frozen=True, eq=False)
class FoundAgain:
    """Named causes, fitted together and ready for trajectory fits."""

    extension: Extension
    fit: Fit  # of the markers, slips and swaps repaired
    scenes: tuple[Scene, ...]
    solved: Solved
    undone: tuple[tuple[str, str], ...] = ()  # id and target of causes that reading the files puts right
    flagged: tuple[tuple[str, str], ...] = ()  # likewise of causes on whose frames no force counts any more

    def causes_at(self, x: Float[np.ndarray, " extra"]) -> tuple[Cause, ...]:
        """The causes with the parameters that a trajectory fit found."""
        return causes_of(self.scenes, self.solved, x)


def extension_for(
    subject: Subject,
    settings: Settings,
    causes: Mapping[tuple[str, str], Sequence[Range]],
    *,
    trials: Sequence[str] | None = None,
    reviews: Mapping[str, ForceReview] | None = None,
    progress: Progress = silent,
) -> FoundAgain:
    """Fit the causes that a diagnosis named once more, none but them, and take them into an extension.

    Args:
        subject: as it was diagnosed.
        settings: likewise.
        causes: by id and target, the frames that the diagnosis gave; causes in the markers alone have no
            place here.
        trials: names of those that were diagnosed; None for all.
        reviews: by trial, what people flagged.
        progress: known the stage and the fraction done; may raise `Cancelled`.

    Raises:
        FitError: no trial has forces, a cause is not found again, or nothing is left to accept since reading
            the files or flags put all right.
    """
    balance, _, fit = repaired_balance(
        subject, settings, trials=trials, reviews=reviews or {}, progress=part(progress, 0.0, FITTED)
    )

    def named(scenes: Sequence[Scene]) -> list[Candidate]:
        return [c for c in catalogue(scenes) if c.key in causes or isinstance(c, Corrected)]

    selection = select(balance, named(balance.scenes), part(progress, FITTED, 1.0), named)
    extension = extension_of(balance.scenes, selection.solved)
    undone = causes.keys() & {c.key for c in selection.corrected}
    again = {(cause.id, cause.target) for cause in extension.causes}
    missing = causes.keys() - again - undone
    flagged = {key for key in missing if _are_left_out(causes[key], balance.scenes)}
    if missing - flagged:
        raise FitError(
            f"{subject.folder}: not found again: {_listed(missing - flagged)}. Flags or settings have "
            "changed since the diagnosis; run it again: addb-viewer diagnose"
        )
    if not extension.causes and flagged:
        raise FitError(
            f"{subject.folder}: nothing to accept: every fit leaves out the frames of {_listed(flagged)}, "
            "since they are flagged"
        )
    if not extension.causes:
        raise FitError(
            f"{subject.folder}: nothing to accept: every fit corrects what the diagnosis names when it reads "
            "the files. Correct the files, so that other programs read them right as well"
        )
    return FoundAgain(
        extension,
        fit,
        balance.scenes,
        selection.solved,
        undone=tuple(sorted(undone)),
        flagged=tuple(sorted(flagged)),
    )


def _are_left_out(ranges: Sequence[Range], scenes: Sequence[Scene]) -> bool:
    """Whether flags leave out the forces on nearly all frames on which a cause acts."""
    counts = {scene.name: scene.counts for scene in scenes}
    within = [counts[r.trial][r.start : r.end] for r in ranges if r.trial in counts]
    return bool(within) and np.concatenate(within).mean() < STILL_COUNT


def _listed(causes: Iterable[tuple[str, str]]) -> str:
    return ", ".join(f"{id_} ({target})" for id_, target in sorted(causes))


def extension_of(scenes: Sequence[Scene], solved: Solved) -> Extension:
    """The causes of a selection, ready for the trajectory fit.

    Args:
        scenes: of the balance.
        solved: its terms fitted together.
    """
    widths = [term.columns.shape[1] for term in solved.terms]
    starts = np.concatenate([[0], np.cumsum(widths)]).astype(int)
    prior = [term.prior_std for term in solved.terms]
    return Extension(
        causes=causes_of(scenes, solved),
        prior_std=np.concatenate(prior) if prior else np.zeros(0),
        x=solved.x,
        trials={scene.name: _of_trial(scene, solved, starts) for scene in scenes},
    )


def causes_of(
    scenes: Sequence[Scene], solved: Solved, x: Float[np.ndarray, " extra"] | None = None
) -> tuple[Cause, ...]:
    """The causes with their parameters.

    Args:
        scenes: of the balance.
        solved: the causes fitted together.
        x: their parameters as another fit found them; None for those of the balance. Their covariance is
            the balance's in either case.
    """
    at = solved if x is None else replace(solved, x=x)
    return tuple(
        Cause(
            term.candidate.id,
            term.candidate.target,
            {n: (e.value, e.std) for n, e in at.estimates(k, scenes).items()},
        )
        for k, term in enumerate(at.terms)
    )


def _of_trial(scene: Scene, solved: Solved, starts: np.ndarray) -> TrialExtension:
    total = int(starts[-1])
    parts: Placed = {None: _nothing(scene, total)}
    if scene.scale_factor is not None:  # the fit's body has the scale's mass, the balance's the entered one
        parts[None][0][:] += (scene.scale_factor - 1.0) * scene.required_at_com_ground
    known = np.ones(scene.frames, dtype=bool)
    for k, term in enumerate(solved.terms):
        x, eta = solved.of(k)[0], solved.eta(k)[0]
        found = _linearized(scene, term, eta, x)
        if found is None:
            continue
        placed, own_known = found
        known &= own_known
        for body, (own_fixed, own_columns) in placed.items():
            whole_fixed, whole_columns = parts.setdefault(body, _nothing(scene, total))
            whole_fixed += own_fixed
            whole_columns[:, :, starts[k] : starts[k + 1]] += own_columns
    wrenches = tuple(BodyWrench(body, fixed, columns) for body, (fixed, columns) in parts.items())
    return TrialExtension(wrenches, known, scene.counts)


def _nothing(scene: Scene, parameters: int) -> tuple[np.ndarray, np.ndarray]:
    return np.zeros((scene.frames, 6)), np.zeros((scene.frames, 6, parameters))


def _linearized(
    scene: Scene, term: Term, eta: Eta, x: Float[np.ndarray, " own"]
) -> tuple[Placed, Bool[np.ndarray, " frames"]] | None:
    """By segment, with columns of η beside those of x, and the frames of which it says anything.

    x's last entries are how far η lies from its prior's mean. None where the cause does not touch the trial.
    """
    candidate, linear = term.candidate, len(x) - len(term.tangent_mean)
    found = _placed(scene, candidate, eta)
    if found is None or not term.tangent_mean:
        return found
    placed, known = found
    slopes: dict[str | None, list[np.ndarray]] = {body: [] for body in placed}
    for i, step in enumerate(SMALL_STEP * np.array(candidate.steps())):
        ends = [tuple(v + sign * step * (k == i) for k, v in enumerate(eta)) for sign in (1, -1)]
        high, low = (e if candidate.admissible(e) else eta for e in ends)
        (up, known_up), (down, known_down) = (_placed(scene, candidate, e) or found for e in (high, low))
        known = known & known_up & known_down
        for body, slope in slopes.items():
            width = high[i] - low[i] or np.inf
            slope.append((_value(up, body, x[:linear]) - _value(down, body, x[:linear])) / width)
    tangents = {body: known[:, None, None] * np.stack(slope, axis=2) for body, slope in slopes.items()}
    return {
        body: (fixed - tangents[body] @ x[linear:], np.concatenate([columns, tangents[body]], axis=2))
        for body, (fixed, columns) in placed.items()
    }, known


def _value(placed: Placed, body: str | None, x: np.ndarray) -> np.ndarray:
    fixed, columns = placed.get(body, (np.zeros(6), np.zeros((6, len(x)))))
    return np.asarray(fixed + columns @ x)


def _placed(
    scene: Scene, candidate: Candidate, eta: Eta
) -> tuple[Placed, Bool[np.ndarray, " frames"]] | None:
    """A signature by the segment on which it acts, and the frames of which it says anything."""
    whole = candidate.signature(scene, eta)
    if whole is None:
        return None
    fixed, columns = _parts_of(scene, whole)
    known = ~candidate.unrecorded(scene, eta)
    placed: Placed = {None: (fixed * known[:, None], columns)}
    if candidate.target in scene.skeleton.body_names:
        placed = {candidate.target: placed[None]}
    elif candidate.about.names is Named.ALL or candidate.target in {p.target for p in scene.plates}:
        by_plate = _by_plate(scene, candidate, eta)
        if by_plate is not None and _adds_up(
            [(f[known], c[known]) for f, c in by_plate], fixed[known], columns[known]
        ):
            placed = _on_feet(scene, [(f * known[:, None], c) for f, c in by_plate])
    return placed, known


def _parts_of(scene: Scene, signature: Signature) -> tuple[np.ndarray, np.ndarray]:
    fixed = np.zeros((scene.frames, 6)) if signature.fixed is None else signature.fixed
    return fixed, signature.columns


def _by_plate(scene: Scene, candidate: Candidate, eta: Eta) -> list[tuple[np.ndarray, np.ndarray]] | None:
    """The plate's that it is about, else what it would be if each plate were the only one.

    None where some plate alone says otherwise.
    """
    if candidate.target in {plate.target for plate in scene.plates}:
        whole = candidate.signature(scene, eta)
        assert whole is not None
        own, width = _parts_of(scene, whole), whole.columns.shape[2]
        return [own if p.target == candidate.target else _nothing(scene, width) for p in scene.plates]
    alone = [candidate.signature(replace(scene, plates=(plate,)), eta) for plate in scene.plates]
    found = [signature for signature in alone if signature is not None]
    if not found or len({signature.columns.shape[2] for signature in found}) > 1:
        return None
    width = found[0].columns.shape[2]
    return [
        _nothing(scene, width) if signature is None else _parts_of(scene, signature) for signature in alone
    ]


def _adds_up(
    by_plate: Sequence[tuple[np.ndarray, np.ndarray]], fixed: np.ndarray, columns: np.ndarray
) -> bool:
    """Whether plates one by one make the whole."""
    for i, whole in enumerate((fixed, columns)):
        largest = max(float(np.abs(whole).max(initial=0.0)), 1.0)
        together = np.sum([part[i] for part in by_plate], axis=0)
        if together.shape != whole.shape or np.abs(together - whole).max(initial=0.0) > SAME_SHARE * largest:
            return False
    return True


def _on_feet(scene: Scene, by_plate: Sequence[tuple[np.ndarray, np.ndarray]]) -> Placed:
    """Each plate's part on the foot that its force was given to, frame by frame."""
    owner, names = scene.contacts.plate, scene.contacts.foot_bodies
    width = by_plate[0][1].shape[2]
    placed: Placed = {name: _nothing(scene, width) for name in (*names, None)}
    for plate, (fixed, columns) in enumerate(by_plate):
        for foot, name in (*enumerate(names), (-1, None)):
            own = owner[:, plate] == foot if name is not None else owner[:, plate] < 0
            placed[name][0][own] += fixed[own]
            placed[name][1][own] += columns[own]
    return placed
