"""Every cause that the diagnosis knows, at every target of a subject's trials."""

from collections.abc import Sequence
from types import ModuleType

from solver.diagnosis.causes import (
    axis_convention,
    belt_acceleration,
    belt_slope,
    body_weight_support,
    capture_scale,
    carried_mass,
    clock_offset,
    drag,
    elastic_tether,
    external_contact,
    filter_mismatch,
    gravity_tilt,
    marker_slip,
    marker_swap,
    object_on_plate,
    off_plate_step,
    plate_bias,
    plate_clock,
    plate_exchange,
    plate_gain,
    plate_mirror,
    plate_position,
    plate_swap,
    plate_turn,
    plate_units,
    plate_yaw,
    sample_rate,
    segment_displaced,
    segment_mass,
    soft_tissue,
    subject_mass,
    trial_clocks,
    wobbling_mass,
    zero_level,
)
from solver.diagnosis.causes.about import About, CorrectedBy
from solver.diagnosis.causes.effect import NO_PATHS, Candidate, Paths
from solver.diagnosis.causes.scene import Scene

MODULES: tuple[ModuleType, ...] = (
    clock_offset,
    trial_clocks,
    plate_clock,
    sample_rate,
    filter_mismatch,
    plate_gain,
    plate_bias,
    zero_level,
    plate_position,
    plate_yaw,
    plate_turn,
    plate_mirror,
    plate_units,
    plate_swap,
    plate_exchange,
    axis_convention,
    gravity_tilt,
    belt_slope,
    object_on_plate,
    off_plate_step,
    external_contact,
    body_weight_support,
    elastic_tether,
    drag,
    belt_acceleration,
    carried_mass,
    subject_mass,
    segment_mass,
    wobbling_mass,
    capture_scale,
)
MARKER_MODULES: tuple[ModuleType, ...] = (marker_slip, marker_swap, segment_displaced, soft_tissue)
ABOUT: dict[str, About] = {module.ABOUT.id: module.ABOUT for module in (*MODULES, *MARKER_MODULES)}
IDS = tuple(id for id, about in ABOUT.items() if not about.in_markers)
MARKER_IDS = tuple(id for id, about in ABOUT.items() if about.in_markers)


def catalogue(scenes: Sequence[Scene], paths: Paths = NO_PATHS) -> list[Candidate]:
    """Candidates on the wrench balance; causes that markers show are found before (`MARKER_IDS`).

    Args:
        scenes: of the subject's trials.
        paths: what each plate's path of pressure says of its turns.
    """
    return [cause.with_evidence(paths) for module in MODULES for cause in module.candidates(scenes)]


def cannot_be_accepted(id: str) -> bool:
    """Whether a cause lies in the markers and no fit can correct it."""
    return id in ABOUT and ABOUT[id].corrected_by in (CorrectedBy.FILES, CorrectedBy.NOTHING)
