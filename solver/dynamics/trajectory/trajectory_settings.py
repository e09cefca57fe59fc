"""Weights of the trajectory fit, each with its reason."""

from dataclasses import dataclass

from solver.common.settings_field import setting
from solver.kinematics.settings import KinematicsSettings


@dataclass(frozen=True)
class TrajectorySettings:
    """One trajectory through all frames that follows the markers and obeys F = ma where forces count."""

    enabled: bool = setting(True, unit="", why="false leaves the motion to the markers alone")
    fewest_frames: int = setting(
        20, unit="frames", why="with known forces, for a trial to take part; fewer say nothing about F = ma"
    )
    held_out: bool = setting(True, unit="", why="residuals on held-out blocks and steps as well")
    held_out_block_s: float = setting(
        0.22,
        unit="s",
        why="long enough that the neighbours' forces do not tell: a third of a stance in walking",
    )
    held_out_every: int = setting(
        3, unit="blocks", why="one in three is held out, the others hold the inertias"
    )
    knot_spacing_s: float = setting(
        0.01,
        unit="s",
        why="impacts: with 0.02 simulated runs and sprints miss twice to three times as much of the torque, "
        "and a landing's residual alternates from knot to knot",
    )
    marker_robust_scale_m: float = setting(
        KinematicsSettings.robust_scale_m,
        unit="m",
        why="beyond it a marker loses influence (Cauchy loss), as in the kinematics",
    )
    least_marker_slow_m: float = setting(0.0001, unit="m", why="of the best cameras and exact models")
    least_marker_growth_m: float = setting(
        0.0002, unit="m/√s", why="of the best cameras: 0.02 mm from frame to frame at 100 Hz"
    )
    growth_factor: float = setting(
        1.0, unit="", why="of the fast level that the marker fit shows: the rest is shared, as follows"
    )
    shared_growth: float = setting(
        2.0,
        unit="",
        why="fast movement that a segment's markers have in common, over their own: soft tissue shakes as a "
        "whole, and a marker fit takes that for motion of the bone",
        least=0.0,
    )
    residual_force_std_N: float = setting(
        16.0,
        unit="N",
        why="what model and plates leave at a frame: 2 % of body weight. With 4 the motion is bent for what "
        "the model gets wrong; with 64 simulated torques err more",
    )
    residual_moment_std_Nm: float = setting(
        8.0, unit="N·m", why="likewise: a centimetre of the centre of pressure at body weight"
    )
    residual_robust_scale: float = setting(
        25.0,
        unit="",
        why="in standard deviations, 400 N or 200 N·m: beyond it a frame loses influence (Cauchy loss)",
    )
    smoothness: float = setting(
        16.0,
        unit="1/s",
        why="of ∫(jerk/level)² dt: a jerk of that level that is white below 8 Hz. Thirty times as much bends "
        "walks by 1°, though it hides the noise of held-out forces",
    )
    pose_std_rad: float = setting(
        0.3, unit="rad", why="pull to the marker fit: dofs that markers barely see would absorb the residual"
    )
    whole_frames: int = setting(
        7000,
        unit="frames",
        why="of all trials together, up to which they are one problem: 1.5 GB for a full body with forces "
        "missing. Beyond it, trials are worked out one by one and in windows",
    )
    inertia_frames: int = setting(
        3000,
        unit="frames",
        why="of longer subjects where inertias are found first, before all frames have their say; and from "
        "which terms are learnt that predict forces: half a minute, 0.5 GB",
    )
    stretch_frames: int = setting(
        1000, unit="frames", why="of these that follow each other: several strides, squats or jumps"
    )
    window_frames: int = setting(
        4000,
        unit="frames",
        why="of a longer subject's trial that are fitted at a time, at most: 0.5 GB, and a tenth of it twice",
    )
    overlap_frames: int = setting(
        400,
        unit="frames",
        why="that neighbouring windows share: joined in the middle, where a border is 2 s away at 100 Hz and "
        "changes nothing any more",
    )
    edit_reach_s: float = setting(
        0.7,
        unit="s",
        why="before and after frames whose flags were edited: farther away the motion stays as it is",
    )
    edits_last: float = setting(
        0.1,
        unit="",
        why="share of the known frames that edits may change before all frames are fitted anew: until then "
        "the inertias stay as they are",
    )
    edit_gain: float = setting(
        1.0e-3, unit="", why="likewise of what plates say of the body's mass and of their gains: 0.8 N of 800"
    )
    iterations: int = setting(12, unit="", why="ceiling of Gauss-Newton; three or four suffice as a rule")
    tolerance: float = setting(
        1.0e-3, unit="", why="relative decrease of the cost at which the fit has converged"
    )
    fit_inertias: bool = setting(True, unit="", why="the moment is limited by segments' masses and centres")
    inertia_prior_weight: float = setting(
        1.0,
        unit="",
        why="of the scatter below; ten times as much predicts held-out moments worse in four walks of four",
    )
    mass_std: float = setting(
        0.03, unit="", why="relative scatter of segment masses in anthropometric tables"
    )
    com_std_m: float = setting(0.005, unit="m", why="scatter of segments' centres of mass")
    inertia_std: float = setting(0.05, unit="", why="relative scatter of segments' moments of inertia")
    body_mass_std: float = setting(0.01, unit="", why="relative: a scale's reading, clothes and shoes")
