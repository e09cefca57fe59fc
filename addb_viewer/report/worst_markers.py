"""Which markers fit worst, and when: the ones to look at first."""

import warnings

import numpy as np

from addb_viewer.report.markup import Safe, bar, element, table
from addb_viewer.trial_view.replay import Replay
from solver.dynamics.thresholds import Thresholds

MOST = 8


def worst_markers(replay: Replay, index: int) -> Safe:
    """The markers with the largest RMS error, worst first.

    Args:
        replay: the trial.
        index: of it in the report.
    """
    errors = replay.markers.errors
    compared = np.flatnonzero(np.isfinite(errors).any(axis=0))
    if not len(compared):
        return element("p", "No marker of this trial is in the model.")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # markers that were never seen
        rms = np.sqrt(np.nanmean(errors**2, axis=0))
    worst = compared[np.argsort(-rms[compared])][:MOST]
    most = float(rms[worst[0]])
    rows = []
    for marker in worst:
        frame = int(np.nanargmax(errors[:, marker]))
        seen = float(np.isfinite(replay.markers.measured[:, marker]).all(axis=1).mean())
        largest = float(errors[frame, marker])
        rows.append(
            [
                replay.markers.names[marker],
                element(
                    "span",
                    bar(rms[marker] / most),
                    Safe(" "),
                    f"{100 * rms[marker]:.2f} cm",
                    class_="measured",
                ),
                f"{100 * largest:.1f} cm{' ✗' if largest > Thresholds().marker_max_m else ''}",
                seek_link(index, frame, f"frame {frame}, {replay.times[frame]:.2f} s"),
                f"{100 * seen:.0f} %",
            ]
        )
    return table(("Marker", "RMS", "Largest", "at", "Seen"), rows)


def seek_link(trial: int, frame: int, words: str) -> Safe:
    """A link that leads the player to a frame."""
    return element("a", words, href="#scene", data_seek=f"{trial}:{frame}")
