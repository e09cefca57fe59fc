"""Rows of zeros at a recording's ends beside a loaded row: written by programs, not measured."""

from dataclasses import dataclass

import numpy as np

from solver.capture.capture import ForcePlate
from solver.common.notes import Kind, Note
from solver.common.settings_field import setting


@dataclass(frozen=True)
class EdgeZeroSettings:
    """When zeros at an end are not an unloaded plate."""

    longest_s: float = setting(
        0.1,
        unit="s",
        why="filters, delays and resampling leave so much empty; longer, the load has to stay, see hold_s, "
        "or to come faster than any landing, see fastest_kN_per_s",
    )
    hold_s: float = setting(
        0.05,
        unit="s",
        why="beside longer zeros the load stays for that long: a foot that lands or leaves takes as long to "
        "load or unload",
    )
    held_share: float = setting(
        0.5, unit="", why="of the first load, by which it may change meanwhile: slow moves stay below"
    )
    fastest_kN_per_s: float = setting(
        1000.0,
        unit="kN/s",
        why="nobody loads or unloads a plate that fast: of sixteen laboratories' recordings a landing on "
        "both feet reaches 505",
    )
    loaded_N: float = setting(100.0, unit="N", why="the row beside carries at least that")
    loaded_share: float = setting(
        0.2, unit="", why="of the plate's largest force: hard strikes begin with less within one sample"
    )
    steadiness: float = setting(
        3.0,
        unit="",
        why="by which the step from zero exceeds those after it: a foot that lands goes on rising",
    )


EDGE_ZEROS = EdgeZeroSettings()


def without_edge_zeros(
    plate: ForcePlate, settings: EdgeZeroSettings = EDGE_ZEROS
) -> tuple[ForcePlate, tuple[Note, ...]]:
    """The plate with such rows unmeasured (NaN), and a note on each end that has them."""
    first = _zeros_before_a_load(plate.force_ground, plate.rate, settings)
    last = _zeros_before_a_load(plate.force_ground[::-1], plate.rate, settings)
    if not first + last:
        return plate, ()
    unmeasured = np.zeros(plate.samples, dtype=bool)
    unmeasured[:first] = True
    unmeasured[plate.samples - last :] = True
    said = " and ".join(
        f"the {end} {count} rows" for end, count in (("first", first), ("last", last)) if count
    )
    note = Note(
        Kind.OTHER,
        f"{plate.name}: {said} hold zero force next to a row under load; nobody steps on or off a plate that "
        "fast, so they count as not measured",
    )
    return plate.unmeasured_at(unmeasured), (note,)


def _zeros_before_a_load(force: np.ndarray, rate: float, settings: EdgeZeroSettings) -> int:
    """How many zero rows the force begins with, if it then jumps to a load, and stays there or jumps too far.

    Otherwise none.
    """
    zero = (force == 0).all(axis=1)
    if not len(zero) or not zero[0] or zero.all():
        return 0
    count = int(np.argmin(zero))
    after = np.linalg.norm(force[count : count + 4], axis=1)
    if len(after) < 4 or not np.isfinite(after).all():
        return 0
    too_fast = after[0] * rate > 1000 * settings.fastest_kN_per_s
    if count > max(1.0, settings.longest_s * rate) and not too_fast:
        held = np.linalg.norm(force[count : count + 1 + max(4, round(settings.hold_s * rate))], axis=1)
        if not np.abs(held - held[0]).max() <= settings.held_share * held[0]:
            return 0
    least = max(settings.loaded_N, settings.loaded_share * float(np.nanmax(np.linalg.norm(force, axis=1))))
    is_steady = np.abs(np.diff(after)).max() * settings.steadiness < after[0]
    return count if after[0] >= least and is_steady else 0
