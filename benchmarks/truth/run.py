"""What the bench keeps of one solved recording: plain numbers, for the page and for later comparisons."""

from benchmarks.truth.figures import figures, gains
from benchmarks.truth.segments import length_errors_mm, mass_ratios
from benchmarks.truth.time_history import TimeHistory
from benchmarks.truth.ways import LABORATORY, OURS, Ways
from solver.fitting.fit import Fit
from solver.skeleton.skeleton import Skeleton


def against_truth(
    labels: dict[str, object], fit: Fit, ways: Ways, truth: TimeHistory, true_skeleton: Skeleton
) -> dict[str, object]:
    """Figures of a recording whose truth is known.

    Args:
        labels: of the run: activity, skin movement, model, person.
        fit: of the recording.
        ways: of its trial.
        truth: on the same frames.
        true_skeleton: that really moved.
    """
    return labels | {
        "ways": {
            name: figures(time_history, truth, ways.forces_count)
            for name, time_history in ways.time_histories.items()
        },
        "gains": gains_of(ways) | {"truth": gains(truth, ways.raw_marker_fit)},
        "gains_against_truth": {OURS: gains(ways.time_histories[OURS], truth)},
        "mass_ratios": mass_ratios(fit.skeleton, true_skeleton),
        "length_errors_mm": length_errors_mm(fit.skeleton, true_skeleton),
        "notes": list(fit.notes),
    }


def gains_of(ways: Ways) -> dict[str, object]:
    """Gain and phase against the unfiltered marker fit."""
    return {name: gains(ways.time_histories[name], ways.raw_marker_fit) for name in (OURS, LABORATORY)}
