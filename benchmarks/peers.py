"""What other tools reach on the same recordings, as measured with them beforehand."""

from dataclasses import dataclass


@dataclass(frozen=True)
class PeerFigures:
    """The AddBiomechanics engine, end to end: kinematics stage, then dynamics stage."""

    marker_rms_frame_mean_cm: str
    cpu_seconds: str
    linear_residual_N: str  # mean norm, kinematics → dynamics
    angular_residual_Nm: str


# Engine state of 2025-06 on nimblephysics 0.10.52.1, default settings; keyed by (subject folder, trial).
ENGINE = {
    ("walk_rajagopal2015", "walk"): PeerFigures("1.57 → 1.47", "1540 + 155", "44.5 → 2.9", "26.7 → 11.4"),
    ("opencap_reviewed", "DJ1"): PeerFigures(
        "1.19 → 1.13; 1.49 → 1.49",
        "700 + 206 with another trial",
        "137 → 7.0; 118 → 31.5",
        "18.9 → 9.6; 44.5 → 37.7",
    ),
    ("overground_camargo2021_AB06", "levelground_ccw_fast_01_01"): PeerFigures(
        "3.48", "no dynamics", "no dynamics", "no dynamics"
    ),
}
