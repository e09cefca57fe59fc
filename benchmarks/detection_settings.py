"""What a setting of detection decides: each halved and doubled, judged by forces hidden in real recordings.

    python -m benchmarks.detection_settings --out DIR

Recordings of the detection's benchmark, each as it is and with forces hidden in four ways, one draw each.
Answers are kept as lines of a file in DIR: it picks up where it was stopped, then writes
DETECTION_SETTINGS.md. Settings that look for faults of plates (stuck, clipped, spikes) and the like are not
asked: nothing of the kind is hidden here.
"""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from jaxtyping import Bool

from benchmarks.detection import PARTS, WHOLE, Case, Score, case_of, score
from benchmarks.detection_hiding import KINDS, hide, stances
from benchmarks.varied import Answer, Variation, asked, rules, tables, usual_of, variations
from solver.capture.capture import ForcePlate
from solver.contact.detection import detect
from solver.contact.detection_settings import DetectionSettings
from solver.contact.proposals import missing_force
from solver.contact.wrenches import ContactWrenches
from solver.settings import Settings
from solver.skeleton.skeleton import Skeleton

PAGE = Path(__file__).with_name("DETECTION_SETTINGS.md")
ANSWERS = "detection.jsonl"
LONG = ("overground_camargo2021_AB06", "c3d_lab_trials/lasem_FAILT01", "walk_treadmill_stepwidth")
QUIET = ("squats1",)  # two feet that stand all along
CHOSEN = [r for r in (*WHOLE, *PARTS) if r.folder not in LONG and r.trial not in QUIET]
OF_FAULTS = ("fault_", "cop_", "clipped_", "held_", "spike", "spike_", "dropout", "dropout_")  # of plates
NOT_SHOWN = ("jump_", "elsewhere_odds", "nobody_N", "sure_odds")  # markers that jump, chairs, how sure
INTRODUCTION = """# What a setting of detection decides: each halved and doubled

Made by `python -m benchmarks.detection_settings`: {recordings} recordings, each as it is and with forces
hidden in four ways ([DETECTION.md](DETECTION.md)), one draw each. A row has, at half and at double, the
feet's frames that are missed or falsely proposed over those that were hidden (mean of the recordings;
{usual:.2f} % with the usual settings), and the share of frames on which another answer is given. Settings
that look for faults of plates, markers that jump or chairs, or say how sure a proposal is, were not asked.

"""


@dataclass(frozen=True, eq=False)
class HiddenCase:
    """A recording with some forces hidden, and which frames of which feet miss them."""

    case: Case
    plates: Sequence[ForcePlate]
    contacts: ContactWrenches
    skeleton: Skeleton
    truth: Bool[np.ndarray, "frames feet"]

    def proposed(self, settings: DetectionSettings) -> Bool[np.ndarray, "frames feet"]:
        """Frames that detection is sure enough of."""
        found = detect(
            self.skeleton,
            self.case.trial.motion,
            self.contacts,
            self.plates,
            tracked=self.case.tracked,
            settings=settings,
        )
        feet = self.contacts.foot_bodies
        return missing_force(found, feet, self.contacts.frames, settings.confidence)

    def score(self, proposed: Bool[np.ndarray, "frames feet"]) -> Score:
        """Of all feet."""
        feet = zip(self.truth.T, proposed.T, strict=True)
        return sum((score(t, p, self.case.counted) for t, p in feet), Score())


@cache
def hidden_cases() -> tuple[tuple[HiddenCase, ...], ...]:
    """Of each recording: as it is, and with forces hidden in each way."""
    return tuple(tuple(_hidden(case_of(recording))) for recording in CHOSEN)


def _hidden(case: Case) -> Iterator[HiddenCase]:
    rng = np.random.default_rng(0)
    some = [hide(case.plates, kind(stances(case.plates), rng)) for kind in KINDS.values()]
    for plates in (case.plates, *some):
        contacts = case.assigned(plates)
        yield HiddenCase(case, plates, contacts, case.with_mass_from(contacts), case.removed(plates))


@cache
def _usual() -> list[list[np.ndarray]]:
    return [[way.proposed(Settings().detection) for way in ways] for ways in hidden_cases()]


def answer_of(variation: Variation) -> Answer:
    """One value's."""
    name, factor, settings = variation
    wrong = {recording.folder: 0.0 for recording in CHOSEN}
    changed, frames = 0, 0
    for recording, ways, before in zip(CHOSEN, hidden_cases(), _usual(), strict=True):
        told = [way.proposed(settings) for way in ways]
        total = sum((way.score(one) for way, one in zip(ways, told, strict=True)), Score())
        share = (total.missed + total.false) / (total.found + total.missed)
        wrong[recording.folder] += share / len(CHOSEN)
        changed += sum(int((one != other).sum()) for one, other in zip(told, before, strict=True))
        frames += sum(one.size for one in told)
    return Answer(name, factor, sum(wrong.values()), changed / frames, frames, wrong)


def main() -> None:
    """Ask what has no answer yet, and write the page."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.detection_settings", description=__doc__)
    arguments.add_argument("--out", type=Path, required=True, help="folder in which answers are kept")
    file = arguments.parse_args().out / ANSWERS
    answers = asked(file, variations(Settings().detection, left_out=(*OF_FAULTS, *NOT_SHOWN)), answer_of)
    usual = usual_of(answers)["DetectionSettings"]
    text = INTRODUCTION.format(recordings=len(CHOSEN), usual=100 * usual.wrong)
    rows = tables(answers, {"DetectionSettings": "detection"})
    PAGE.write_text("\n".join([text + rules(), "", *rows]), encoding="utf-8")


if __name__ == "__main__":
    main()
