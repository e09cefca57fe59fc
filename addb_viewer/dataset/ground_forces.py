"""Forces on the release's grid: the feet's wrenches, which of them count, why not, who looked."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, UInt8

from addb_viewer.dataset.grid import Grid
from solver.capture.capture import Capture
from solver.capture.formats.b3d.b3d_fields import REASONS
from solver.capture.plates.centre_of_pressure import Surface, centre_of_pressure, surface_of
from solver.capture.plates.conditioning import condition
from solver.contact.assignment import lies_there
from solver.contact.detected_ranges import UNMEASURED_EXTERNAL_FORCE, sure_ranges
from solver.contact.mask import ERRONEOUS, frame_mask
from solver.contact.wrenches import DETECTION, FILE, NO_FOOT, PERSON, ContactWrenches, FrameMask
from solver.export.b3d.from_fit import decisive_reasons, reasons_per_frame
from solver.fitting.fit_result import TrialFit
from solver.fitting.settings import Settings

UNGIVEN_N = 5.0  # [N] of a filtered load that no foot was given; more means another contact body
RINGING_N = 1e-3  # a force of the conditioned wrench below it is the tail of the filter: no plate resolves it


@dataclass(frozen=True)
class Surfaces:
    """What each foot presses on, frame by frame."""

    point_ground: Float[np.ndarray, "frames feet 3"]  # [m]
    normal_ground: Float[np.ndarray, "frames feet 3"]  # unit, upwards


def contacts_on_grid(contacts: ContactWrenches, grid: Grid) -> ContactWrenches:
    """Wrenches by cubic splines, exactly zero between two zeros; the rest as the neighbouring frames have it.

    Centres of pressure are left NaN where they were not: `with_pressure_points` finds them anew.

    Args:
        contacts: at the recording's frames.
        grid: of the release.
    """
    if grid.is_native:
        return replace(contacts, wrench_ground=_without_ringing(contacts.wrench_ground))
    return replace(
        contacts,
        wrench_ground=_without_ringing(_splined(contacts.wrench_ground, grid)),
        wrench_raw_ground=_splined(contacts.wrench_raw_ground, grid),
        cop_ground=np.full((grid.frames, len(contacts.foot_bodies), 3), np.nan),
        observed=grid.at_both(contacts.observed),
        in_contact=grid.at_nearest(contacts.in_contact),
        plate=grid.at_nearest(contacts.plate),
        unassigned=None if contacts.unassigned is None else grid.at_either(contacts.unassigned),
    )


def _splined(native: Float[np.ndarray, "native feet 6"], grid: Grid) -> Float[np.ndarray, "frames feet 6"]:
    is_zero = grid.at_both((native == 0.0).all(axis=2))
    return np.where(is_zero[:, :, None], 0.0, grid.interpolated(native))


def _without_ringing(wrench_ground: Float[np.ndarray, "frames feet 6"]) -> Float[np.ndarray, "frames feet 6"]:
    """Exactly zero where the low-pass filter alone leaves something, far from any contact."""
    silent = np.linalg.norm(wrench_ground[..., :3], axis=2) < RINGING_N
    return np.where(silent[..., None], 0.0, wrench_ground)


def surfaces_under(contacts: ContactWrenches, capture: Capture, settings: Settings) -> Surfaces:
    """The surface of the plate that a foot's force comes from; of several the first; level ground of none.

    Args:
        contacts: at any frames.
        capture: its plates.
        settings: of the fit.
    """
    frames, feet = contacts.wrench_ground.shape[:2]
    point, normal = np.zeros((2, frames, feet, 3))
    normal[..., 1] = 1.0
    for k in range(contacts.plate.shape[1] - 1, -1, -1):
        surface = surface_of(capture.plates[k])
        for foot in range(feet):
            own = contacts.plate[:, k] == foot
            point[own, foot], normal[own, foot] = surface.point_ground, surface.normal_ground
    return Surfaces(point, normal)


def with_pressure_points(
    contacts: ContactWrenches, surfaces: Surfaces, threshold_N: float
) -> ContactWrenches:
    """Centres of pressure of the wrenches [m]; NaN where less than the threshold presses on the surface.

    Args:
        contacts: on the grid.
        surfaces: at the same frames.
        threshold_N: of the force along the surface's normal.
    """
    cop = np.full(contacts.cop_ground.shape, np.nan)
    force, moment = contacts.wrench_ground[..., :3], contacts.wrench_ground[..., 3:]
    planes = np.concatenate([surfaces.point_ground, surfaces.normal_ground], axis=2)
    loaded = pressing(contacts, surfaces) >= threshold_N
    for plane in np.unique(planes[loaded], axis=0):
        here = loaded & (planes == plane).all(axis=2)
        cop[here] = centre_of_pressure(force[here], moment[here], Surface(plane[:3], plane[3:]))
    return replace(contacts, cop_ground=cop)


def pressing(contacts: ContactWrenches, surfaces: Surfaces) -> Float[np.ndarray, "frames feet"]:
    """Force of each foot along the normal of what it presses on [N]."""
    return np.einsum("tfi,tfi->tf", contacts.wrench_ground[..., :3], surfaces.normal_ground)


def free_moments(contacts: ContactWrenches, surfaces: Surfaces) -> Float[np.ndarray, "frames feet"]:
    """Moment about the surface's normal at the centre of pressure [N·m]; NaN where there is none."""
    lever = np.cross(contacts.cop_ground, contacts.wrench_ground[..., :3])
    return np.einsum("tfi,tfi->tf", contacts.wrench_ground[..., 3:] - lever, surfaces.normal_ground)


