"""Wrenches that a prediction fit may add to the plates', each with a parameter that all trials share.

Steps: curves over a step's phase, mirrored from left to right. A foot begins its step when it is farthest
ahead of the pelvis (Zeni et al. 2008, 10.1016/j.gaitpost.2007.07.007), or some time around that: how long
after, steps that plates have seen say. A step whose force is held out thus gets its time from its own markers
and from other steps' forces.

Gains on what the markers' own motion demands, of a body that is heavier, late or damped, axis by axis: the
wrench is g₀ W + g₁ Ẇ + g₂ Ẅ, with W required by the marker fit below a cut-off. A delay by τ is g₁ = −τ. No
steps are needed, so it holds for squats and stairs too.

Constants: a plate's zero level, a leaning model, a rucksack. All are in a frame that goes with the person:
what a body model gets wrong goes with the body.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.interpolate import BSpline
from scipy.ndimage import gaussian_filter1d
from scipy.signal import find_peaks

from solver.common.filters import ORDER, low_pass
from solver.common.frames_at_once import by_frames
from solver.common.notes import Kind, Note, noted
from solver.common.true_runs import runs
from solver.dynamics.force_prediction.settings import PHASE_KNOTS, PredictionSettings
from solver.dynamics.material_acceleration import required_ground
from solver.dynamics.root_wrench import about_point, root_centre
from solver.kinematics.motion import Motion
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import ForwardKinematics, cross
from solver.skeleton.skeleton import Skeleton

DEMAND_CUTOFF_HZ = 8.0  # [Hz] the motion's own demand is taken below it: above, marker noise dominates
DAMPING_STD_S2 = 1.76e-4  # [s²] of its second derivative's share: (2π·12 Hz)⁻², a loss of half at 12 Hz
PHASE_FORCE_SHARE = 0.025  # scatter of a curve's coefficients over the peak force: 20 N in a walk of 75 kg
PHASE_ARM_M = 0.004  # [m] scatter of a moment curve's coefficients over the peak force: 3 N·m there
SHORTEST_STRIDE_M = 0.15  # [m] a foot that swings forward by less, seen from the pelvis, takes no step
STEP_CHANGE = 1.6  # a step that lasts so many times the usual one, or less than its inverse, is none
CONSTANT_FORCE_SHARE = 0.014  # scatter of a constant force over body weight: 10 N at 75 kg; zero levels
CONSTANT_ARM_M = 0.02  # [m] scatter of a constant moment over body weight: 15 N·m, trunk's centre of mass
NOTABLE_GAIN = 0.03  # from which on a learnt gain is noted: a plate's, say
NOTABLE_LAG_S = 0.003  # [s] from which on a lag is noted: a late clock, say

SMOOTHED_S = 0.3  # [s] over it the pelvis's turning to and fro within a stride is averaged out

CONSTANTS = "constants"

GAINS = "gains"
FORCES = "forward force", "vertical force", "lateral force"

SWING_CUTOFF_HZ = 6.0  # a swing has no more; marker noise moves its farthest point
SHORTEST_CONTACT_S = 0.06  # shorter ones are blips
APART_S = 0.2  # a swing's farthest point and the contact that ends it; farther apart, they are of two
SCATTER_S = 0.06  # of that time between steps of a person; a contact farther off belongs to another plate

STEPS = "steps"
FEWEST_STEPS = 1  # whole ones, seen at both ends
MIRRORED = np.array([1.0, 1.0, -1.0, -1.0, -1.0, 1.0])  # lateral force, roll and turning moment change sign


@dataclass(frozen=True)
class Columns:
    """Of one kind and one trial: force [N] and moment about the ground origin [N·m] per parameter."""

    kind: str
    ground: Float[np.ndarray, "frames 6 n"]
    prior_std: Float[np.ndarray, " n"]


@dataclass(frozen=True)
class HeadingFrame:
    """x forward, y up, z to the right of the person, frame by frame."""

    origin_ground: Float[np.ndarray, "frames 3"]  # [m]
    R_ground_heading: Float[np.ndarray, "frames 3 3"]

    def between(self, start: int, end: int) -> "HeadingFrame":
        """Frames `start` to `end` (excluded) alone."""
        return HeadingFrame(self.origin_ground[start:end], self.R_ground_heading[start:end])

    def to_ground(self, wrenches: Float[np.ndarray, "frames 6 n"]) -> Float[np.ndarray, "frames 6 n"]:
        """From force and moment here to force [N] and moment about the ground origin [N·m], ground frame."""
        force, moment = (self.R_ground_heading @ part for part in (wrenches[:, :3], wrenches[:, 3:]))
        lever = np.cross(self.origin_ground[:, :, None], force, axis=1)
        return np.concatenate([force, moment + lever], axis=1)

    def from_ground(self, wrench_ground: Float[np.ndarray, "frames 6"]) -> Float[np.ndarray, "frames 6"]:
        """The other way round, of one wrench a frame."""
        about = about_point(wrench_ground, self.origin_ground).reshape(-1, 2, 3)
        return (about @ self.R_ground_heading).reshape(-1, 6)

    def points(self, points_ground: Float[np.ndarray, "frames 3"]) -> Float[np.ndarray, "frames 3"]:
        """Points seen from here [m]."""
        return ((points_ground - self.origin_ground)[:, None] @ self.R_ground_heading)[:, 0]


def heading_frame(skeleton: Skeleton, motion: Motion) -> HeadingFrame:
    """Of a motion; forward is the root body's x axis, as OpenSim's pelvis has it, smoothed over a stride.

    Args:
        skeleton: of the motion.
        motion: of the markers alone; no force has a say in it.
    """
    root, kinematics = root_joint(skeleton), ForwardKinematics(skeleton)

    def forward_and_centre(q: Float[np.ndarray, "some dofs"]) -> Float[np.ndarray, "some 6"]:
        poses = kinematics.poses(q)
        return np.hstack([poses.R_ground_body[:, root.body, :, 0], root_centre(root, poses)])

    forward, centre = np.split(by_frames(forward_and_centre, motion.q), 2, axis=1)
    forward[:, 1] = 0.0
    forward = gaussian_filter1d(forward, SMOOTHED_S * motion.rate, axis=0, mode="nearest")
    length = np.linalg.norm(forward, axis=1, keepdims=True)
    forward = np.where(length > 1e-6, forward / np.maximum(length, 1e-6), (1.0, 0.0, 0.0))
    up = np.broadcast_to([0.0, 1.0, 0.0], forward.shape)
    R_ground_heading = np.stack([forward, up, cross(forward, up)], axis=2)
    return HeadingFrame(centre, R_ground_heading)


def constant_columns(frame: HeadingFrame, weight_N: float) -> Columns:
    """Six: one an axis of the heading frame.

    Args:
        frame: of the trial.
        weight_N: of the person.
    """
    units = np.broadcast_to(np.eye(6), (len(frame.origin_ground), 6, 6))
    share = CONSTANT_FORCE_SHARE, CONSTANT_ARM_M
    return Columns(CONSTANTS, frame.to_ground(units), weight_N * np.repeat(share, 3))


def smooth_demand(skeleton: Skeleton, motion: Motion, frame: HeadingFrame) -> Float[np.ndarray, "frames 6"]:
    """W, in the heading frame about its origin [N, N·m].

    Args:
        skeleton: with the person's mass.
        motion: of the markers alone.
        frame: of that motion.
    """
    smooth = motion.low_passed(DEMAND_CUTOFF_HZ, ORDER)
    return frame.from_ground(required_ground(skeleton, smooth))


def gain_columns(
    demand: Float[np.ndarray, "frames 6"], rate: float, frame: HeadingFrame, settings: PredictionSettings
) -> Columns:
    """Eighteen: gain, lag and damping of each axis, one axis after the other.

    Args:
        demand: W.
        rate: [Hz].
        frame: that it is told in.
        settings: scatter of the gains.
    """
    first = np.gradient(demand, 1 / rate, axis=0)
    second = np.gradient(first, 1 / rate, axis=0)
    of_axes = np.stack([demand, first, second], axis=2)  # frames, axes, three
    columns = (np.eye(6)[None, :, :, None] * of_axes[:, None]).reshape(len(demand), 6, 18)
    std = np.tile([settings.gain_std, settings.lag_std_s, DAMPING_STD_S2], 6)
    return Columns(GAINS, frame.to_ground(columns), std)


def gain_notes(x: Float[np.ndarray, "18"], std: Float[np.ndarray, "18"]) -> tuple[Note, ...]:
    """What the gains may point to; only of what is beyond its own uncertainty.

    Args:
        x: learnt.
        std: of x.
    """
    parts = []
    for axis, (gain, lag, _), (gain_std, lag_std, _) in zip(
        FORCES, x.reshape(6, 3)[:3], std.reshape(6, 3)[:3], strict=True
    ):
        if abs(gain) > max(NOTABLE_GAIN, 2 * gain_std):
            parts.append(f"{axis} {-100 * gain:+.0f} ± {200 * gain_std:.0f} %")
        if abs(lag) > max(NOTABLE_LAG_S, 2 * lag_std):
            late = "late" if lag > 0 else "early"
            parts.append(f"{axis} {1000 * abs(lag):.0f} ± {2000 * lag_std:.0f} ms {late}")
    if not parts:
        return ()
    return noted(
        Kind.FORCES_AGAINST_BODY,
        f"compared with the forces that the markers' motion requires, plates read {', '.join(parts)}: "
        "bodies without markers, wrong masses or soft tissue in the model, a time shift, or a plate's gain?",
    )


@dataclass(frozen=True)
class Footfalls:
    """In the order of time."""

    frames: Float[np.ndarray, " steps"]  # between two frames, where no plate tells
    feet: Int[np.ndarray, " steps"]  # in the order of the contacts' feet


def footfalls(
    skeleton: Skeleton,
    motion: Motion,
    frame: HeadingFrame,
    *,
    feet: tuple[str, ...],
    in_contact: Bool[np.ndarray, "frames feet"],
    known: Bool[np.ndarray, " frames"],
) -> Footfalls:
    """Of one trial.

    Args:
        skeleton: of the motion.
        motion: of the markers alone.
        frame: of that motion.
        feet: bodies.
        in_contact: by the plates.
        known: frames on which plates may be looked at; on the others `in_contact` is not.
    """
    kinematics, bodies = ForwardKinematics(skeleton), [skeleton.body_index(name) for name in feet]
    places = by_frames(lambda q: kinematics.poses(q).p_ground_body[:, bodies], motion.q)
    swung, onsets = [], []
    for k in range(len(feet)):
        ahead = frame.points(places[:, k])[:, 0]
        ahead = low_pass(ahead, motion.rate, SWING_CUTOFF_HZ)
        swung.append(find_peaks(ahead, prominence=SHORTEST_STRIDE_M)[0])
        onsets.append(_onsets(in_contact[:, k], known, motion.rate))
    late = [_nearest(o, s) for s, o in zip(swung, onsets, strict=True)]
    matched = np.concatenate([x[np.abs(x) <= APART_S * motion.rate] for x in late])
    usual = float(np.median(matched)) if len(matched) else 0.0
    times = [
        s + np.where(np.abs(x - usual) <= SCATTER_S * motion.rate, x, usual)
        for s, x in zip(swung, late, strict=True)
    ]
    all_times = np.concatenate(times)
    all_feet = np.repeat(np.arange(len(feet)), [len(t) for t in times])
    order = np.argsort(all_times, kind="stable")
    return Footfalls(all_times[order], all_feet[order])


def _onsets(
    contact: Bool[np.ndarray, " frames"], known: Bool[np.ndarray, " frames"], rate: float
) -> Int[np.ndarray, " some"]:
    """Frames on which a plate is first loaded, seen to be unloaded the frame before."""
    seen = [
        start
        for start, end in runs(contact & known)
        if start > 0 and known[start - 1] and end - start >= SHORTEST_CONTACT_S * rate
    ]
    return np.array(seen, dtype=int)


def _nearest(
    onsets: Int[np.ndarray, " some"], swung: Int[np.ndarray, " steps"]
) -> Float[np.ndarray, " steps"]:
    """How much later the nearest onset is [frames]; infinite where there is none."""
    if not len(onsets):
        return np.full(len(swung), np.inf)
    differences = onsets[None, :] - swung[:, None]
    nearest = np.abs(differences).argmin(axis=1)
    return differences[np.arange(len(swung)), nearest].astype(float)


@dataclass(frozen=True)
class StepPhases:
    """Where in a step each frame is."""

    phase: Float[np.ndarray, " frames"]  # 0 to 1; NaN where nobody steps
    mirrored: Bool[np.ndarray, " frames"]  # the step began with the second foot

    def between(self, start: int, end: int) -> "StepPhases":
        """Frames `start` to `end` (excluded) alone."""
        return StepPhases(self.phase[start:end], self.mirrored[start:end])


def step_phases(falls: Footfalls, frames: int) -> StepPhases | None:
    """Phases of two-legged steps; None where fewer than two whole steps are seen.

    A step lasts from one foot's fall to the other's. Before the first and after the last fall one usual step
    is assumed. Where a foot falls twice in a row, or a step takes much longer or shorter than the usual one,
    nobody steps.

    Args:
        falls: of the trial.
        frames: of the trial.
    """
    times, feet = falls.frames, falls.feet
    lasts, turns = np.diff(times), np.diff(feet) != 0
    if turns.sum() < FEWEST_STEPS:
        return None
    usual = float(np.median(lasts[turns]))
    times = np.concatenate([[times[0] - usual], times, [times[-1] + usual]])
    feet = np.concatenate([[1 - feet[0]], feet])
    lasts = np.diff(times)
    turns = np.concatenate([[True], turns, [True]])
    sound = turns & (lasts < STEP_CHANGE * usual) & (lasts > usual / STEP_CHANGE)
    if sound[1:-1].sum() < FEWEST_STEPS:
        return None
    t = np.arange(frames)
    step = np.searchsorted(times, t, side="right") - 1
    inside = (step >= 0) & (step < len(lasts))
    step = step.clip(0, len(lasts) - 1)
    stepping = inside & sound[step]
    phase = np.where(stepping, (t - times[step]) / lasts[step], np.nan)
    return StepPhases(phase, stepping & (feet[step] == 1))


def periodic_splines(phase: Float[np.ndarray, " frames"], knots: int) -> Float[np.ndarray, "frames knots"]:
    """Cubic B-splines over 0 to 1 that meet themselves at the ends; zero where the phase is NaN."""
    bump = BSpline.basis_element(np.arange(-2.0, 3.0), extrapolate=False)
    distance = np.nan_to_num(phase, nan=0.0)[:, None] * knots - np.arange(knots)
    distance = (distance + knots / 2) % knots - knots / 2
    return np.where(np.isnan(phase)[:, None], 0.0, np.nan_to_num(bump(distance)))


def step_columns(phases: StepPhases | None, frame: HeadingFrame, peak_N: float) -> Columns:
    """Six curves, one axis after the other; zero for a trial without steps.

    Args:
        phases: of the trial.
        frame: of the trial.
        peak_N: of the force that the person's motions demand.
    """
    frames, knots = len(frame.origin_ground), PHASE_KNOTS
    std = peak_N * np.repeat([PHASE_FORCE_SHARE, PHASE_ARM_M], 3 * knots)
    if phases is None:
        return Columns(STEPS, np.zeros((frames, 6, 6 * knots)), std)
    sign = np.where(phases.mirrored[:, None], MIRRORED, 1.0)
    splines = periodic_splines(phases.phase, knots)
    curves = np.eye(6)[None, :, :, None] * sign[:, :, None, None] * splines[:, None, None, :]
    return Columns(STEPS, frame.to_ground(curves.reshape(frames, 6, 6 * knots)), std)
