"""Short trials that could be recorded next: their stated motions, as the balance would see them.

Each is a trial of the present person in the present laboratory. Who stands bends joints along a stated path,
the soles stay on the floor, and the centre of mass stays above the middle of a plate; who walks does so as
in the present trial, again, faster, or back the other way. The motion's demand, divided among the plates
that the feet stand on, is what right plates would record.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import ForcePlate
from solver.capture.plates.conditioning import PlateLoads
from solver.common.errors import ModelError
from solver.diagnosis.causes.observed_trial import PlateScene, Scene, force_at
from solver.dynamics.inertia_parameters import pseudo_inertia, required_wrench
from solver.dynamics.material_acceleration import material_accelerations
from solver.dynamics.root_wrench import centre_of_mass, centre_of_mass_of, with_com_at
from solver.kinematics.motion import Motion
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import ForwardKinematics, body_poses
from solver.skeleton.skeleton import Coordinate, Skeleton

PLANNED = "what to record next"  # the trial's name, which no cause of one trial has
SIDES = ("", "_r", "_l")
SWAY_M = ((0.010, 0.37), (0.006, 0.29))  # of who stands still, forward and aside, and how often a second
ENOUGH_HZ = 50.0  # frames of who stands
APART_M = 0.6  # plates farther apart are not stood on at ease with a foot each
FAR_M = 1.0  # who goes that far walks over ground
ONE_FOOT_SHARE = 0.2  # of the frames on one foot alone, from which on somebody walks
FASTER = 1.2
HALF_TURN = np.diag([-1.0, 1.0, -1.0])
SQUAT = {"hip_flexion": 80.0, "knee_angle": 90.0, "ankle_angle": 25.0, "pelvis_tilt": -25.0}


@dataclass(frozen=True)
class Kind:
    """What somebody does on one plate, or with a foot on each of two."""

    id: str
    words: str  # {plate} is filled in
    seconds: float
    far_deg: Mapping[str, float] = field(default_factory=dict)  # joint angles at the far end of the path
    per_second: float = 0.5  # how often it is reached
    turned: bool = False
    shift: float = 0.0  # of the share of the load, from one plate to the other


STANDING = (
    Kind("stand", "stand still on {plate} for 3 s", 3.0),
    Kind("turned", "stand still on {plate} for 3 s, facing the other way", 3.0, turned=True),
    Kind("squat", "squat twice on {plate}", 4.0, SQUAT),
    Kind("bounce", "bend the knees a little, quickly, for 3 s on {plate}", 3.0,
         {stem: 0.4 * degrees for stem, degrees in SQUAT.items()}, 1.25),
    Kind("arms", "stand on {plate} and swing both arms for 3 s", 3.0, {"arm_flex": 80.0}, 0.8),
    Kind("bend", "stand on {plate} and bend the trunk forward twice", 4.0,
         {"lumbar_extension": -40.0, "pelvis_tilt": -20.0}),
)  # fmt: skip
ACROSS = Kind(
    "shift",
    "stand with a foot on {plate} and one on {other}, and shift the weight to and fro for 4 s",
    4.0,
    shift=0.4,
)
AGAIN = Kind("again", "record the same once more", 0.0)
WALKS = (
    AGAIN,
    Kind("faster", "walk once more, faster", 0.0),
    Kind("back", "walk back the other way", 0.0, turned=True),
)
SCALE = Kind("scale", "what a scale says of the person, with all that is worn (`scale_kg`)", 0.0)
IDS = tuple(kind.id for kind in (*STANDING, ACROSS, *WALKS, SCALE))


@dataclass(frozen=True)
class ShortTrial:
    """One that could be recorded next."""

    kind: Kind
    plates: tuple[str, ...]  # on which it is done; none: as in the present trial, or on a scale

    @property
    def words(self) -> str:
        """What to do, with the plates' targets."""
        named = dict(zip(("plate", "other"), self.plates, strict=False))
        return self.kind.words.format(**named)

    def scene(self, present: Scene, *, in_full: bool = False) -> Scene | None:
        """As the balance would see it; None where this body has no such joints.

        Args:
            present: a trial.
            in_full: with as many frames a second, also of who stands.
        """
        try:
            return self._stand(present, in_full) if self.plates else self._walk(present)
        except ModelError:
            return None

    def _stand(self, present: Scene, in_full: bool) -> Scene | None:
        rate = present.rate / (1 if in_full else max(1, round(present.rate / ENOUGH_HZ)))
        q = _bending(present.skeleton, self.kind, rate)
        if q is None:
            return None
        times = np.arange(len(q)) / rate
        centres = np.array([_plate(present, target).centre_ground for target in self.plates])
        aside = self.kind.shift * np.sin(np.pi * times)
        shares = np.stack([0.5 + aside, 0.5 - aside], axis=1) if len(centres) > 1 else np.ones((len(q), 1))
        sway = [size * np.sin(2 * np.pi * rate * times) for size, rate in SWAY_M]
        over = shares @ centres + np.stack([sway[0], np.zeros(len(q)), sway[1]], axis=1)
        com = centre_of_mass_of(present.skeleton, q)
        over[:, 1] = com[:, 1] - _soles_height(present, q)
        q = with_com_at(present.skeleton, q, over)
        points = np.broadcast_to(centres, (len(q), *centres.shape))
        turned = _middle(centres) if self.kind.turned else None
        loads = _Loads(points, shares, self.plates)
        return _planned(
            present, Motion(present.motion.dofs, q, rate), loads, np.ones(len(q), dtype=bool), turned
        )

    def _walk(self, present: Scene) -> Scene:
        pace = FASTER if self.kind.id == "faster" else 1.0
        times = np.arange(int((present.frames - 1) / pace) + 1) / present.rate * pace
        nearest = np.minimum(np.round(times * present.rate).astype(int), present.frames - 1)
        plates = [p for p in present.plates if p.loaded.any()]
        loads = np.stack([np.where(p.loaded, p.wrench_ground[:, 1], 0.0) for p in plates], axis=1)
        shares = loads / np.maximum(loads.sum(axis=1, keepdims=True), 1.0)
        points = np.stack([_pressure(p) for p in plates], axis=1)
        middle = _middle(np.array([p.centre_ground for p in plates])) if self.kind.turned else None
        targets = [p.target if middle is None else _opposite(p, plates, middle) for p in plates]
        motion = Motion(present.motion.dofs, present.motion.at(times), present.rate)
        own = _Loads(points[nearest], shares[nearest], targets)
        return _planned(present, motion, own, present.counts[nearest], middle)


