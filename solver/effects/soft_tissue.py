"""Soft tissue: flesh carries all markers of a segment together over the bone, as the near joints turn."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from solver.effects.effect import Estimate, Range
from solver.effects.marker_effect import MarkerFinding, PoseFree, pose_free, seen_share
from solver.effects.scene import Scene
from solver.kinematics.scale_prior import without_side

FLESH = 0.3  # joints decide where a segment's markers should be, or nothing would be seen
FEWEST_MARKERS = 2
FEWEST_S = 0.8  # of frames that show the segment; shorter trials have no range of angles
FEWEST_SEEN = 0.5
LEAST_HELD = 0.5  # information of the segment's markers moved together, below which a direction is not judged
LEAST_TURN_RAD = 0.03  # root mean square; joints that turn less tell nothing
PER_RAD_STD_M = 0.05  # prior of the displacement
NOISE_M = 0.003
TOGETHER_S = 0.2  # errors within are one
# Sound recordings: thighs 4 to 11 mm, shanks and feet 1 to 6, pelvis 2 to 10, arms 1 to 14, trunk to 18;
# twins differ by a factor of 2 at most where they reach 8 mm; squats with another cause reach 7.9.
LEAST_M = 0.008
AGAINST_TWIN = 1.6
BEYOND_TWIN_M = 0.002
WITHOUT_TWIN_M = 0.025
ROOT_M = 0.0135
LEAST_GAIN = 10.0
MOST_SEGMENTS = 2


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

    id = "soft_tissue"
    of_the_body = True
    sentence = (
        "The markers of {target} ride on flesh and move together over the bone as the near joints turn."
    )
    remedy = (
        "Put the markers on bony places or on a rigid plate strapped to the segment; avoid muscle bellies."
    )
    rivals_told_apart_by = (
        "a joint centre that is off looks alike: a functional calibration of the near joints tells them apart"
    )

    def repaired(
        self, observed_ground: Float[np.ndarray, "frames markers 3"]
    ) -> Float[np.ndarray, "frames markers 3"]:
        """The segment's markers carried back."""
        mended = observed_ground.copy()
        mended[:, self.markers] -= self.displacement_ground[:, None]
        return mended


@dataclass(frozen=True, eq=False)
class SegmentDisplacement:
    """What regression on the angles finds for one segment, alarming or not."""

    body: int
    rms_m: float
    rms_std_m: float
    energy: float  # in squares of metres: what of all markers' errors it explains
    gain: float
    displacement_ground: Float[np.ndarray, "frames 3"]  # [m]


def findings(scene: Scene) -> list[MarkerFinding]:
    """Segments whose markers move together far beyond what skin does on everybody.

    A segment is compared with its twin of the other side, which has the same joints, the same person and the
    same movement; without one only what no sound recording shows is reported.
    """
    found: list[MarkerFinding] = []
    at = scene
    for _ in range(MOST_SEGMENTS):
        seen = segment_displacements(at)
        beyond = [d for d in seen if d.gain > LEAST_GAIN and d.rms_m > _ordinary(at, d, seen)]
        if not beyond:
            break
        worst = max(beyond, key=lambda d: d.energy)
        if any(d.energy > worst.energy for d in seen if _adjoin(scene, d.body, worst.body)):
            break
        found.append(_finding(scene, worst))
        repaired = found[-1].repaired(at.markers.observed_ground)
        at = replace(at, markers=replace(at.markers, observed_ground=repaired))
    return found


def segment_displacements(scene: Scene) -> list[SegmentDisplacement]:
    """Displacement of every segment that has markers and neighbours, each by itself."""
    free = pose_free(scene, FLESH)
    enough = seen_share(scene) >= FEWEST_SEEN
    found = [_displacement(scene, free, k, enough) for k in range(len(free.bodies))]
    return [d for d in found if d is not None]


