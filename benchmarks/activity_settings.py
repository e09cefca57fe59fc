"""What a number decides of suggested activities: each halved and doubled, judged by what trials show.

    python -m benchmarks.activity_settings --out DIR

The recordings and the simulated people of `benchmarks.activities`, each half second in which the activity is
known; weights are learnt anew where windows or features are others, and never on the person or the laboratory
that they judge. Motions and answers are kept in DIR: it picks up where it was stopped, then writes
ACTIVITY_SETTINGS.md.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path

from benchmarks.activities.examples import SIMULATED
from benchmarks.activities.judging import NAMELESS, NOTHING, answers
from benchmarks.activities.learning import learnt
from benchmarks.activities.looking import Look, looked_at, with_windows
from benchmarks.activities.recorded import recorded
from benchmarks.activities.simulated import JUDGED, TAUGHT, simulated
from benchmarks.rewriting import Number, answer_with
from benchmarks.varied import (
    FACTORS,
    Questions,
    asked,
    judged_tables,
    place,
    place_of_number,
    rules,
    usual_of,
    variations,
)
from solver.gait.activity_model import Weights
from solver.gait.activity_settings import ACTIVITIES, ActivitySettings

PAGE = Path(__file__).with_name("ACTIVITY_SETTINGS.md")
ANSWERS = "activities.jsonl"
NOT_SHOWN = (
    "riser_m", "ramp", "box_m", "flight_s", "pause_s", "lunge_step", "still", "walking_m_s", "one_foot_s",
)  # fmt: skip
SHARES = ("least_confidence", "sure_share")  # double of which is more than one
Group = tuple[str, str]
"""Where a trial is from; and of simulated people, whose it is."""
NUMBERS = (Number("gait/activity_features.py", "MOST"), Number("gait/body_motion.py", "SMOOTH_HZ"))
INTRODUCTION = """# What a number decides of suggested activities: each halved and doubled

Made by `python -m benchmarks.activity_settings`: {trials} trials of {persons} persons, recorded and simulated
([ACTIVITIES.md](ACTIVITIES.md)), each half second in which the activity is known; recordings with a name that
says nothing and with their own. Weights never saw the person (simulated) or the laboratory (recorded) that
they judge, and are learnt anew where windows or features are others. A row has, at half and at double, the
share of answers that are wrong ({usual:.2f} % as it is), and of those that are others than usual: two of each
half second, what happens (with the sub-label, where one is known) and whether anything wrong is said, so that
a half second of which nothing is said counts half.

Of a share that double would make larger than one, double halves what is missing to one. Not asked was what
tells apart activities of which one has no example here: stairs (`riser_m`), slopes (`ramp`, and `AMID` of
`gait/body_motion.py`), lunges (`lunge_step`), standing on one foot (`one_foot_s`), jumps that are no drop
jumps (`box_m`, `flight_s`, `pause_s`), and starting and stopping (`still`).

Most of these numbers were settled while the same recordings were looked at: that half and double are no
better here does not say so of others.

"""


@dataclass(frozen=True, eq=False)
class Known:
    """A trial of which it is known what happens in it, by one of its names."""

    kept: Path
    look: Look
    name: str

    @property
    def person(self) -> str:
        """The simulated one, or the recording's folder."""
        return person_of(self.look)

    @property
    def truth(self) -> Sequence[object]:
        """Of each half second: what happens, and that nothing wrong is said."""
        example = self.look.example
        return self._twice([_words(example.activity, example.kind)] * len(self._told(ACTIVITIES)))

    def answers(self, settings: ActivitySettings) -> Sequence[object]:
        """Of each half second: what is suggested, and whether that is wrong."""
        return self._twice(self._told(settings))

    def _told(self, settings: ActivitySettings) -> list[str]:
        weights = weights_for(self.kept, group_of(self.look), settings.window_s, settings.hop_s)
        has_kind = self.look.example.kind is not None
        found = [one.said for one in answers(self.look, weights, self.name, settings)]
        return [
            NOTHING if said is None else _words(said.activity, said.kind if has_kind else None)
            for said in found
        ]

    def _twice(self, told: Sequence[str]) -> Sequence[object]:
        right = _words(self.look.example.activity, self.look.example.kind)
        return [part for one in told for part in (one, one not in (right, NOTHING))]


def _words(activity: str, kind: str | None) -> str:
    return str(activity) if kind is None else f"{activity}, {kind}"


def person_of(look: Look) -> str:
    """Of a trial: the simulated person, or the folder."""
    return look.example.person


def group_of(look: Look) -> Group:
    """What must not have taught the weights that judge it: the person, or of a recording the laboratory."""
    return look.source, person_of(look) if look.source == SIMULATED else ""


def teaches(look: Look, group: Group) -> bool:
    """Whether weights that judge a group may be learnt on it: simulated people are told by others alone."""
    return group_of(look) != group and (look.source == SIMULATED or group[0] != SIMULATED)


@cache
def looks(kept: Path) -> tuple[Look, ...]:
    """At all examples."""
    people = simulated((*TAUGHT, *JUDGED), kept / "sim")
    return tuple(looked_at(example) for example in (*people, *recorded(kept / "rec")))


@cache
def weights_for(kept: Path, group: Group, window_s: float, hop_s: float) -> Weights:
    """Learnt by windows of that length and distance on what may teach about a group."""
    return learnt([look for look in _looks_by_windows(kept, window_s, hop_s) if teaches(look, group)])


@cache
def _looks_by_windows(kept: Path, window_s: float, hop_s: float) -> tuple[Look, ...]:
    settings = replace(ACTIVITIES, window_s=window_s, hop_s=hop_s)
    return tuple(with_windows(look, settings) for look in looks(kept))


@cache
def known(kept: Path) -> tuple[Known, ...]:
    """Each trial nameless; recordings also by their own names."""
    named = [look for look in looks(kept) if look.source != SIMULATED]
    return (
        *(Known(kept, look, NAMELESS) for look in looks(kept)),
        *(Known(kept, look, look.example.trial.partition(" ")[2]) for look in named),
    )


def all_told(kept: str) -> list[list[object]]:
    """What is said of every trial in this process, with the constants as they are here."""
    return [list(one.answers(ACTIVITIES)) for one in known(Path(kept))]


def main() -> None:
    """Ask what has no answer yet, and write the page."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.activity_settings", description=__doc__)
    arguments.add_argument("--out", type=Path, required=True, help="folder of motions and answers")
    kept = arguments.parse_args().out
    questions = Questions(ACTIVITIES, partial(known, kept))
    asked(kept / ANSWERS, variations(ACTIVITIES, NOT_SHOWN, SHARES), questions.answer)
    numbers = ((number.called, factor, number) for number in NUMBERS for factor in FACTORS)
    found = asked(
        kept / ANSWERS,
        numbers,
        lambda v: questions.judged(v[0], v[1], answer_with(v[2], v[1], all_told, {"kept": str(kept)})),
    )
    usual = usual_of(found)["ActivitySettings"]
    text = INTRODUCTION.format(trials=len(looks(kept)), persons=len(usual.by_person), usual=100 * usual.wrong)
    rows = judged_tables([one for one in found if one is not usual], lambda _: usual, _place)
    PAGE.write_text("\n".join([text + rules(), "", *rows]), encoding="utf-8")


def _place(name: str) -> str:
    return place_of_number(name) if " " in name else place(name, {"ActivitySettings": "activities"})


if __name__ == "__main__":
    main()
