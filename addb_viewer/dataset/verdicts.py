"""What is said of each frame on the release's grid: whether its forces count, why not, and who looked."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, UInt8

from addb_viewer.dataset.grid import Grid
from solver.capture.formats.b3d.reasons import REASONS
from solver.contact.mask import ERRONEOUS, frame_mask
from solver.contact.proposals import UNMEASURED_EXTERNAL_FORCE, sure_ranges
from solver.contact.wrenches import DETECTION, FILE, PERSON, ContactWrenches, FrameMask
from solver.export.b3d.reasons import decisive_reasons, reasons_per_frame
from solver.fitting.fit import TrialFit
from solver.fitting.settings import Settings


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
