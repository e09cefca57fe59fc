"""Every cause that the diagnosis knows, at every target of a subject's trials."""

from collections.abc import Sequence
from types import ModuleType

from solver.effects import (
    axis_convention,
    belt_acceleration,
    body_weight_support,
    capture_scale,
    carried_mass,
    clock_offset,
    drag,
    elastic_tether,
    external_contact,
    filter_mismatch,
    gravity_tilt,
    off_plate_step,
    plate_bias,
    plate_gain,
    plate_position,
    plate_swap,
    plate_yaw,
    sample_rate,
    segment_mass,
    subject_mass,
    wobbling_mass,
)
from solver.effects.effect import Candidate
from solver.effects.scene import Scene

MODULES: dict[str, ModuleType] = {
    "clock_offset": clock_offset,
    "sample_rate": sample_rate,
    "filter_mismatch": filter_mismatch,
    "plate_gain": plate_gain,
    "plate_bias": plate_bias,
    "plate_position": plate_position,
    "plate_yaw": plate_yaw,
    "plate_swap": plate_swap,
    "axis_convention": axis_convention,
    "gravity_tilt": gravity_tilt,
    "off_plate_step": off_plate_step,
    "external_contact": external_contact,
    "body_weight_support": body_weight_support,
    "elastic_tether": elastic_tether,
    "drag": drag,
    "belt_acceleration": belt_acceleration,
    "carried_mass": carried_mass,
    "subject_mass": subject_mass,
    "segment_mass": segment_mass,
    "wobbling_mass": wobbling_mass,
    "capture_scale": capture_scale,
}
IDS = tuple(MODULES)
MARKER_IDS = ("marker_slip", "marker_swap", "soft_tissue")


def catalogue(scenes: Sequence[Scene]) -> list[Candidate]:
    """Candidates on the wrench balance; causes that markers show are found before (`MARKER_IDS`)."""
    found: list[Candidate] = []
    for module in MODULES.values():
        found += module.candidates(scenes)
    return found
