"""How well recordings are fitted by their labels alone: the model is hidden, and its fit is the yardstick.

`python -m benchmarks.marker_knockout` prints, for recordings with a model, how far joint angles and joint
centres of the fit on the default body lie from those of the model's fit, and how well the confidence of a
label separates labels on their own trajectory from labels that were shuffled; first for recordings that some
limits were chosen on, then for others. `--marker-set` hides only the model's marker set: its bodies stay, and
the labels are placed on them.
`--nonsense` gives every marker a label that means nothing, in any order, and compares the same, with the
bodies that the markers were attached to. `--everyone` prints, for every recording of a person, what the whole
fit makes of its labels alone, forces and all.
"""

import argparse
import sys
import tempfile
import time
import warnings
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.agreement_words import HEADER, apart, figures, together
from benchmarks.everyone import print_everyone
from benchmarks.fit_agreement import Agreement, compared
from benchmarks.labels_of_fit import bodies_of_labels
from benchmarks.recordings import data_folder, recordings_of, without_model
from solver.capture.capture import Markers, Subject
from solver.capture.subject.subject import open_subject
from solver.fitting.fit import Fit
from solver.fitting.pipeline import solve
from solver.fitting.settings import Settings
from solver.kinematics.label_reading import read_labels
from solver.markers.atlas import atlas
from solver.markers.understanding import understand
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import ForwardKinematics

RECORDINGS = (
    ("walk_rajagopal2015", "walk"),
    ("opencap_subject4", "walking1"),
    ("opencap_subject4", "squats1"),
    ("run_treadmill_hamner2013_subject04", "run400"),
    ("walk_treadmill_stepwidth", "example1"),
    ("sprint_overground_dorn2012_JA1_9ms", "run0900cms"),
)
HELD_OUT = (  # no limit of solver.markers was chosen on these
    "overground_camargo2021_AB06",
    "exo_apo_gordon",
    "walk_gait2354_subject01",
    "opencap_subject6",
    "synthetic_arnold2013_subject01",
)
HELD_OUT_SEED = 100  # the first of draws that no limit was chosen on
WRONG_SHARE = 0.2  # of the labels, in each draw
DRAWS = 10
AT_CENTRE_M = 0.015  # a marker this near to a joint's centre is the centre, computed by other software


def markers_alone() -> Settings:
    """The settings of a fit that looks at no force."""
    settings = Settings()
    return replace(settings, trajectory=replace(settings.trajectory, enabled=False))


def agreement(subject: Subject, trial: str) -> Agreement:
    """Fit twice, with the model and without it, and compare."""
    settings = markers_alone()
    with_model = solve(subject, settings, trials=[trial])
    return compared(solve(without_model(subject), settings, trials=[trial]), with_model)


def without_marker_set(subject: Subject, folder: Path) -> Subject:
    """The same recordings and the same model, its markers left out; its file goes into a folder."""
    assert subject.model is not None
    document = ET.parse(subject.model)
    for parent in document.iter():
        for markers in parent.findall("MarkerSet"):
            parent.remove(markers)
    bare = folder / subject.model.name
    document.write(bare)
    return replace(subject, model=bare, marker_map=None)


def agreement_on_model(subject: Subject, trial: str) -> Agreement:
    """Fit the model with its markers, and without: then labels are placed on its bodies."""
    settings = markers_alone()
    with_markers = solve(subject, settings, trials=[trial])
    with tempfile.TemporaryDirectory() as folder:
        bare = without_marker_set(subject, Path(folder))
        return compared(solve(bare, settings, trials=[trial]), with_markers)


@dataclass(frozen=True)
class Nonsense:
    """A fit of markers whose labels mean nothing, against the fit with the model and all names."""

    agreement: Agreement
    judged: tuple[tuple[float, bool], ...]  # confidence, and whether the body is the model's, of each marker
    judged_as_one: tuple[tuple[float, bool], ...]  # likewise, where it would move alike in the model
    used_right: int  # of the markers that the fit uses and the model has
    used: int
    seconds: float  # of CPU, for reading the labels


