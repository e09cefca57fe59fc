"""Whether a fit goes into this machine's memory: asked before it begins."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from solver.capture.capture import Capture
from solver.common.errors import FitError
from solver.common.frames_at_once import FRAMES_AT_ONCE
from solver.common.operating_system import available_bytes
from solver.dynamics.inertia_parameters import inertia_parameters
from solver.dynamics.trajectory.frame_spans import are_long
from solver.dynamics.trajectory.spline_band import REACH
from solver.dynamics.trajectory.spline_basis import ORDER
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.skeleton.skeleton import Skeleton

NUMBER = 8  # bytes of one in double precision
BAND = REACH + 1  # blocks of dofs × dofs that the trajectory fit holds per coefficient
TRACKED_BLOCKS = 3  # likewise the marker fit per frame: the diagonal, the one below, and their factor's copy
# Numbers per frame that stay while a window is worked out; of long trials a quarter less was measured
PER_MARKER = 12  # places as observed and of the model before and after the fit, and errors
PER_DOF = 10  # motions and splines of the fits so far, torques
PER_BODY = 48  # numbers per body and frame: pose, twists and momenta of it
# kinds of products in the table of a coefficient's window: own, and with the frame before, twice
LAID_OUT = 3
PEAK_MARGIN = 1.15  # for passing copies; measured peaks of 15 s to 4 min lie 0.9 to 1.0 times the rest
OTHER_BYTES = 32 * 2**20  # bytes, of any fit: frames worked out together, libraries loaded on the way


@dataclass(frozen=True)
class TrialSize:
    """What decides how much memory a trial takes."""

    name: str
    frames: int
    rate: float  # [Hz]
    forces: bool  # it takes part in the trajectory fit


def sizes_of(captures: Sequence[Capture]) -> tuple[TrialSize, ...]:
    """Of trials as they were read."""
    return tuple(
        TrialSize(c.name, len(c.markers.times), c.markers.rate, forces=bool(c.plates)) for c in captures
    )


def needed_bytes(
    trials: Sequence[TrialSize], skeleton: Skeleton, settings: TrajectorySettings, extra: int = 0
) -> int:
    """What a fit of these trials together holds at its peak, beside what is already read.

    The trajectory fit holds every trial's band and border at once, as long as trials are not long together;
    then those of the frames that teach the inertias, or of a window. The marker fit holds one trial after the
    other, some thousand frames at a time.

    Args:
        trials: of one fit.
        skeleton: the model whose motion is sought.
        settings: of the trajectory fit.
        extra: parameters of an accepted extension.
    """
    dofs = len(skeleton.dofs)
    kept = sum(
        trial.frames * (PER_MARKER * len(skeleton.markers) + PER_DOF * dofs)
        + min(trial.frames, FRAMES_AT_ONCE) * PER_BODY * len(skeleton.bodies)
        for trial in trials
    )
    tracked = max(min(trial.frames, FRAMES_AT_ONCE) * TRACKED_BLOCKS * dofs**2 for trial in trials)
    fitted = [trial for trial in trials if trial.forces] if settings.enabled else []
    shared = extra + (inertia_parameters(skeleton).count if settings.fit_inertias else 0)
    if not are_long([trial.frames for trial in fitted], settings):
        largest = sum(_of_band(trial, trial.frames, dofs, shared, settings) for trial in fitted)
    else:
        at_once = max(settings.inertia_frames, settings.window_frames)
        largest = max(_of_band(trial, at_once, dofs, shared, settings) for trial in fitted)
    return OTHER_BYTES + round(NUMBER * PEAK_MARGIN * (kept + max(tracked, largest)))


def _of_band(trial: TrialSize, frames: int, dofs: int, shared: int, settings: TrajectorySettings) -> int:
    """Numbers in the band and the border of so many frames at a trial's rate."""
    spacing = max(1, round(settings.knot_spacing_s * trial.rate))
    coefficient = BAND * dofs**2 + dofs * shared + BAND * BAND * spacing * LAID_OUT
    return (frames // spacing + ORDER) * coefficient


def refuse_what_does_not_fit(
    trials: Sequence[TrialSize], skeleton: Skeleton, settings: TrajectorySettings, extra: int = 0
) -> None:
    """Stop before a fit that would end in the middle for want of memory.

    Args:
        trials: of one fit.
        skeleton: the model whose motion is sought.
        settings: of the trajectory fit.
        extra: parameters of an accepted extension.

    Raises:
        FitError: it needs more than there is; the message says how much, of which trial, and what to do.
    """
    need, have = needed_bytes(trials, skeleton, settings, extra), available_bytes()
    if need <= have:
        return
    size = {trial: needed_bytes([trial], skeleton, settings, extra) for trial in trials}
    longest = max(trials, key=lambda trial: size[trial])
    several = len(trials) > 1
    of_it = f", {_GB(size[longest])} of it for this trial" if several else ""
    ways = ["close other programs"]
    if several:
        ways.append("fit fewer trials at once (--trial NAME)")
    ways.append("export a shorter part or fewer frames per second from the laboratory's program")
    coarse = replace(settings, knot_spacing_s=2 * max(settings.knot_spacing_s, 1 / longest.rate))
    less = needed_bytes(trials, skeleton, coarse, extra)
    if less < need:
        ways.append(
            f"set knot_spacing_s = {coarse.knot_spacing_s:g} under [trajectory] in settings.toml: it then "
            f"needs {_GB(less)}"
        )
    raise FitError(
        f"{longest.name}: {longest.frames} frames at {longest.rate:g} Hz: the fit needs about {_GB(need)} of "
        f"memory{of_it}, and {_GB(have)} are free. What helps: {'; or '.join(ways)}."
    )


def _GB(size: int) -> str:
    return f"{size / 1e9:.1f} GB"