@dataclass(frozen=True, eq=False)
class _Loads:
    """Who bears what: points under the feet [m], shares of the demand, and whose they are."""

    points: Float[np.ndarray, "frames feet 3"]
    shares: Float[np.ndarray, "frames feet"]
    targets: Sequence[str]


def short_trials(present: Scene, about: Sequence[str]) -> Iterator[ShortTrial]:
    """All that this laboratory can record next; beside these trials, what a scale says unless one did.

    Args:
        present: a trial.
        about: targets that it may be about, plates among them, the likeliest first.
    """
    loaded = _loaded(present)
    one = next((target for target in about if target in loaded), loaded[0])
    yield from (ShortTrial(kind, (one,)) for kind in STANDING)
    apart = {
        other: float(
            np.linalg.norm(_plate(present, one).centre_ground - _plate(present, other).centre_ground)
        )
        for other in loaded
        if other != one
    }
    other = min(apart, key=apart.__getitem__, default=one)
    if apart.get(other, APART_M) < APART_M:
        yield ShortTrial(ACROSS, (one, other))
    yield ShortTrial(AGAIN, ())
    if present.scale_factor is None:
        yield ShortTrial(SCALE, ())
    contacts = present.contacts.in_contact
    if (contacts.sum(axis=1) == 1).mean() > ONE_FOOT_SHARE:
        yield ShortTrial(WALKS[1], ())
        if np.linalg.norm(present.com_ground[-1] - present.com_ground[0]) > FAR_M:
            yield ShortTrial(WALKS[2], ())


def _bending(skeleton: Skeleton, kind: Kind, rate: float) -> Float[np.ndarray, "frames dofs"] | None:
    """The model's own upright posture, bent along the stated path; None where a joint is missing."""
    frames = round(kind.seconds * rate) + 1
    times = np.arange(frames) / rate
    q = np.tile(skeleton.default_q, (frames, 1))
    far = np.sin(np.pi * kind.per_second * times) ** 2
    for stem, degrees in kind.far_deg.items():
        columns = [
            k
            for k, one in enumerate(skeleton.free_coordinates)
            if one.name in {stem + side for side in SIDES}
        ]
        if not columns:
            return None
        for k in columns:
            sign = _flexion(skeleton.free_coordinates[k]) if stem == "knee_angle" else 1.0
            q[:, k] += sign * np.radians(degrees) * far
    return q


def _flexion(knee: Coordinate) -> float:
    """Sign of flexion: models differ, and a knee bends one way alone."""
    return 1.0 if abs(knee.range[1]) >= abs(knee.range[0]) else -1.0


def _soles_height(scene: Scene, q: Float[np.ndarray, "frames dofs"]) -> Float[np.ndarray, " frames"]:
    """Of the feet's origins [m], less what it is at first and the height of the floor's plates."""
    _, p_ground = body_poses(scene.skeleton, q)
    feet = [scene.skeleton.body_index(name) for name in scene.contacts.foot_bodies]
    height = p_ground[:, feet, 1].mean(axis=1)
    return np.asarray(height - height[0])


def _loaded(scene: Scene) -> list[str]:
    return [p.target for p in scene.plates if p.loaded.any()]


def _plate(scene: Scene, target: str) -> PlateScene:
    return next(p for p in scene.plates if p.target == target)


def _middle(centres: Float[np.ndarray, "plates 3"]) -> Float[np.ndarray, "3"]:
    return (centres.max(axis=0) + centres.min(axis=0)) / 2