def nonsense(subject: Subject, trial: str, seed: int) -> Nonsense:
    """Fit a trial whose labels were replaced by numbers in random order; its static trial is left away."""
    settings = markers_alone()
    with_model = solve(subject, settings, trials=[trial])
    capture = with_model.trials[0].capture
    order = np.random.default_rng(seed).permutation(len(capture.markers.names))
    positions = capture.markers.positions_ground[:, order]
    labels = tuple(f"M{i + 1:03d}" for i in range(len(order)))
    hidden = replace(capture, markers=replace(capture.markers, names=labels, positions_ground=positions))
    bare = replace(without_model(subject), static=None, marker_map=None)
    alone = solve(bare, settings, trials=[trial], captures={trial: hidden})
    start = time.process_time()
    rows = read_labels(default_skeleton(), [hidden.markers]).understanding.labels
    seconds = time.process_time() - start
    bodies = bodies_of_labels(with_model)
    truth = {labels[i]: bodies.get(capture.markers.names[k]) for i, k in enumerate(order)}
    rows_of_model = [row for row in rows if truth[row.label] is not None]
    judged = tuple((row.confidence, row.body == truth[row.label]) for row in rows_of_model)
    moving_alike = _moving_alike(with_model)
    alike = {labels[i]: moving_alike.get(capture.markers.names[k], set()) for i, k in enumerate(order)}
    as_one = tuple((row.confidence, row.body in alike[row.label]) for row in rows_of_model)
    used = [row for row in rows_of_model if row.used]
    right = sum(row.body == truth[row.label] for row in used)
    renamed = {capture.markers.names[k]: labels[i] for i, k in enumerate(order)}
    found = compared(alone, with_model, renamed)
    return Nonsense(found, judged, as_one, right, len(used), seconds)


def _moving_alike(fit: Fit) -> dict[str, set[str]]:
    """Bodies on which each label's marker would move alike in the fit's model.

    These are bodies that its joints hold together without any freedom (toes on a foot whose joint is locked),
    and for a computed joint centre the bodies on both sides of that joint.
    """
    assert fit.groundwork is not None
    skeleton, match = fit.groundwork.skeleton, fit.groundwork.match
    names, free = skeleton.body_names, set(skeleton.dofs)
    held: dict[str, str] = {}
    for name, joint in zip(names, skeleton.joints, strict=True):
        moves = joint.parent < 0 or any(axis.coordinate in free for axis in joint.axes)
        held[name] = name if moves else held[names[joint.parent]]
    kinematics = ForwardKinematics(skeleton)
    poses = kinematics.poses(skeleton.default_q[None])
    places, origins = kinematics.markers(poses)[0], poses.p_ground_body[0]
    found = {}
    for place, marker in zip(places, skeleton.markers, strict=True):
        bodies = {marker.body}
        for child, joint in enumerate(skeleton.joints):
            sides = {child, joint.parent}
            if marker.body in sides and np.linalg.norm(place - origins[child]) < AT_CENTRE_M:
                bodies |= sides - {-1}
        groups = {held[names[b]] for b in bodies}
        found[marker.name] = {name for name in names if held[name] in groups}
    return {
        label: found[name]
        for name, labels in zip(match.model, match.measured, strict=True)
        for label in labels
    }


def judged_labels(markers: Markers, wrong_share: float, seed: int) -> list[tuple[float, bool]]:
    """Confidence of each label, and whether it stands on its own trajectory, after some were exchanged."""
    rng = np.random.default_rng(seed)
    labels = list(markers.names)
    moved = rng.permutation(len(labels))[: max(2, round(wrong_share * len(labels)))]
    names = list(labels)
    for here, there in zip(moved, np.roll(moved, 1), strict=True):
        names[here] = labels[there]
    shuffled = replace(markers, names=tuple(names))
    truth = understand(labels, [markers]).by_label()
    rows = understand(names, [shuffled]).by_label()
    judged = []
    for i, label in enumerate(names):
        row = rows[label]
        if row.landmark is None or not np.isfinite(markers.positions_ground[:, i]).any():
            continue
        # tracking markers are right on any trajectory of their segment: their confidence claims no more
        same_body = truth[labels[i]].used and truth[labels[i]].body == row.body
        at_home = labels[i] == label or (same_body and atlas()[row.landmark].tracks_only)
        judged.append((row.confidence, at_home))
    return judged


