"""Thresholds and weights of scaling and inverse kinematics, each with its reason."""

import math
from dataclasses import dataclass

from solver.common.settings_field import setting


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
    smoothness_std: float = setting(
        1.0e4,
        unit="rad/s² or m/s²",
        why="bridges gaps; a hundred times above human accelerations, so no filter",
    )
    iterations: int = setting(
        60, unit="", why="ceiling of Levenberg-Marquardt; frames stop when they converge"
    )
    tolerance: float = setting(
        1.0e-4,
        unit="",
        why="relative decrease of the cost at which a frame has converged; a last step follows",
    )
    keyframe_spacing_s: float = setting(
        0.4, unit="s", why="frames solved from several start poses; the rest start between them"
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
    effective_frames: float = setting(
        5.0,
        unit="frames",
        why="soft tissue repeats with the movement: 60 poses of it tell as much as five independent ones; "
        "counted in full they pull the pelvis 4 cm out of its own markers",
    )
    effective_static_frames: float = setting(
        1.0, unit="frames", why="one quiet stance is one sample, without motion artefact"
    )
    calibration_robust_scale_m: float = setting(
        0.04, unit="m", why="tighter than in tracking: a bad marker must not bend the bones"
    )
    bony_offset_std_m: float = setting(
        0.012, unit="m", why="palpation repeats within 5-10 mm, the skin adds some (Della Croce 2005)"
    )
    other_offset_std_m: float = setting(
        0.02, unit="m", why="markers that are neither bony landmarks nor clusters"
    )
    cluster_offset_std_m: float = setting(
        0.06, unit="m", why="tracking markers are put anywhere on the segment"
    )
    keep_scaled_models: bool = setting(
        True,
        unit="",
        why="a model that was scaled and registered for this person keeps its scales and marker places; "
        "false scales every model",
    )
    registered_m: float = setting(
        0.012,
        unit="m",
        why="median distance of a model's markers from their places, the model as it is, in the mean over "
        "frames: 0 to 0.7 cm with six persons' own models, 1.9 to 5 cm with ten generic ones or others' own",
    )
    registered_odds: float = setting(
        6.0,
        unit="nats",
        least=0.0,
        why="for each factor of e nearer or farther: half or twice that distance is clear",
    )
    same_mass_odds: float = setting(
        1.0,
        unit="nats",
        least=0.0,
        why="for a model that weighs what was entered: programs scale the mass as well",
    )
    model_name_odds: float = setting(
        1.0, unit="nats", least=0.0, why="for a name with 'scaled' or 'generic': files are copied and renamed"
    )
    registered_offset_std_m: float = setting(
        0.002,
        unit="m",
        why="of a kept model's markers: what the recording tells of places that a laboratory registered is "
        "mostly skin",
    )
    refuted_m: float = setting(
        0.04,
        unit="m",
        why="a kept model's marker that is so far off on every frame was put on elsewhere; where fewer than "
        "two stay on its segment it takes twice as much",
    )
    least_walking_tilt_deg: float = setting(
        -25.0,
        unit="°",
        least=-math.inf,
        why="mean pelvis tilt of a walk, negative forwards: experts' fits have −2° to 5°, and models differ "
        "in how their pelvis stands; a chosen margin about these, from no published range",
    )
    most_walking_tilt_deg: float = setting(
        12.0, unit="°", least=-math.inf, why="likewise backwards: by as much again as experts' fits vary"
    )
    least_walking_lumbar_deg: float = setting(
        -28.0,
        unit="°",
        least=-math.inf,
        why="mean lumbar extension of a walk, negative bent forwards: experts' fits have −19° to −3°",
    )
    most_walking_lumbar_deg: float = setting(15.0, unit="°", least=-math.inf, why="likewise bent backwards")
    scale_std: float = setting(0.1, unit="log", why="body size against the model when the height is unknown")
    height_scale_std: float = setting(0.03, unit="log", why="body size when the height is given")
    segment_scale_std: float = setting(
        0.06, unit="log", why="segment lengths against body size (Drillis 1964)"
    )
    aspect_scale_std: float = setting(0.05, unit="log", why="width and depth of a segment against its length")
    hip_width_std_m: float = setting(
        0.018,
        unit="m",
        why="of the distance that regressions expect between the hips: 7 mm a side, both sides of a pelvis "
        "alike (Mantovani 2016), and 11 mm because each spine is palpated within 12 mm",
    )
    spines_pitch_std_rad: float = setting(
        0.017,
        unit="rad",
        why="1°: how the spines' markers are pitched in the default body's pelvis is decided beforehand, "
        "between bone and posture; free once more, they turn by 9° to suit a trunk that is not the model's",
    )
    hips_on_pelvis_std: float = setting(
        0.08,
        unit="log",
        why="the same against the pelvis' own width, where no spines are seen that a regression could go by",
    )
