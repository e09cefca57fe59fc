"""Weights of the trajectory fit, each with its reason."""

from dataclasses import dataclass

from solver.settings_field import setting


@dataclass(frozen=True)
class TrajectorySettings:
    """One trajectory through all frames that follows the markers and obeys F = ma where forces count."""

    enabled: bool = setting(True, unit="", why="false leaves the motion to the markers alone")
    fewest_frames: int = setting(
        20, unit="frames", why="with known forces, for a trial to take part; fewer say nothing about F = ma"
    )
    heldout: bool = setting(
        True, unit="", why="residuals on withheld blocks as well; doubles the time of the fit"
    )
    heldout_block_s: float = setting(
        0.22,
        unit="s",
        why="long enough that the neighbours' forces do not tell: a third of a stance in walking",
    )
    heldout_every: int = setting(
        3, unit="blocks", why="one in three is withheld, the others hold the inertias"
    )
    knot_spacing_s: float = setting(
        0.02, unit="s", why="a quintic spline with it differs from the referee's derivatives by less than 1 N"
    )
    marker_std_m: float = setting(0.01, unit="m", why="expected marker error: soft tissue and placement")
    marker_robust_scale_m: float = setting(
        0.06, unit="m", why="beyond it a marker loses influence (Cauchy loss), as in the kinematics"
    )
    marker_drift_std_m_s: float = setting(
        0.1,
        unit="m/s",
        why="marker errors are not white: they change by 1 mm from frame to frame at 100 Hz; without it the "
        "trajectory snaps back to the markers wherever force is missing",
    )
    residual_force_std_N: float = setting(
        4.0,
        unit="N",
        why="of filtered plates; in two walks, a run and a jump 4 foretells withheld forces as well as 5 "
        "(within 2 %) at the same marker error, and leaves a fifth less where they are known",
    )
    residual_moment_std_Nm: float = setting(
        5.0, unit="N·m", why="of filtered plates: under a centimetre at body weight"
    )
    residual_robust_scale: float = setting(
        25.0,
        unit="",
        why="in standard deviations, 100 N or 125 N·m: beyond it a frame loses influence (Cauchy loss)",
    )
    gain_std: float = setting(
        0.03, unit="", why="plates of one laboratory disagree by 1 to 5 % between trials and activities"
    )
    notable_mass: float = setting(
        0.03, unit="", why="from which on a moved body mass is noted: three deviations of a scale's reading"
    )
    notable_gain: float = setting(0.02, unit="", why="from which on a trial's disagreement is noted")
    smoothness: float = setting(
        500.0,
        unit="1/s",
        why="of ∫(jerk/level)² dt; 300 to 1000 predict withheld steps best in four walks, a run and a jump, "
        "and cost the markers less than 0.5 mm",
    )
    jerk_cutoff_Hz: float = setting(
        8.0, unit="Hz", why="a dof's own jerk level is taken below it: above, marker noise dominates"
    )
    least_jerk_share: float = setting(
        0.05, unit="", why="of the mean level, for dofs that hardly move: they may still have to"
    )
    pose_std_rad: float = setting(
        0.3, unit="rad", why="pull to the marker fit: dofs that markers barely see would absorb the residual"
    )
    untold_std_rad: float = setting(
        0.07,
        unit="rad",
        why="4°: likewise for dofs that move no marker, which are neutral there. A trunk without "
        "markers else bends by 20 to 40° in place of what forces, clocks and masses have wrong",
    )
    iterations: int = setting(12, unit="", why="ceiling of Gauss-Newton; three or four suffice as a rule")
    tolerance: float = setting(
        1.0e-3, unit="", why="relative decrease of the cost at which the fit has converged"
    )
    fit_inertias: bool = setting(True, unit="", why="the moment is limited by segments' masses and centres")
    inertia_prior_weight: float = setting(
        1.0,
        unit="",
        why="of the scatter below; ten times as much predicts withheld moments worse in four walks of four",
    )
    inertia_lesson_s: float = setting(
        5.0,
        unit="s",
        why="of known forces teach what they can; beyond, the weight grows with time, as errors of the model "
        "repeat in every stride: 100 s of walking would else make shanks' inertias 2.3 times what they are",
    )
    mass_std: float = setting(
        0.03, unit="", why="relative scatter of segment masses in anthropometric tables"
    )
    com_std_m: float = setting(0.005, unit="m", why="scatter of segments' centres of mass")
    inertia_std: float = setting(0.05, unit="", why="relative scatter of segments' moments of inertia")
    body_mass_std: float = setting(0.01, unit="", why="relative: a scale's reading, clothes and shoes")
    lightest_segment_kg: float = setting(
        0.3, unit="kg", why="lighter ones (patella, talus) keep their inertia: nothing tells it"
    )
