"""Soft tissue carries all markers of a segment together over the bone, as the near joints turn.

With P as in `marker_effect` and the markers of segment b displaced by d_b in its axes, the sum of P e over
them is Σ_c A_bc d_c: what a segment's soft tissue does, the pose hands on to its neighbours. So all are
told together. The one that is judged is free, the others are held to a little: left out, each would have a
share of the others' displacements for its own; quite free, they would take it away from the one judged.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial.transform import Rotation

from solver.diagnosis.causes.about import About, AtFault, CorrectedBy, Entry, Named, Reading, Segments
from solver.diagnosis.causes.effect import Estimate, Range
from solver.diagnosis.causes.marker_effect import (
    FEWEST_SEEN,
    NOISE_M,
    MarkerFinding,
    Places,
    projected_chunks,
    seen_share,
)
from solver.diagnosis.causes.observed_trial import Scene
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
SOFT_TISSUE = 0.3  # joints decide where a segment's markers should be, or nothing would be seen
FEWEST_MARKERS = 2
FEWEST_S = 0.8  # of frames that show the segment; shorter trials have no range of angles
LEAST_HELD = 0.5  # information of the segment's markers moved together, below which a direction is not judged
LEAST_TURN_RAD = 0.03  # root mean square; joints that turn less tell nothing
OWN_STD_M_PER_RAD = 0.05  # prior of the displacement that is judged
OTHERS_STD_M_PER_RAD = 0.003  # of all others
TOGETHER_S = 0.2  # errors within are one
LOOSE = 1e-9  # on constants, which have no prior


@dataclass(frozen=True, eq=False)
class SegmentDisplacement:
    """What regression on the angles finds for one segment, alarming or not."""

    body: int
    rms_m: float
    rms_std_m: float
    energy: float  # in squares of metres: what of all markers' errors it explains
    gain: float  # [nats]
    turn_rad: float  # root mean square of the near joints' turns, which soft tissue follows
    displacement_ground: Float[np.ndarray, "frames 3"]  # [m]


@dataclass(frozen=True, eq=False)
class _Together:
    """P e and P of `marker_effect`, summed over the markers of segments."""

    score_body: Float[np.ndarray, "frames segments 3"]
    A: Float[np.ndarray, "frames segments segments 3 3"]


@dataclass(frozen=True, eq=False)
class _Segment:
    """A segment whose markers can be judged; its displacement is axes @ (basis @ parameters)."""

    place: int  # among the segments with markers
    body: int
    usable: Bool[np.ndarray, " frames"]
    basis: Float[np.ndarray, "frames terms"]  # a constant, and the turns of the near joints [rad]
    axes: Float[np.ndarray, "3 directions"]

    @property
    def turn_rad(self) -> float:
        """Of the near joints together; root mean square."""
        return float(np.sqrt((self.basis[self.usable, 1:] ** 2).sum(axis=1).mean()))

    @property
    def count(self) -> int:
        return self.basis.shape[1] * self.axes.shape[1]

    def prior(self, std_m_per_rad: float) -> Float[np.ndarray, " count"]:
        """Precisions of the parameters, terms first [1/m²]; constants are free."""
        of_terms = np.repeat([0.0, std_m_per_rad**-2.0], [1, self.basis.shape[1] - 1])
        return np.repeat(of_terms, self.axes.shape[1])

    def displacement_body(self, parameters: Float[np.ndarray, " count"]) -> Float[np.ndarray, "frames 3"]:
        """Without its constant [m]."""
        per_rad = parameters.reshape(-1, self.axes.shape[1])[1:]
        return np.asarray(self.basis[:, 1:] @ per_rad @ self.axes.T)


def segment_displacements(scene: Scene) -> list[SegmentDisplacement]:
    """Displacement of every segment that has markers and neighbours, beside what the others do."""
    bodies = np.unique(scene.markers.body)
    together = _together(scene, bodies)
    segments = _segments(scene, bodies, together)
    if not segments:
        return []
    ends = np.cumsum([s.count for s in segments])
    own = [np.arange(end - s.count, end) for s, end in zip(segments, ends, strict=True)]
    normal, right = np.zeros((ends[-1], ends[-1])), np.zeros(ends[-1])
    for i, one in enumerate(segments):
        right[own[i]] = np.einsum(
            "ta,ti->ai", one.basis, together.score_body[:, one.place] @ one.axes
        ).ravel()
        for k, other in enumerate(segments[: i + 1]):
            met = one.axes.T @ together.A[:, one.place, other.place] @ other.axes
            block = np.einsum("ta,tb,tij->aibj", one.basis, other.basis, met, optimize=True)
            normal[np.ix_(own[i], own[k])] = block.reshape(one.count, other.count)
            normal[np.ix_(own[k], own[i])] = normal[np.ix_(own[i], own[k])].T
    found = []
    for i in range(len(segments)):
        std = [OWN_STD_M_PER_RAD if k == i else OTHERS_STD_M_PER_RAD for k in range(len(segments))]
        prior = np.concatenate([s.prior(w) for s, w in zip(segments, std, strict=True)])
        precision = normal + np.diag(NOISE_M**2 * TOGETHER_S * scene.rate * prior + LOOSE)
        x = np.linalg.solve(precision, right)
        without = np.setdiff1d(np.arange(len(x)), own[i][segments[i].axes.shape[1] :])  # its constant stays
        rest = np.linalg.solve(precision[np.ix_(without, without)], right[without])
        energy = float(right @ x - right[without] @ rest)
        moved = [s.displacement_body(x[o]) for s, o in zip(segments, own, strict=True)]
        left = _left(segments, moved, i, together)
        found.append(_describe(scene, segments[i], moved[i], energy, left=left))
    return found


def _together(scene: Scene, bodies: Int[np.ndarray, " segments"]) -> _Together:
    of_body = (scene.markers.body[:, None] == bodies).astype(float)
    score = np.zeros((scene.frames, len(bodies), 3))
    A = np.zeros((scene.frames, len(bodies), len(bodies), 3, 3))
    for chunk in projected_chunks(scene, SOFT_TISSUE):
        score[chunk.frames] = np.einsum("tmi,mb->tbi", chunk.score_body, of_body)
        weight = np.einsum("mb,tmn,nc->tbc", of_body, chunk.W, of_body, optimize=True)
        halves = np.einsum("tmid,mb->tbid", chunk.halves, of_body)
        WJ = np.einsum("tmid,mb->tbid", chunk.WJ, of_body)
        posed = np.einsum("tbid,tcjd->tbcij", halves, WJ, optimize=True)
        A[chunk.frames] = weight[..., None, None] * np.eye(3) - posed
    return _Together(score, A)


def _segments(scene: Scene, bodies: Int[np.ndarray, " segments"], together: _Together) -> list[_Segment]:
    seen = np.isfinite(scene.markers.observed_ground).all(axis=2)
    enough = seen_share(scene) >= FEWEST_SEEN
    found = []
    for place, body in enumerate(bodies.tolist()):
        usable = enough & (seen[:, scene.markers.body == body].sum(axis=1) >= FEWEST_MARKERS)
        turns = _turns(scene, body)
        if usable.sum() < FEWEST_S * scene.rate or not turns.shape[1]:
            continue
        held, axes = np.linalg.eigh(np.median(together.A[usable, place, place], axis=0))
        axes = axes[:, held > LEAST_HELD]
        if axes.shape[1]:
            basis = np.column_stack([np.ones(scene.frames), turns]) * usable[:, None]
            found.append(_Segment(place, body, usable, basis, axes))
    return found


def _left(
    segments: list[_Segment], moved: list[np.ndarray], k: int, together: _Together
) -> tuple[Float[np.ndarray, "usable directions"], Float[np.ndarray, "usable directions directions"]]:
    """How far the k-th segment's markers are off together once all have moved [m], and the information."""
    own = segments[k]
    score = together.score_body[own.usable, own.place]
    for other, displacement in zip(segments, moved, strict=True):
        A = together.A[own.usable, own.place, other.place]
        score = score - np.einsum("tij,tj->ti", A, displacement[own.usable])
    held = own.axes.T @ together.A[own.usable, own.place, own.place] @ own.axes
    error = np.linalg.solve(held, (score @ own.axes)[..., None])[..., 0]
    return error - error.mean(axis=0), held


