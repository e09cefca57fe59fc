"""Segment displaced: from one moment on several markers of a segment sit elsewhere, together.

Cloth that is caught, a strap or a rigid plate of markers that turns. Each of these markers seems to slip;
that several slip by themselves within a tenth of a second is far less likely.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.about import (
    About,
    CorrectedBy,
    Entry,
    Named,
    Reading,
    Segments,
    Size,
    TimeHistory,
)
from solver.diagnosis.causes.effect import Estimate, Range
from solver.diagnosis.causes.leaps import Leap
from solver.diagnosis.causes.marker_effect import RESOLVED_M, MarkerFinding, Places
from solver.diagnosis.causes.marker_slip import MarkerSlip, UnusedMarkerSlip
from solver.diagnosis.causes.observed_trial import Scene

TOGETHER_S = 0.1  # slips within are one event


@dataclass(frozen=True, eq=False)
class SegmentDisplaced(MarkerFinding):
    """Slips of several markers of neighbouring segments at one moment, as one event."""

    slips: tuple[MarkerSlip, ...]

    about = About(
        id="segment_displaced",
        entry=Entry(
            "bodies",
            "from a moment on several markers of neighbouring segments sit elsewhere, together",
            "`shift_m` (mean), `time_s`",
        ),
        title="several markers that moved together: {target}",
        sentence="At one moment several markers of {target} moved together over the body and stayed there.",
        remedy=(
            "Look for cloth, a strap or a plate of markers that was caught there. In this recording use what "
            "was recorded before that moment; before the next one fix them anew and take another "
            "static trial."
        ),
        separate_by="a static trial before and after the recording",
        branch="markers/several at once",
        names=Named.BODIES,
        time_history=TimeHistory.EVENT,
        corrected_by=CorrectedBy.FILES,
        in_markers=True,
        sizes=(Size("shift_m", 0.02, 0.06, 0.3, "cloth that slides; the segment's length at most"),),
        readings=(
            Reading("shift_m", "by {amount}", "mm", 1e3),
            Reading("time_s", "at {amount} from the trial's start", "s"),
        ),
        picture=Segments(),
    )

    def repair(self, observed_ground: Places) -> Places:
        """Each marker put back."""
        for slip in self.slips:
            observed_ground = slip.repair(observed_ground)
        return observed_ground


def slips_together(findings: Sequence[MarkerFinding], scenes: Mapping[str, Scene]) -> list[MarkerFinding]:
    """Findings, with slips of neighbouring segments at one moment as one event.

    Args:
        findings: of all trials and rounds.
        scenes: by trial.
    """
    events: list[list[MarkerSlip]] = []
    for finding in findings:
        if isinstance(finding, MarkerSlip):
            scene = scenes[finding.frames.trial]
            same = [event for event in events if any(_belong(scene, finding, slip) for slip in event)]
            joined = [*(slip for event in same for slip in event), finding]
            events = [*(event for event in events if event not in same), joined]
    found: list[MarkerFinding] = []
    for finding in findings:
        event = next((event for event in events if finding in event), None)
        if event is None or len(event) == 1:
            found.append(finding)
        elif event[0] is finding:
            found.append(_event(event, scenes))
    return found


def of_others(
    scene: Scene, slip: MarkerSlip, moved: Sequence[str], shift: Estimate
) -> SegmentDisplaced | None:
    """The event in which these markers moved together, in place of a slip that another seems to have.

    Args:
        scene: its trial.
        slip: of that one, which is none of these.
        moved: names of the markers.
        shift: by how much [m].

    Returns:
        None where the model knows none of them.
    """
    known = [scene.markers.names.index(name) for name in moved if name in scene.markers.names]
    if not known:
        return None
    bodies = dict.fromkeys(scene.skeleton.body_names[scene.markers.body[m]] for m in known)
    parameters = {"shift_m": shift, "time_s": slip.parameters["time_s"]}
    return SegmentDisplaced("+".join(bodies), parameters, slip.frames, slip.gain, (slip,))


def of_leap(scene: Scene, leap: Leap, names: Sequence[str]) -> MarkerFinding | None:
    """What a leap of recorded markers is: a slip of one, or several that moved together.

    Args:
        scene: its trial.
        leap: found in the recording.
        names: of the recording's markers.

    Returns:
        None where several moved, none of which the model uses.
    """
    sizes = np.linalg.norm(leap.shift_ground, axis=1)
    std = float(np.hypot(leap.std_m, RESOLVED_M))
    places = float(np.log(scene.frames * len(names)))
    gain = 0.5 * float((sizes**2).sum()) / std**2 - len(sizes) * places
    moved = [names[m] for m in leap.markers]
    parameters = {
        "shift_m": Estimate(float(sizes.mean()), float(np.hypot(sizes.std(), std))),
        "time_s": Estimate(leap.frame / scene.rate, 1 / scene.rate),
    }
    frames = Range(scene.name, leap.frame, scene.frames)
    slips = tuple(
        _slip_of(scene, name, shift, std, (frames, gain))
        for name, shift in zip(moved, leap.shift_ground, strict=True)
        if name in scene.markers.names
    )
    if len(moved) == 1:
        return slips[0] if slips else UnusedMarkerSlip(moved[0], parameters, frames, gain)
    if not slips:
        return None
    bodies = dict.fromkeys(scene.skeleton.body_names[s.body] for s in slips)
    return SegmentDisplaced("+".join(bodies), parameters, frames, gain, slips)


def _slip_of(
    scene: Scene, name: str, shift_ground: Float[np.ndarray, "3"], std_m: float, event: tuple[Range, float]
) -> MarkerSlip:
    frames, gain = event
    marker = scene.markers.names.index(name)
    body = int(scene.markers.body[marker])
    R = scene.R_ground_body[:, body]
    shift = R[frames.start].T @ shift_ground
    parameters = {
        "shift_m": Estimate(float(np.linalg.norm(shift)), std_m),
        "time_s": Estimate(frames.start / scene.rate, 1 / scene.rate),
        **{f"shift_{axis}_m": Estimate(float(v), std_m) for axis, v in zip("xyz", shift, strict=True)},
    }
    return MarkerSlip(name, parameters, frames, gain, marker, body, shift, R, in_its_path=True)


def _belong(scene: Scene, one: MarkerSlip, other: MarkerSlip) -> bool:
    """At one moment, on one segment or on two of which the one carries the other."""
    if one.frames.trial != other.frames.trial or one.target == other.target:
        return False
    if abs(one.frames.start - other.frames.start) > TOGETHER_S * scene.rate:
        return False
    a, b = one.body, other.body
    return a == b or _carrier(scene, a) == b or _carrier(scene, b) == a


def _carrier(scene: Scene, body: int) -> int:
    """The next segment towards the root that has markers; -1 beyond the root. A talus has none."""
    parent = scene.skeleton.joints[body].parent
    while parent >= 0 and parent not in scene.markers.body:
        parent = scene.skeleton.joints[parent].parent
    return parent


def _event(slips: Sequence[MarkerSlip], scenes: Mapping[str, Scene]) -> SegmentDisplaced:
    scene = scenes[slips[0].frames.trial]
    bodies = dict.fromkeys(scene.skeleton.body_names[s.body] for s in slips)
    first = min(slips, key=lambda slip: slip.frames.start)
    sizes = [slip.parameters["shift_m"] for slip in slips]
    mean = float(np.mean([size.value for size in sizes]))
    std = float(np.hypot(np.std([size.value for size in sizes]), np.mean([size.std for size in sizes])))
    return SegmentDisplaced(
        target="+".join(bodies),
        parameters={"shift_m": Estimate(mean, std), "time_s": first.parameters["time_s"]},
        frames=first.frames,
        gain=max(slip.gain for slip in slips),
        slips=tuple(slips),
    )