def _adjoin(scene: Scene, one: int, other: int) -> bool:
    joints = scene.skeleton.joints
    return joints[one].parent == other or joints[other].parent == one


def _ordinary(scene: Scene, displacement: SegmentDisplacement, seen: list[SegmentDisplacement]) -> float:
    """What this segment may show without being remarkable [m]."""
    names = scene.skeleton.body_names
    stem = without_side(names[displacement.body])
    twins = [d for d in seen if d is not displacement and without_side(names[d.body]) == stem]
    if twins:
        return max(LEAST_M, AGAINST_TWIN * twins[0].rms_m + BEYOND_TWIN_M)
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


def _displacement(
    scene: Scene, free: PoseFree, segment: int, enough: np.ndarray
) -> SegmentDisplacement | None:
    body = int(free.bodies[segment])
    usable = enough & (free.seen[:, scene.markers.body == body].sum(axis=1) >= FEWEST_MARKERS)
    turns = _turns(scene, body)
    if usable.sum() < FEWEST_S * scene.rate or not turns.shape[1]:
        return None
    held, axes = np.linalg.eigh(np.median(free.cluster_information_body[usable, segment], axis=0))
    axes = axes[:, held > LEAST_HELD]
    directions = axes.shape[1]
    if not directions:
        return None
    basis = np.column_stack([np.ones(scene.frames), turns])
    count = basis.shape[1] * directions
    information = axes.T @ free.cluster_information_body[usable, segment] @ axes
    score = free.cluster_score_body[usable, segment] @ axes
    F = basis[usable]
    normal = np.einsum("ta,tb,tij->aibj", F, F, information, optimize=True).reshape(count, count)
    right = np.einsum("ta,ti->ai", F, score).ravel()
    prior = np.repeat([0.0] + [PER_RAD_STD_M**-2.0] * turns.shape[1], directions)
    one = TOGETHER_S * scene.rate
    covariance = np.linalg.inv(normal + NOISE_M**2 * one * np.diag(prior) + 1e-9 * np.eye(count))
    per_rad = (covariance @ right).reshape(-1, directions)
    move = (turns @ per_rad[1:]) @ axes.T
    rms = float(np.sqrt((move[usable] ** 2).sum(axis=1).mean()))
    moved = F[:, 1:] @ per_rad[1:]
    energy = float(np.einsum("ti,tij,tj->", moved, information, moved))
    left = np.linalg.solve(information, score[..., None])[..., 0] - F @ per_rad
    scatter = float(np.einsum("ti,tij,tj->", left, information, left)) / left.size + NOISE_M**2
    independent = max(1.0, usable.sum() / one)
    return SegmentDisplacement(
        body=body,
        rms_m=rms,
        rms_std_m=float(np.sqrt(scatter * count / (independent * held.mean()))),
        energy=energy,
        gain=0.5 * energy / one / scatter - 0.5 * (count - directions) * float(np.log(independent)),
        displacement_ground=np.einsum("tij,tj->ti", scene.R_ground_body[:, body], move),
    )


def _turns(scene: Scene, body: int) -> Float[np.ndarray, "frames turns"]:
    """Rotation vectors to the neighbouring segments about their means, along the axes that do turn [rad]."""
    joints = scene.skeleton.joints
    near = [joints[body].parent] if joints[body].parent >= 0 else []
    near += [b for b, joint in enumerate(joints) if joint.parent == body]
    turns = [np.zeros((scene.frames, 0))]
    for other in near:
        relative = Rotation.from_matrix(
            scene.R_ground_body[:, body].transpose(0, 2, 1) @ scene.R_ground_body[:, other]
        )
        turn = (relative.mean().inv() * relative).as_rotvec()
        turn -= turn.mean(axis=0)
        spread, axes = np.linalg.eigh(turn.T @ turn / scene.frames)
        turns.append(turn @ axes[:, spread > LEAST_TURN_RAD**2])
    return np.concatenate(turns, axis=1)
