"""Our entry that sees the recorded markers: the solver's trajectory without any plate. It stands apart."""

from dataclasses import dataclass, field, replace

import numpy as np

from addb_viewer.benchmark.errors import BenchmarkError
from addb_viewer.benchmark.from_angles import FromAngles
from addb_viewer.benchmark.task import Foretold, Log, Seen, Trials
from solver.dynamics.trajectory_fit import fit_trajectories
from solver.dynamics.trial_data import TrialData
from solver.kinematics.motion import Motion


@dataclass
class FromMarkers:
    """Fits one trajectory to the markers and to what `FromAngles` foretells; then foretells along it."""

    name: str = "fit-from-markers"
    angles: FromAngles = field(default_factory=FromAngles)
    needs_markers: bool = True

    def fit(self, train: Trials, dev: Trials, log: Log) -> None:
        """As from angles."""
        self.angles.fit(train, dev, log)

    def predict(self, seen: Seen) -> Foretold:
        """See the class; a stretch that is too short for a trajectory is told from its angles."""
        shown = Motion(seen.skeleton.dofs, seen.q, seen.rate)
        enough = seen.frames >= self.angles.settings.trajectory.fewest_frames
        return self.angles.along(seen, self._trajectory(seen, shown) if enough else shown)

    def _trajectory(self, seen: Seen, shown: Motion) -> Motion:
        if seen.markers is None:
            raise BenchmarkError(f"{self.name} needs markers, and this release shows none")
        there = seen.markers.names
        markers = [marker for marker in seen.skeleton.markers if marker.name in there]
        data = TrialData(
            observed_ground=seen.markers.position_ground[:, [there.index(m.name) for m in markers]],
            wrench_ground=np.zeros((seen.frames, 6)),
            counts=np.zeros(seen.frames, dtype=bool),
            start=shown,
            foretold_ground=self.angles.total_wrench(seen, shown, self.angles.cutoff_Hz),
        )
        skeleton = replace(seen.skeleton, markers=tuple(markers))
        return fit_trajectories(skeleton, [data], self.angles.settings.trajectory).motions[0]
