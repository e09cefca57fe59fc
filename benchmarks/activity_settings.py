"""What a number decides of suggested activities: each halved and doubled, judged by what trials show.

    python -m benchmarks.activity_settings --out DIR

The recordings and the simulated people of `benchmarks.activities`, each half second in which the activity is
known; weights are learnt anew where windows or features are others, and never on the person or the laboratory
that they judge. Motions and answers are kept in DIR: it picks up where it was stopped, then writes
ACTIVITY_SETTINGS.md.
"""

import argparse
import pickle
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path

from benchmarks.activities.examples import SIMULATED
from benchmarks.activities.judging import NAMELESS, NOTHING, answers
from benchmarks.activities.learning import learnt
from benchmarks.activities.looking import Look, looked_at, with_windows
from benchmarks.activities.performed import performed
from benchmarks.activities.recorded import recorded
from benchmarks.activities.simulated import JUDGED, TAUGHT, simulated
from benchmarks.rewriting import Number, answer_with
from benchmarks.varied import (
    FACTORS,
    Answer,
    Questions,
    Variation,
    asked,
    judged_tables,
    place,
    rules,
    usual_of,
    variations,
)
from solver.gait.activity import Activity
from solver.gait.activity_model import Weights, learnt_weights
from solver.gait.activity_settings import ACTIVITIES, ActivitySettings

PAGE = Path(__file__).with_name("ACTIVITY_SETTINGS.md")
ANSWERS = "activities.jsonl"
PERFORMED = "Performed"  # the answer of puppets, with all as usual
BY_PUPPETS = (
    "riser_m", "ramp", "box_m", "flight_s", "pause_s", "lunge_step", "still", "walking_m_s", "one_foot_s",
)  # fmt: skip
FOOTHOLDS = Number("gait/body_motion.py", "AMID")  # asked of those of them who go on
GOING = "Going"  # their answer, with all as usual
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

Of a share that double would make larger than one, double halves what is missing to one.

{by_puppets},
and `AMID` of `gait/body_motion.py`, are asked of what one has no recording of: stairs, ramps, lunges, jumps,
standing on one foot, starting to walk and ending; and of what looks like these: level floors, staggered
squats, a foot that is set anew. {puppets} puppets of different sizes perform them, moved by where their feet
stand and how high their hips are, in sizes from building codes and papers ([how](activities/performed.py));
the weights have never seen them. {of_puppets:.2f} % of these answers are wrong as it is; of stairs, ramps and
floors alone, about which `AMID` is asked, {of_going:.2f} %. Puppets are no people: who limps, leans on a rail
or hesitates is not there. Little speaks for `one_foot_s` and `still`: with no value are one foot, starts and
ends recognised much ([how it is](../docs/gait.md#activities)); they are judged by what they leave alone.

Most of these numbers were settled while the same recordings were looked at: that half and double are no
better here does not say so of others.

"""


@dataclass(frozen=True, eq=False)
class Known:
    """A trial of which it is known what happens in it, by one of its names."""

    look: Look
    name: str
    weights: Callable[[ActivitySettings], Weights]

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
        has_kind = self.look.example.kind is not None
        found = [one.said for one in answers(self.look, self.weights(settings), self.name, settings)]
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

    def knowing(look: Look, name: str) -> Known:
        group = group_of(look)
        return Known(look, name, lambda by: weights_for(kept, group, by.window_s, by.hop_s))

    named = [look for look in looks(kept) if look.source != SIMULATED]
    return (
        *(knowing(look, NAMELESS) for look in looks(kept)),
        *(knowing(look, look.example.trial.partition(" ")[2]) for look in named),
    )


def all_told(kept: str) -> list[list[object]]:
    """What is said of every trial in this process, with the constants as they are here."""
    return [list(one.answers(ACTIVITIES)) for one in known(Path(kept))]


@cache
def puppets() -> tuple[Known, ...]:
    """What is performed."""
    return tuple(_by_puppet(looked_at(one)) for one in performed())


@cache
def going(kept: Path) -> tuple[Known, ...]:
    """Stairs, ramps and floors of it; how they were looked at is kept in a folder."""
    file = kept / "going.pickle"
    if not file.exists():
        known = (Activity.STAIRS, Activity.WALKING)
        chosen = [one for one in performed() if one.kind is not None and one.activity in known]
        file.write_bytes(pickle.dumps([looked_at(one) for one in chosen]))
    return tuple(_by_puppet(look) for look in pickle.loads(file.read_bytes()))


def _by_puppet(look: Look) -> Known:
    """Judged by the weights of the package, which never saw it."""
    return Known(look, NAMELESS, lambda _: learnt_weights())


def told_of_going(kept: str) -> list[list[object]]:
    """What is said of stairs, ramps and floors in this process, with the constants as they are here."""
    return [list(one.answers(ACTIVITIES)) for one in going(Path(kept))]


def of_puppets() -> Iterator[Variation]:
    """All as usual, then half and double of what only puppets show."""
    yield PERFORMED, 1.0, ACTIVITIES
    yield from (one for one in variations(ACTIVITIES) if is_of_puppets(one[0]))


def is_of_puppets(name: str) -> bool:
    """Whether all that is performed judges a setting."""
    return name.partition(".")[2] in BY_PUPPETS


def main() -> None:
    """Ask what has no answer yet, and write the page."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.activity_settings", description=__doc__)
    arguments.add_argument("--out", type=Path, required=True, help="folder of motions and answers")
    kept = arguments.parse_args().out
    questions = Questions(ACTIVITIES, partial(known, kept))
    asked(kept / ANSWERS, variations(ACTIVITIES, BY_PUPPETS, SHARES), questions.answer)
    numbers = ((number.called, factor, number) for number in NUMBERS for factor in FACTORS)
    asked(
        kept / ANSWERS,
        numbers,
        lambda v: questions.judged(v[0], v[1], answer_with(v[2], v[1], all_told, {"kept": str(kept)})),
    )
    asked(kept / ANSWERS, of_puppets(), Questions(ACTIVITIES, puppets).answer)
    on_foot = Questions(ACTIVITIES, partial(going, kept))
    asked(kept / ANSWERS, [(GOING, 1.0, ACTIVITIES)], on_foot.answer)
    found = asked(
        kept / ANSWERS,
        ((FOOTHOLDS.called, factor, FOOTHOLDS) for factor in FACTORS),
        lambda v: on_foot.judged(v[0], v[1], answer_with(v[2], v[1], told_of_going, {"kept": str(kept)})),
    )
    usuals = usual_of([one for one in found if one.factor == 1.0])
    usual, performed_usually = usuals["ActivitySettings"], usuals[PERFORMED]

    def before(name: str) -> Answer:
        if name == FOOTHOLDS.called:
            return usuals[GOING]
        return performed_usually if is_of_puppets(name) else usual

    text = INTRODUCTION.format(
        trials=len(looks(kept)),
        persons=len(usual.by_person),
        usual=100 * usual.wrong,
        by_puppets=", ".join(f"`{name}`" for name in BY_PUPPETS),
        puppets=len(performed_usually.by_person),
        of_puppets=100 * performed_usually.wrong,
        of_going=100 * usuals[GOING].wrong,
    )
    judged = [one for one in found if one.setting not in usuals]
    rows = judged_tables(judged, before, lambda name: place(name, {"ActivitySettings": "activities"}))
    PAGE.write_text("\n".join([text + rules(), "", *rows]), encoding="utf-8")


if __name__ == "__main__":
    main()
