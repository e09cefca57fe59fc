"""What a threshold of the feet's motion decides: each halved and doubled, judged by plates.

    python -m benchmarks.gait_settings --out DIR

The recordings of `benchmarks.gait_events`, markers alone, one fit each; and for what is read of a belt,
simulated people on belts. Answers are kept as lines of a file in DIR: it picks up where it was stopped, then
writes GAIT_SETTINGS.md. Thresholds of plates and of which cycles count are not asked.
"""

import argparse
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.gait_belts import belt_answer, belted
from benchmarks.gait_events import Case, harm, without_forces
from benchmarks.gait_plates import RECORDINGS, Recording, measured, steps_of
from benchmarks.gait_thresholds import Feet
from benchmarks.varied import Answer, Variation, asked, judged_tables, place, rules, usual_of, variations
from solver.capture.subject import open_subject
from solver.contact.sole import soles
from solver.gait.foot_motion import foot_motion
from solver.gait.settings import GAIT, GaitSettings
from solver.pipeline import solve
from solver.settings import Settings
from solver.skeleton.forward import body_poses

PAGE = Path(__file__).with_name("GAIT_SETTINGS.md")
ANSWERS = "gait.jsonl"
OF_BELTS = ("flat_from", "flat_to", "belt_window_s")
NOT_OF_FEET = ("threshold_N", "least_peak_N", "gap_s", "walking_m_s", "longest_cycle_s", *OF_BELTS)
SHARES = ("flat_to",)  # double of which is more than one
BELTS = "Belts"  # the answer with all as usual
SAME_S = 0.002  # by which an event may move and be the same
INTRODUCTION = """# What a threshold of the feet's motion decides: each halved and doubled

Made by `python -m benchmarks.gait_settings`: events from the feet of {recordings} recordings against plates
([GAIT.md](GAIT.md)). A row has, at half and at double, the squared errors in units of the bars, one missed or
extra event as one at three times its bar (mean of the persons; {usual:.2f} % with the usual thresholds), and
the events that come and go over all that there are: one that moves by more than 2 ms goes and comes.

{belts} are asked about simulated people on belts, whose walk
over a floor is known: the size of the errors of stride lengths and average speeds (mean of the persons;
{of_belts:.2f} % as it is), and the share of these that change by more than 0.1 %. Double of `flat_to` halves
what is missing to one. Thresholds of plates, and of which cycles count, were not asked.

"""


@dataclass(frozen=True, eq=False)
class Walked:
    """One recording: plates that judge, and what the feet's motion is made of."""

    case: Case
    corners: tuple[np.ndarray, ...]
    root: np.ndarray
    times: np.ndarray
    bodies: tuple[str, ...]

    def feet(self, settings: GaitSettings) -> Feet:
        """Their motion as thresholds see it."""
        motion = foot_motion(list(self.corners), self.root, self.times, settings)
        return Feet(motion, self.bodies)


@cache
def walked() -> tuple[Walked, ...]:
    """All recordings whose plates are a judge."""
    with tempfile.TemporaryDirectory() as scratch:
        chosen = [recording for recording in RECORDINGS if not recording.excluded]
        return tuple(_walked(one, Path(scratch) / str(k)) for k, one in enumerate(chosen))


def _walked(recording: Recording, folder: Path) -> Walked:
    without_forces(recording, folder)
    settings = replace(Settings(), trajectory=replace(Settings().trajectory, enabled=False))
    fit = solve(open_subject(folder), settings)
    trial = next(one for one in fit.trials if one.capture.name == recording.trial)
    points, loads = measured(recording)
    case = Case(recording, points, loads, steps_of(recording, points, loads), folder, ())
    R, p = body_poses(fit.skeleton, trial.motion.q)
    assert trial.contacts is not None
    bodies = tuple(trial.contacts.foot_bodies)
    corners = tuple(sole.corners_ground(R, p) for sole in soles(fit.skeleton, bodies))
    return Walked(case, corners, p[:, 0], trial.motion.times, bodies)


def answer_of(variation: Variation) -> Answer:
    """One value's."""
    name, factor, settings = variation
    harms: dict[str, list[float]] = {}
    changed, events = 0, 0
    for one, before in zip(walked(), _usual(), strict=True):
        feet = one.feet(settings)
        harms.setdefault(one.case.recording.folder, []).append(harm(one.case.verdict_with(feet, settings)))
        told = list(_times(feet, settings))
        changed += _others(told, before) + _others(before, told)
        events += len(before)
    wrong = {person: float(np.mean(each)) / len(harms) for person, each in harms.items()}
    return Answer(name, factor, sum(wrong.values()), changed / events, events, wrong)


@cache
def _usual() -> tuple[list[tuple[int, str, float]], ...]:
    return tuple(list(_times(one.feet(GAIT), GAIT)) for one in walked())


def _times(feet: Feet, settings: GaitSettings) -> Iterator[tuple[int, str, float]]:
    for event in feet.events(settings):
        yield event.foot, event.kind.value, event.time_s


def _others(told: list[tuple[int, str, float]], known: list[tuple[int, str, float]]) -> int:
    """How many have none of their foot and kind at their time."""
    return sum(
        not any(one[:2] == other[:2] and abs(one[2] - other[2]) <= SAME_S for other in known) for one in told
    )


def of_belts() -> Iterator[Variation]:
    """All as usual, then half and double of what is read of a belt."""
    yield BELTS, 1.0, GAIT
    yield from (one for one in variations(GAIT, shares=SHARES) if is_of_belts(one[0]))


def is_of_belts(name: str) -> bool:
    """Whether a setting says how a belt is read."""
    return name.partition(".")[2] in OF_BELTS


def main() -> None:
    """Ask what has no answer yet, and write the page."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.gait_settings", description=__doc__)
    arguments.add_argument("--out", type=Path, required=True, help="folder in which answers are kept")
    file = arguments.parse_args().out / ANSWERS
    asked(file, variations(GAIT, left_out=NOT_OF_FEET), answer_of)
    walks = cache(lambda: tuple(belted(file.parent / "sim")))
    answers = asked(file, of_belts(), lambda variation: belt_answer(walks(), GAIT, variation))
    usual = usual_of(answers)
    text = INTRODUCTION.format(
        recordings=sum(not recording.excluded for recording in RECORDINGS),
        usual=100 * usual["GaitSettings"].wrong,
        belts=", ".join(f"`{key}`" for key in OF_BELTS),
        of_belts=100 * usual[BELTS].wrong,
    )
    rows = judged_tables(
        [one for one in answers if one.setting not in usual],
        lambda name: usual[BELTS if is_of_belts(name) else "GaitSettings"],
        lambda name: place(name, {"GaitSettings": "gait"}),
    )
    PAGE.write_text("\n".join([text + rules(), "", *rows]), encoding="utf-8")


if __name__ == "__main__":
    main()
