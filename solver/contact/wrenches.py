"""What the ground does to each foot, on the markers' clock, and on which frames that was measured."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.common.notes import Note

NO_FOOT = -1  # no foot is near the centre of pressure, or the plate is never loaded
TWO_FEET = -2  # two feet stand on the loaded plate, and one wrench cannot be divided between them

MissingRange = tuple[
    int, int, str | None, str
]  # start, end, foot or None for all, why its force doesn't count


@dataclass(frozen=True)
class ContactWrenches:
    """Wrench [force N, moment N·m about the ground origin] on each foot, ground frame, markers' frames.

    `observed` is False on frames that no force recording covers; wrenches are zero there. `plate` says
    for every frame which foot a plate's force goes to: its index, or NO_FOOT or TWO_FEET. While the plate is
    unloaded that is the foot of the nearest contact in time, to which the filter's tails belong.
    """

    foot_bodies: tuple[str, ...]
    wrench_ground: Float[np.ndarray, "frames feet 6"]
    cop_ground: Float[np.ndarray, "frames feet 3"]  # [m] NaN where the foot is unloaded
    observed: Bool[np.ndarray, " frames"]
    in_contact: Bool[np.ndarray, "frames feet"]  # the foot carries load on a plate
    plate: Int[np.ndarray, "frames plates"]
    wrench_raw_ground: Float[np.ndarray, "frames feet 6"]  # likewise, neither filtered nor thresholded
    unassigned: Bool[np.ndarray, " frames"] | None = (
        None  # a load that changes goes to no foot; None: nowhere
    )
    notes: tuple[Note, ...] = ()

    @property
    def frames(self) -> int:
        """Number of frames."""
        return self.wrench_ground.shape[0]

    @property
    def has_plates(self) -> bool:
        """Whether the recording has any plate."""
        return self.plate.shape[1] > 0


def without_measured_forces(foot_bodies: tuple[str, ...], frames: int) -> ContactWrenches:
    """Of a trial without any plate: nothing was observed."""
    feet = len(foot_bodies)
    nothing = np.zeros((frames, feet, 6))
    return ContactWrenches(
        foot_bodies=foot_bodies,
        wrench_ground=nothing,
        cop_ground=np.full((frames, feet, 3), np.nan),
        observed=np.zeros(frames, dtype=bool),
        in_contact=np.zeros((frames, feet), dtype=bool),
        plate=np.zeros((frames, 0), dtype=np.int64),
        wrench_raw_ground=nothing,
    )


PERSON, FILE, DETECTION = "review", "review.json", "proposals"  # who decided, as figures name them
NOBODY, RECORDING = "none", "recording"  # nothing was decided; the recording itself has no force for a foot
SOURCES = (NOBODY, DETECTION, FILE, PERSON)  # a later one is heard before an earlier one


@dataclass(frozen=True)
class FrameMask:
    """Per foot: True where the force counts. `reasons` says why not; frame `end` is the first after a range.

    Files and JSON say it the other way round (true = missing); they are converted at the door.
    """

    counts: Bool[np.ndarray, "frames feet"]
    reasons: tuple[MissingRange, ...] = ()
    source: str = NOBODY  # all of those of `SOURCES` that decided anything, joined by " + "
    decided_by: Int[np.ndarray, "frames feet"] | None = None  # places in `SOURCES`; None: not known
    sources: tuple[str, ...] = ()  # of each of the reasons: of `SOURCES`, or RECORDING

    def source_of(self, k: int) -> str:
        """Who gave a reason; where that was not kept, who decided about the trial.

        Args:
            k: its place in `reasons`.
        """
        return self.sources[k] if self.sources else self.source

    def decided(self, *sources: str) -> Bool[np.ndarray, "frames feet"]:
        """Frames and feet about which one of these has decided.

        Args:
            sources: of `SOURCES`.
        """
        if self.decided_by is None:
            return np.full(self.counts.shape, self.source in sources)
        return np.isin(self.decided_by, [SOURCES.index(source) for source in sources])

    @property
    def all_feet(self) -> Bool[np.ndarray, " frames"]:
        """Frames on which every foot's force counts: the complement of the paper's U."""
        return np.all(self.counts, axis=1)