def roc_area(judged: Sequence[tuple[float, bool]]) -> float:
    """Share of pairs of a right and a wrong label in which the right one has the higher confidence."""
    right = np.array([c for c, good in judged if good])
    wrong = np.array([c for c, good in judged if not good])
    higher = (right[:, None] > wrong[None, :]).mean() + 0.5 * (right[:, None] == wrong[None, :]).mean()
    return float(higher)


def _print_knockout() -> None:
    print(f"recording                       markers   RMS cm  {HEADER}   ROC")
    agreements = []
    for recordings, first_seed in ((RECORDINGS, 0), (_first_trials(HELD_OUT), HELD_OUT_SEED)):
        everything: list[tuple[float, bool]] = []
        for folder, trial in recordings:
            subject = open_subject(data_folder() / folder)
            found = agreement(subject, trial)
            agreements.append(found)
            markers = recordings_of(subject, trial)[0]
            seeds = range(first_seed, first_seed + DRAWS)
            judged = [row for seed in seeds for row in judged_labels(markers, WRONG_SHARE, seed)]
            everything += judged
            print(
                f"{folder[:22] + '/' + trial[:14]:38s} {figures(found)}   {roc_area(judged):.3f}",
                flush=True,
            )
        wrong = sum(not good for _, good in everything)
        print(f"ROC area over these: {roc_area(everything):.3f} ({wrong} wrong labels)")
    print(together(agreements))


def _print_on_model(recordings: Sequence[tuple[str, str]]) -> None:
    print(f"recording                       markers   RMS cm  {HEADER}")
    agreements = []
    for folder, trial in recordings:
        found = agreement_on_model(open_subject(data_folder() / folder), trial)
        agreements.append(found)
        print(f"{folder[:22] + '/' + trial[:14]:38s} {figures(found)}", flush=True)
    print(together(agreements))


def _first_trials(folders: Sequence[str]) -> list[tuple[str, str]]:
    return [(f, open_subject(data_folder() / f).trials[0].name) for f in folders]


def _print_nonsense() -> None:
    print(f"recording                           right of used of all   {HEADER}   reading s")
    everything: list[tuple[float, bool]] = []
    as_one: list[tuple[float, bool]] = []
    agreements, right = [], 0
    for folder in sorted(p.parent.name for p in data_folder().glob("*/subject.toml")):
        subject = open_subject(data_folder() / folder)
        for files in subject.trials if subject.model is not None else ():
            found = nonsense(subject, files.name, seed=0)
            everything += found.judged
            as_one += found.judged_as_one
            agreements.append(found.agreement)
            right += found.used_right
            print(
                f"{folder[:22] + '/' + files.name[:14]:38s} {found.used_right:3d} {found.used:3d} "
                f"{len(found.judged):3d}   {apart(found.agreement)}   {found.seconds:.1f}",
                flush=True,
            )
    print(together(agreements))
    print(f"used and on the right body: {right} of {len(everything)}")
    for what, judged in (("", everything), (", bodies that the model cannot tell apart being one", as_one)):
        wrong = sum(not good for _, good in judged)
        print(f"ROC area over all{what}: {roc_area(judged):.3f} ({wrong} of {len(judged)} on another body)")


def main() -> None:
    """Print one of the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--nonsense", action="store_true", help="labels that mean nothing, in any order")
    parser.add_argument("--marker-set", action="store_true", help="hide the model's markers, not the model")
    parser.add_argument("--everyone", action="store_true", help="every recording of a person, forces and all")
    given = parser.parse_args(sys.argv[1:])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if given.nonsense:
            _print_nonsense()
        elif given.marker_set:
            _print_on_model([*RECORDINGS, *_first_trials(HELD_OUT)])
        elif given.everyone:
            print_everyone()
        else:
            _print_knockout()


if __name__ == "__main__":
    main()