def _describe(
    scene: Scene,
    segment: _Segment,
    moved_body: Float[np.ndarray, "frames 3"],
    energy: float,
    *,
    left: tuple[np.ndarray, np.ndarray],
) -> SegmentDisplacement:
    error, held = left
    scatter = float(np.einsum("ti,tij,tj->", error, held, error)) / error.size + NOISE_M**2
    one = TOGETHER_S * scene.rate
    independent = max(1.0, segment.usable.sum() / one)
    terms = segment.count - segment.axes.shape[1]  # without the constant
    information = float(np.median(np.trace(held, axis1=1, axis2=2))) / 3
    return SegmentDisplacement(
        body=segment.body,
        rms_m=float(np.sqrt((moved_body[segment.usable] ** 2).sum(axis=1).mean())),
        rms_std_m=float(np.sqrt(scatter * segment.count / (independent * information))),
        energy=energy,
        gain=0.5 * energy / one / scatter - 0.5 * terms * float(np.log(independent)),
        turn_rad=segment.turn_rad,
        displacement_ground=np.einsum("tij,tj->ti", scene.R_ground_body[:, segment.body], moved_body),
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

    about = About(
        id="soft_tissue",
        entry=Entry(
            "body",
            (
                "the segment's markers slide over the bone with the near joints' angles, more than "
                "soft tissue usually does"
            ),
            "`rms_m`",
        ),
        title="markers that slide over the bone: {target}",
        sentence=(
            "Soft tissue: the markers of {target} move together over the bone as the neighbouring "
            "joints turn."
        ),
        remedy=(
            "Next time put the markers on bony places or on a rigid plate strapped to the segment, "
            "not on muscle."
        ),
        separate_by=(
            "a wrong joint centre looks the same: a functional calibration of the near joints tells "
            "them apart"
        ),
        branch="markers/several at once",
        names=Named.BODIES,
        at_fault=AtFault.MODEL,
        corrected_by=CorrectedBy.NOTHING,
        in_markers=True,
        readings=(Reading("rms_m", "by {amount} (root mean square)", "mm", 1e3),),
        picture=Segments(),
    )
    of_the_body = True

    def repair(self, observed_ground: Places) -> Places:
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
        repaired = found[-1].repair(at.markers.observed_ground)
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