def _opposite(plate: PlateScene, plates: Sequence[PlateScene], middle: Float[np.ndarray, "3"]) -> str:
    """The plate nearest to where this one comes to lie after half a turn."""
    there = middle + HALF_TURN @ (plate.centre_ground - middle)
    return min(plates, key=lambda p: float(np.linalg.norm(p.centre_ground - there))).target


def _pressure(plate: PlateScene) -> Float[np.ndarray, "frames 3"]:
    """Centre of pressure at the height of the plate's middle [m]; the middle while it is not loaded."""
    F, M, height = plate.wrench_ground[:, :3], plate.wrench_ground[:, 3:], plate.centre_ground[1]
    vertical = np.where(plate.loaded, F[:, 1], 1.0)
    x, z = (M[:, 2] + height * F[:, 0]) / vertical, (height * F[:, 2] - M[:, 0]) / vertical
    cop = np.stack([x, np.full(len(F), height), z], axis=1)
    return np.where(plate.loaded[:, None], cop, plate.centre_ground)


def _planned(
    present: Scene,
    motion: Motion,
    loads: _Loads,
    counts: Bool[np.ndarray, " frames"],
    turned_about: Float[np.ndarray, "3"] | None,
) -> Scene:
    """A motion and who bears it as a scene, turned by half a turn where asked for."""
    skeleton, q, rate = present.skeleton, motion.q, motion.rate
    v, a = motion.velocity, motion.acceleration
    kinematics = ForwardKinematics(skeleton)
    poses = kinematics.poses(q)
    material, _ = material_accelerations(kinematics, poses, q, v, a)
    R, p, com = poses.R_ground_body, poses.p_ground_body, centre_of_mass(skeleton, poses)
    markers, points = kinematics.markers(poses), loads.points
    if turned_about is not None:
        shift = turned_about - HALF_TURN @ turned_about
        R, material = HALF_TURN @ R, HALF_TURN @ material
        p, com, markers, points = (x @ HALF_TURN + shift for x in (p, com, markers, points))
    T = np.zeros((*R.shape[:2], 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = R, p, 1.0
    J = np.stack([pseudo_inertia(body) for body in skeleton.bodies])
    required = required_wrench(material, T, J).sum(axis=1)
    wrench = _divided(required, points, loads.shares)
    own = {
        p.target: [k for k, target in enumerate(loads.targets) if target == p.target] for p in present.plates
    }
    plates = tuple(_read(p, wrench[:, own[p.target]].sum(axis=1), rate) for p in present.plates)
    feet = len(present.contacts.foot_bodies)
    nothing = np.zeros((len(q), feet, 6))
    contacts = replace(
        present.contacts,
        wrench_ground=nothing,
        wrench_raw_ground=nothing,
        cop_ground=np.full((len(q), feet, 3), np.nan),
        observed=np.ones(len(q), dtype=bool),
        in_contact=np.ones((len(q), feet), dtype=bool),
        plate=np.zeros((len(q), len(plates)), dtype=np.int64),
        unassigned=None,
    )
    return replace(
        present,
        name=PLANNED,
        motion=motion,
        velocity=v,
        acceleration=a,
        R_ground_body=R,
        p_ground_body=p,
        material=material,
        com_ground=com,
        required_ground=required,
        plates=plates,
        markers=replace(present.markers, observed_ground=markers, model_ground=markers),
        contacts=contacts,
        proposals=(),
        counts=counts,
    )


def _divided(
    required: Float[np.ndarray, "frames 6"],
    points: Float[np.ndarray, "frames feet 3"],
    shares: Float[np.ndarray, "frames feet"],
) -> Float[np.ndarray, "frames feet 6"]:
    """Forces by shares at their points, and what moment is left by shares as well; about the origin."""
    force = shares[:, :, None] * required[:, None, :3]
    wrench = force_at(force, points)
    left = required[:, 3:] - wrench[:, :, 3:].sum(axis=1)
    wrench[:, :, 3:] += shares[:, :, None] * left[:, None]
    return wrench


def _read(plate: PlateScene, wrench: Float[np.ndarray, "frames 6"], rate: float) -> PlateScene:
    """The plate as it would read a wrench, a sample a frame."""
    carrying = wrench[:, 1] >= plate.conditioning.threshold_N
    wrench = np.where(carrying[:, None], wrench, 0.0)
    recorded = ForcePlate(
        plate.plate.name,
        wrench[:, :3],
        wrench[:, 3:],
        np.full((len(wrench), 3), np.nan),
        rate,
        corners_ground=plate.plate.corners_ground,
    )
    loads = PlateLoads(wrench, wrench, carrying, np.ones(len(wrench), dtype=bool))
    times = np.arange(len(wrench)) / rate
    scene = replace(plate, plate=recorded, loads=loads, loaded=carrying, times=times, wrench_ground=wrench)
    return replace(scene, wrench_ground=np.nan_to_num(scene.at_frames(wrench)))


def can_move(present: Scene) -> bool:
    """Whether the body's root moves freely, as stated motions need."""
    try:
        root_joint(present.skeleton)
    except ModelError:
        return False
    return True
