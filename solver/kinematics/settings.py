"""Thresholds and weights of scaling and inverse kinematics, each with its reason."""

from dataclasses import dataclass

from solver.common.settings_field import setting

# [frames] soft tissue repeats with the movement: 60 poses of it tell as much as five independent ones;
# counted in full they pull the pelvis 4 cm out of its own markers
EFFECTIVE_FRAMES = 5.0
CALIBRATION_ROBUST_SCALE_M = 0.04  # [m] tighter than in tracking: a bad marker must not bend the bones
CLUSTER_OFFSET_STD_M = 0.06  # [m] tracking markers are put anywhere on the segment


@dataclass(frozen=True)
class KinematicsSettings:
    """Scaling, marker offsets and inverse kinematics."""

    marker_std_m: float = setting(
        0.01, unit="m", why="expected marker error: soft tissue and placement, about 1 cm in walking"
    )
    robust_scale_m: float = setting(
        0.06, unit="m", why="beyond it a marker loses influence (Cauchy loss): a slipped or swapped one"
    )
    limit_std_rad: float = setting(
        0.09, unit="rad", why="5°: soft joint limits, since generic ranges are not the subject's"
    )
    pose_std_rad: float = setting(
        3.0, unit="rad", why="weak pull to the reference pose: decides only what no marker sees"
    )
    iterations: int = setting(
        60, unit="", why="ceiling of Levenberg-Marquardt; frames stop when they converge"
    )
    tolerance: float = setting(
        1.0e-4,
        unit="",
        why="relative decrease of the cost at which a frame has converged; a last step follows",
    )
    fewest_seen_share: float = setting(
        0.5,
        unit="",
        why="of the shared markers; frames that show fewer do not count in the figures. Likewise of the "
        "coordinates that a trial usually shows: with fewer, a frame has no pose",
    )
    calibration_frames: int = setting(
        60, unit="", why="poses that decide scales and offsets; more change < 0.1 mm"
    )
    keep_scaled_models: bool = setting(
        True,
        unit="",
        why="a model that was scaled and registered for this person keeps its scales and marker places; "
        "false scales every model",
    )
    scale_std: float = setting(0.1, unit="log", why="body size against the model when the height is unknown")
    height_scale_std: float = setting(0.03, unit="log", why="body size when the height is given")
