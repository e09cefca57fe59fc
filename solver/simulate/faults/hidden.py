"""What was hidden: one effect with its target, parameters and frames, in the catalogue's own words."""

from dataclasses import asdict, dataclass, field
from typing import Any

REFERENCE_SIZE = {
    "clock_offset": 0.008,  # [s]
    "sample_rate": 0.01,
    "filter_mismatch": 6.0,  # [Hz]; smaller is worse
    "plate_gain": 0.04,
    "plate_bias": 15.0,  # [N]
    "plate_position": 0.012,  # [m]
    "plate_yaw": 3.0,  # [deg]
    "gravity_tilt": 1.5,  # [deg]
    "belt_slope": 5.0,  # [deg]
    "carried_mass": 3.0,  # [kg]
    "subject_mass": 0.04,
    "segment_mass": 0.15,
    "external_contact": 40.0,  # [N]
    "body_weight_support": 80.0,  # [N]
    "elastic_tether": 30.0,  # [N] mean
    "drag": 20.0,  # [N] mean
    "belt_acceleration": 0.3,  # [m/s²] RMS
    "wobbling_mass": 4.0,  # [kg]
    "marker_slip": 0.015,  # [m]
    "marker_swap": 0.05,  # [m] between the markers
    "capture_scale": 0.01,
    "soft_tissue": 0.010,  # [m] RMS
    "off_plate_step": 1.0,
    "plate_swap": 1.0,
    "axis_convention": 1.0,
}
UNSIZED = ("marker_swap", "off_plate_step", "plate_swap", "axis_convention")


@dataclass(frozen=True)
class Hidden:
    """One hidden effect.

    `same_as` lists targets that say the same thing (a plate and the foot that it bears). `bodies` is where an
    effect outside the catalogue acts; empty when its place cannot be told from outside (a pure torque).
    """

    id: str
    target: str
    parameters: dict[str, float]
    size: float = 1.0  # in reference sizes
    trial: str | None = None
    frames: tuple[tuple[int, int], ...] = ()
    same_as: tuple[str, ...] = ()
    bodies: tuple[str, ...] = ()
    note: str = ""

    def as_json(self) -> dict[str, Any]:
        """For truth.json."""
        return asdict(self)


@dataclass(frozen=True)
class Truth:
    """What a case holds; kept outside the folder that the finder sees."""

    case: str
    kind: str  # clean, single, pair or unknown
    effects: tuple[Hidden, ...]
    world: dict[str, Any] = field(default_factory=dict)
    baseline: str | None = None  # the folder of the same recording without the effect

    def as_json(self) -> dict[str, Any]:
        """For truth.json."""
        return asdict(self)