def mask_on_grid(mask: FrameMask, grid: Grid) -> FrameMask:
    """A foot's force counts where it does on both neighbouring frames; ranges move to the nearest frames."""
    if grid.is_native:
        return mask
    moved = [
        ((*grid.frames_nearest_to(start, end), foot, reason), k)
        for k, (start, end, foot, reason) in enumerate(mask.reasons)
    ]
    kept = [(reason, k) for reason, k in moved if reason[0] < reason[1]]
    return replace(
        mask,
        counts=grid.at_both(mask.counts),
        reasons=tuple(reason for reason, _ in kept),
        decided_by=None if mask.decided_by is None else grid.at_nearest(mask.decided_by),
        sources=tuple(mask.sources[k] for _, k in kept) if mask.sources else (),
    )


def given_to_no_foot(
    contacts: ContactWrenches, capture: Capture, settings: Settings
) -> Bool[np.ndarray, " frames"]:
    """Frames on which a plate carries more than 5 N that are no foot's: somebody touches what is none.

    Args:
        contacts: at the recording's frames.
        capture: the recording.
        settings: of the fit.
    """
    strange = np.zeros(contacts.frames, dtype=bool)
    for k, plate in enumerate(capture.plates):
        nobody = contacts.plate[:, k] == NO_FOOT
        if not nobody.any():
            continue
        carried = condition(plate, capture.markers.times, settings.conditioning)
        force = np.linalg.norm(np.nan_to_num(carried.force_ground), axis=1)
        if not lies_there(carried):
            strange |= nobody & (force > UNGIVEN_N)
    return strange


@dataclass(frozen=True)
class Verdicts:
    """Of each frame."""

    counts: Bool[np.ndarray, " frames"]  # every foot's force was measured and is right
    counts_by_foot: Bool[np.ndarray, "frames feet"]
    detected_ok: Bool[np.ndarray, " frames"]  # by detection alone, whoever reviewed
    reviewed: Bool[np.ndarray, " frames"]
    erroneous: Bool[np.ndarray, " frames"]  # nobody is seen, or a person said that they must not be used
    missing_reason: Sequence[str | None]
    missing_number: UInt8[np.ndarray, " frames"]


def verdicts_on(
    trial: TrialFit,
    mask: FrameMask,
    contacts: ContactWrenches,
    grid: Grid,
    *,
    settings: Settings,
    strange: Bool[np.ndarray, " native"],
    finished: bool,
) -> Verdicts:
    """A frame counts if both its neighbours do; else it has the reason of the nearest one that does not.

    Args:
        trial: at the recording's frames.
        mask: on the grid.
        contacts: on the grid.
        grid: of the release.
        settings: of the fit.
        strange: frames of the recording with a load that is no foot's.
        finished: whether somebody has finished the trial's review: then every frame is reviewed but those
            that detection alone leaves out.
    """
    assert trial.mask is not None
    assert trial.contacts is not None
    known = trial.forces_known & ~strange
    counts = grid.at_both(known)
    numbers = reasons_per_frame(trial.mask, grid.native_frames)
    words = [reason[3] for reason in trial.mask.reasons] + [UNMEASURED_EXTERNAL_FORCE]
    place = np.where(numbers == 0, -1, decisive_reasons(trial.mask))
    numbers = np.where(numbers == 0, REASONS.index(UNMEASURED_EXTERNAL_FORCE), numbers)
    whose = _nearest_that_does_not(~known, grid)
    by_person = np.any(trial.mask.decided(PERSON, FILE), axis=1)
    if finished:
        by_person |= ~np.any(trial.mask.decided(DETECTION) & ~trial.mask.counts, axis=1)
    erroneous = ~trial.motion.posed
    for start, end, _, reason in trial.mask.reasons:
        erroneous[start:end] |= reason == ERRONEOUS
    return Verdicts(
        counts=counts,
        counts_by_foot=mask.counts & contacts.observed[:, None],
        detected_ok=grid.at_both(_by_detection(trial, settings)),
        reviewed=grid.at_nearest(by_person),
        erroneous=grid.at_either(erroneous),
        missing_reason=[None if fine else words[place[k]] for fine, k in zip(counts, whose, strict=True)],
        missing_number=np.where(counts, 0, numbers[whose]).astype(np.uint8),
    )


def _nearest_that_does_not(missing: Bool[np.ndarray, " native"], grid: Grid) -> np.ndarray:
    """The native frame whose reason a grid frame has: the nearest, unless only the other one is missing."""
    other = grid.before + grid.after - grid.nearest
    return np.where(missing[grid.nearest], grid.nearest, other)


def _by_detection(trial: TrialFit, settings: Settings) -> Bool[np.ndarray, " native"]:
    """Frames that detection and the recording itself leave in, as if nobody had reviewed."""
    assert trial.contacts is not None
    alone = trial.kinematics_only
    errors = alone.marker_errors if alone else trial.marker_errors
    mask = frame_mask(
        trial.contacts,
        errors.seen_share >= settings.kinematics.fewest_seen_share,
        proposed=sure_ranges(trial.proposals, settings.detection.confidence),
        outside=trial.capture.outside_ranges,
    )
    return trial.contacts.observed & mask.all_feet
