"""Markers first: what slipped or was exchanged is repaired and the pose fitted anew; then come forces."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from solver.capture.capture import Capture
from solver.common.notes import Kind, Note
from solver.contact.force_review import ForceReview
from solver.diagnosis.causes import marker_slip, marker_swap, soft_tissue
from solver.diagnosis.causes.effect import Estimate
from solver.diagnosis.causes.leaps import leaps
from solver.diagnosis.causes.marker_effect import MarkerFinding
from solver.diagnosis.causes.marker_events import events_of
from solver.diagnosis.causes.marker_slip import MarkerSlip, UnusedMarkerSlip
from solver.diagnosis.causes.observed_trial import Scene
from solver.diagnosis.causes.segment_displaced import TOGETHER_S, of_leap, of_others, slips_together
from solver.diagnosis.direct_checks.rigid_distances import STEP_SCATTER_M
from solver.diagnosis.direct_checks.statement import STATED_NATS, About, Statement
from solver.diagnosis.scenes import SceneAndPosterior, scenes_of
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.settings import Settings
from solver.markers.understanding import understand

ROUNDS = 3  # a swap hides a slip, and a repaired pose shows the next


@dataclass(frozen=True, eq=False)
class SeenInMarkers:
    """Causes that the markers themselves show."""

    findings: tuple[MarkerFinding, ...] = ()
    marker_rms_before_m: float = float("nan")
    marker_rms_after_m: float = float("nan")
    notes: tuple[Note, ...] = ()  # on jumps that are nobody's slip


NOTHING_SEEN = SeenInMarkers()


def with_markers_repaired(
    fitted: Callable[[Mapping[str, Capture]], Fit], settings: Settings, reviews: Mapping[str, ForceReview]
) -> tuple[Fit, SceneAndPosterior, SeenInMarkers]:
    """Fit, look at the markers, repair them, and fit again until nothing more is found.

    Args:
        fitted: fits the subject with some trials' recordings in place of the files'.
        settings: of solve and diagnosis.
        reviews: by trial, what people flagged.

    Returns:
        The fit of the repaired markers, its trials that have forces, and what was found in the markers.
    """
    fit = fitted({})
    before = _rms(fit)
    found: list[MarkerFinding] = []
    notes: list[Note] = []
    repaired: dict[str, Capture] = {}
    for _ in range(ROUNDS):
        seen = scenes_of(fit, settings, reviews)
        scenes = {scene.name: scene for scene, _ in seen}
        fresh = {
            trial.capture.name: _findings(trial, scenes[trial.capture.name], found, notes)
            for trial in fit.trials
            if trial.capture.name in scenes
        }
        found += [finding for own in fresh.values() for finding in own]
        corrected = {
            name: [f for f in own if not isinstance(f, UnusedMarkerSlip)] for name, own in fresh.items()
        }
        if not any(corrected.values()):
            break
        for trial in fit.trials:
            if own := corrected.get(trial.capture.name):
                repaired[trial.capture.name] = _repair(trial, scenes[trial.capture.name], own)
        fit = fitted(repaired)
    else:
        seen = scenes_of(fit, settings, reviews)
    tissue = [finding for scene, _ in seen for finding in soft_tissue.findings(scene)]
    events = slips_together(found, {scene.name: scene for scene, _ in seen})
    return fit, seen, SeenInMarkers((*events, *tissue), before, _rms(fit), tuple(dict.fromkeys(notes)))


def as_distances_tell(
    seen: SeenInMarkers, direct_checks: Sequence[Statement], scenes: Sequence[Scene]
) -> SeenInMarkers:
    """Where distances say that others moved together at the moment of a slip, they did, and it did not.

    A pose is pulled along by the many, so that the one which stayed seems to slip.

    Args:
        seen: by the poses.
        direct_checks: what distances between markers say, among others.
        scenes: of the trials.
    """
    by_trial = {scene.name: scene for scene in scenes}
    findings = [_as_distances_tell(f, direct_checks, by_trial) for f in seen.findings]
    return replace(seen, findings=tuple(findings))


def _as_distances_tell(
    finding: MarkerFinding, direct_checks: Sequence[Statement], scenes: Mapping[str, Scene]
) -> MarkerFinding:
    scene = scenes.get(finding.frames.trial)
    if not isinstance(finding, MarkerSlip) or finding.in_its_path or scene is None:
        return finding
    time_s = scene.motion.start_time + finding.frames.start / scene.rate
    for one in direct_checks:
        if About.SEGMENT not in one.spoken_for(STATED_NATS) or one.trial != scene.name:
            continue
        moved = str(one.target).split("+")
        at_once = abs(one.figures["time_s"] - time_s) <= TOGETHER_S
        if at_once and finding.target not in moved:
            shift = Estimate(one.figures["change_m"], STEP_SCATTER_M)
            return of_others(scene, finding, moved, shift) or finding
    return finding


def _findings(
    trial: TrialFit, scene: Scene, before: Sequence[MarkerFinding], notes: list[Note]
) -> list[MarkerFinding]:
    """Exchanged markers, else those whose paths are cut, else slips by the pose; notes on other jumps.

    An exchange looks like two cut paths, and whatever moved drags the pose along.
    """
    swaps = marker_swap.findings(scene)
    if swaps:
        return swaps
    cut = _with_cut_paths(trial, scene, before, notes)
    if any(not isinstance(finding, UnusedMarkerSlip) for finding in cut):
        return cut
    events = events_of(scene, marker_slip.findings(scene), before)
    notes += events.notes
    return [*cut, *events.slips]


def _with_cut_paths(
    trial: TrialFit, scene: Scene, before: Sequence[MarkerFinding], notes: list[Note]
) -> list[MarkerFinding]:
    """By the recording alone, of all its markers; what was told before is not told again."""
    points, found = trial.capture.markers, []
    if not leaps(points.positions_ground, points.rate):  # each marker's own: then a choice has none either
        return []
    computed = {row.label for row in understand(points.names, [points]).labels if row.computed}
    markers = points.chosen([m for m, name in enumerate(points.names) if name not in computed])
    reach = TOGETHER_S * scene.rate
    for leap in leaps(markers.positions_ground, markers.rate):
        known = [f for f in before if f.frames.trial == scene.name]
        if any(abs(f.frames.start - leap.frame) <= reach for f in known):
            continue
        finding = of_leap(scene, leap, markers.names)
        if finding is None:
            names = ", ".join(markers.names[m] for m in leap.markers)
            time_s = leap.frame / scene.rate
            text = f"at {time_s:.2f} s {names} move together; the model does not use them"
            notes.append(Note(Kind.OTHER, text, trial=scene.name))
        else:
            found.append(finding)
    return found


def _repair(trial: TrialFit, scene: Scene, findings: Sequence[MarkerFinding]) -> Capture:
    observed = scene.markers.observed_ground
    for finding in findings:
        observed = finding.repair(observed)
    markers = trial.capture.markers
    positions = markers.positions_ground.copy()
    for m, name in enumerate(scene.markers.names):
        if name in markers.names and np.isfinite(scene.markers.observed_ground[:, m]).any():
            positions[:, markers.names.index(name)] = observed[:, m]
    return replace(trial.capture, markers=replace(markers, positions_ground=positions))


def _rms(fit: Fit) -> float:
    """Over all trials' frames [m]."""
    frames = np.concatenate([t.marker_errors.rms_per_frame for t in fit.trials])
    return float(np.sqrt(np.nanmean(frames**2)))
