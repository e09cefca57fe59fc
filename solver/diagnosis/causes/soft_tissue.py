"""Soft tissue carries all markers of a segment together over the bone, as the near joints turn."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.about import About, AtFault, CorrectedBy, Entry, Named
from solver.diagnosis.causes.effect import Estimate, Range
from solver.diagnosis.causes.marker_effect import MarkerFinding
from solver.diagnosis.causes.pictures import Segments
from solver.diagnosis.causes.readings import Reading
from solver.diagnosis.causes.scene import Scene
from solver.diagnosis.causes.segment_displacement import SegmentDisplacement, segment_displacements
from solver.kinematics.scale_prior import without_side

# Sound recordings: thighs 4 to 9 mm, shanks and feet 1 to 7, pelvis 2 to 11, arms 1 to 18, trunk to 19. Twins
# that reach 7 mm differ by a factor of 1.35 at most; synthetic ones up to 7.8 mm in squares.
BEYOND_TWIN_M = 0.0082
USUAL_TURN_RAD = 0.45  # root mean square of a thigh's joints in walks, where that was seen; a squat's is 0.85
AGAINST_TWIN = 1.5
WITHOUT_TWIN_M = 0.025
ROOT_M = 0.0135
CERTAIN_STDS = 2.0  # 19 ± 11 mm is no slide
LEAST_GAIN = 10.0
MOST_SEGMENTS = 2


ABOUT = About(
    id="soft_tissue",
    entry=Entry(
        "body",
        (
            "the segment's markers slide over the bone with the near joints' angles, more than soft tissue "
            "usually does"
        ),
        "`rms_m`",
    ),
    title="markers that slide over the bone: {target}",
    sentence=(
        "Soft tissue: the markers of {target} move together over the bone as the neighbouring joints turn."
    ),
    remedy=(
        "Next time put the markers on bony places or on a rigid plate strapped to the segment, not on muscle."
    ),
    told_apart_by=(
        "a wrong joint centre looks the same: a functional calibration of the near joints tells them apart"
    ),
    branch="markers/several at once",
    names=Named.BODIES,
    at_fault=AtFault.MODEL,
    corrected_by=CorrectedBy.NOTHING,
    in_markers=True,
    readings=(Reading("rms_m", "by {amount} (root mean square)", "mm", 1e3),),
    picture=Segments(),
)


@dataclass(frozen=True, eq=False)
class SoftTissue(MarkerFinding):
    """observed(t) = true(t) + R(t) displacement(t) for all markers of the segment.

    The displacement in the segment's axes is linear in the rotation vectors to the neighbouring segments.
    What cannot be seen: a displacement that the joints allow (of a forearm, a trunk between few markers), a
    constant one, one that turns the segment's markers about the bone, and one on both sides alike that is not
    far beyond what skin does on everybody. A joint whose centre or axis is off in the model looks the same.
    """

    markers: tuple[int, ...]
    displacement_ground: Float[np.ndarray, "frames 3"]  # [m]

    about = ABOUT
    of_the_body = True

    def repaired(
        self, observed_ground: Float[np.ndarray, "frames markers 3"]
    ) -> Float[np.ndarray, "frames markers 3"]:
        """The segment's markers carried back."""
        corrected = observed_ground.copy()
        corrected[:, self.markers] -= self.displacement_ground[:, None]
        return corrected


def findings(scene: Scene) -> list[MarkerFinding]:
    """Segments whose markers move together, certainly and far beyond what skin does on everybody.

    A segment is compared with its counterpart of the other side, of the same joints, the same person and the
    same movement, and may slide farther the more its joints turn; without a counterpart only what no sound
    recording shows is reported. The counterpart of one that was found has nothing left to be compared with.
    """
    found: list[MarkerFinding] = []
    names, judged = scene.skeleton.body_names, set()
    at = scene
    for _ in range(MOST_SEGMENTS):
        seen = segment_displacements(at)
        beyond = [
            d
            for d in seen
            if d.gain > LEAST_GAIN
            and d.rms_m > max(_ordinary(at, d, seen), CERTAIN_STDS * d.rms_std_m)
            and without_side(names[d.body]) not in judged
        ]
        if not beyond:
            break
        worst = max(beyond, key=lambda d: d.energy)
        if any(d.energy > worst.energy for d in seen if _adjoin(scene, d.body, worst.body)):
            break
        judged.add(without_side(names[worst.body]))
        found.append(_finding(scene, worst))
        repaired = found[-1].repaired(at.markers.observed_ground)
        at = replace(at, markers=replace(at.markers, observed_ground=repaired))
    return found


def _adjoin(scene: Scene, one: int, other: int) -> bool:
    joints = scene.skeleton.joints
    return joints[one].parent == other or joints[other].parent == one


def _ordinary(scene: Scene, displacement: SegmentDisplacement, seen: list[SegmentDisplacement]) -> float:
    """What this segment may show without being remarkable [m]."""
    names = scene.skeleton.body_names
    stem = without_side(names[displacement.body])
    counterparts = [d for d in seen if d is not displacement and without_side(names[d.body]) == stem]
    if counterparts:
        beyond_m = BEYOND_TWIN_M * max(1.0, displacement.turn_rad / USUAL_TURN_RAD)
        return max(float(np.hypot(counterparts[0].rms_m, beyond_m)), AGAINST_TWIN * counterparts[0].rms_m)
    return ROOT_M if scene.skeleton.joints[displacement.body].parent < 0 else WITHOUT_TWIN_M


def _finding(scene: Scene, displacement: SegmentDisplacement) -> SoftTissue:
    own = tuple(np.flatnonzero(scene.markers.body == displacement.body).tolist())
    return SoftTissue(
        target=scene.skeleton.body_names[displacement.body],
        parameters={"rms_m": Estimate(displacement.rms_m, displacement.rms_std_m)},
        frames=Range(scene.name, 0, scene.frames),
        gain=displacement.gain,
        markers=own,
        displacement_ground=displacement.displacement_ground,
    )
