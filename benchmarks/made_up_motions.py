"""Made-up walks, runs, squats and landings beside recorded ones: do they move as people do?

    python -m benchmarks.made_up_motions --keep DIR

Angles, steps and loads of people whom `solver.simulate` makes up, and of the recordings whose activity is
known, measured by one code from the motion of the markers. The page MADE_UP_MOTIONS.md says for each figure
whether the made-up people's middle lies among the recorded persons. Fits and motions are kept in DIR.
"""

import argparse
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import numpy as np

from benchmarks.activities.examples import Example
from benchmarks.activities.recorded import recorded
from benchmarks.activities.simulated import JUDGED, TAUGHT, simulated
from benchmarks.diagnosis.rates import table
from benchmarks.gait_belts import feet_of
from solver.gait.activity import Activity
from solver.gait.cycles import Cycle, cycles_of
from solver.gait.events import stances_from_feet
from solver.gait.settings import GAIT

PAGE = Path(__file__).with_name("MADE_UP_MOTIONS.md")
SPRINT_M_S = 6.0  # from here on a run is told apart
FEWEST_PERSONS = 5  # recorded, below which their range says little
JOINTS = {"hip flexion": "hip_flexion", "knee flexion": "knee_angle", "ankle": "ankle_angle"}
HELD = {"arm held off": "arm_add", "elbow bent": "elbow_flex", "knee bent": "knee_angle"}  # in standing
WITHIN, BESIDE, FEW = "within", "beside", "too few recorded"
Values = Mapping[tuple[str, str], Mapping[str, list[float]]]
INTRODUCTION = """# Made-up motions beside recorded ones

Made by `python -m benchmarks.made_up_motions`. What `solver.simulate` makes up is sketched by hand
([how](../docs/simulate.md)); these are its walks, runs, squats and landings beside people's, measured by one
code from the motion of the markers, each person by the median of what they did. Three numbers are the
lowest, the middle and the highest person, and how many there are. *Within*: the made-up people's middle lies
among the recorded persons; *beside*: it does not; with fewer than {few} recorded persons neither is said.
Persons chose their own speeds, so that the figures need not be the same.

"""


def figures(example: Example) -> dict[str, float]:
    """By name; what cannot be told is left out."""
    span = slice(*(example.during or (0, example.motion.frames)))
    q = example.motion.q[span]
    if example.activity is Activity.STANDING:
        of_joints = {f"{words} [°]": _columns(example, joint) for words, joint in HELD.items()}
        return {name: float(np.degrees(np.median(q[:, of]))) for name, of in of_joints.items() if of}
    found = {}
    for words, joint in JOINTS.items():
        if columns := _columns(example, joint):
            found[f"{words}, range [°]"] = float(np.degrees(np.median(np.ptp(q[:, columns], axis=0))))
    height = q[:, list(example.motion.dofs).index("pelvis_ty")]
    found["pelvis, rise and fall [cm]"] = float(100 * np.ptp(height))
    if example.load_BW is not None and np.isfinite(example.load_BW[span]).any():
        found["largest load [body weights]"] = float(np.nanpercentile(example.load_BW[span], 99))
    if example.activity in (Activity.WALKING, Activity.RUNNING):
        found |= _of_cycles(_cycles(example, span))
    return found


def _columns(example: Example, joint: str) -> list[int]:
    return [k for k, dof in enumerate(example.motion.dofs) if dof in (f"{joint}_r", f"{joint}_l")]


def _cycles(example: Example, span: slice) -> list[Cycle]:
    times = example.motion.times
    moved, heels = feet_of(example)
    cycles = cycles_of(stances_from_feet(moved, GAIT), moved, heels, times, GAIT)
    first, last = times[span][[0, -1]]
    return [cycle for cycle in cycles if first <= cycle.start_s and cycle.end_s <= last]


def _of_cycles(cycles: Iterable[Cycle]) -> dict[str, float]:
    each = {
        "speed [m/s]": [c.speed_m_s for c in cycles],
        "cadence [1/min]": [c.cadence_per_min for c in cycles],
        "stance [% of the stride]": [100 * c.stance_share for c in cycles if c.stance_share is not None],
        "step width [cm]": [100 * c.step_width_m for c in cycles if c.step_width_m is not None],
    }
    return {name: float(np.median(values)) for name, values in each.items() if values}


def _activity(example: Example, found: Mapping[str, float]) -> str:
    speed = found.get("speed [m/s]", example.speed_m_s or 0.0)
    fast = example.activity is Activity.RUNNING and speed > SPRINT_M_S
    return "sprint" if fast else example.activity.value


def by_activity(examples: Iterable[Example]) -> Values:
    """Values by activity and figure, then by person."""
    values: dict[tuple[str, str], dict[str, list[float]]] = {}
    for example in examples:
        found = figures(example)
        for name, value in found.items():
            of_persons = values.setdefault((_activity(example, found), name), {})
            of_persons.setdefault(example.person, []).append(value)
    return values


def verdict(recorded_persons: Iterable[float], made_up_persons: Iterable[float]) -> str:
    """Whether the middle of the made-up lies among the recorded."""
    real = list(recorded_persons)
    if len(real) < FEWEST_PERSONS:
        return FEW
    middle = float(np.median(list(made_up_persons)))
    return WITHIN if min(real) <= middle <= max(real) else BESIDE


def middles(values: Values) -> Iterator[tuple[str, str, dict[str, float]]]:
    """Activity, figure, and the median of what each person did."""
    for (activity, name), of_persons in sorted(values.items()):
        yield activity, name, {person: float(np.median(each)) for person, each in of_persons.items()}


def _rows(real: Values, made_up: Values) -> Iterator[list[str]]:
    made = {(activity, name): of for activity, name, of in middles(made_up)}
    for activity, name, of_persons in middles(real):
        if (
            activity,
            name,
        ) not in made or activity == Activity.STANDING.value:  # people were told how to stand
            continue
        of_real, of_made = list(of_persons.values()), list(made[activity, name].values())
        yield [activity, name, _range(of_real), _range(of_made), verdict(of_real, of_made)]


def _range(values: list[float]) -> str:
    low, middle, high = (f"{value:.3g}" for value in np.percentile(values, [0, 50, 100]))
    return f"{low}, **{middle}**, {high} ({len(values)})"


def main() -> None:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.made_up_motions", description=__doc__)
    parser.add_argument("--keep", type=Path, required=True, help="folder of fits and motions")
    keep: Path = parser.parse_args().keep
    real = by_activity(recorded(keep / "rec"))
    made_up = by_activity(simulated((*TAUGHT, *JUDGED), keep / "sim"))
    lines = table(["activity", "figure", "recorded", "made up", ""], [*_rows(real, made_up)])
    PAGE.write_text(INTRODUCTION.format(few=FEWEST_PERSONS) + lines + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
