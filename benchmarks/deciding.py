"""Whether the short trial that a diagnosis proposes decides it: who hid the cause records it once more."""

import argparse
import json
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.hidden.cases import IDS, draw_setting, fits
from benchmarks.markdown import rate, table, write_section
from solver.capture.capture import Capture
from solver.capture.subject.opened_subject import open_subject
from solver.common.errors import SolverError
from solver.common.progress import silent
from solver.diagnosis.causes.catalogue import MARKER_IDS, catalogue
from solver.diagnosis.deciding.short_trials import short_trials
from solver.diagnosis.diagnose_subject import diagnosis_from, look_at
from solver.diagnosis.diagnosis import ToBeSure
from solver.diagnosis.diagnosis_report import DiagnosisReport
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.refinement import refine
from solver.fitting.settings import settings_for
from solver.simulate.demo_subject import MARKERS
from solver.simulate.faults.cases import CasePlan
from solver.simulate.faults.hidden import UNSIZED, Hidden, Recording, write_recording
from solver.simulate.faults.measurement_effects import MEASUREMENT, NoPlaceError, hide_measurement
from solver.simulate.faults.physical import PHYSICAL, hide_physical
from solver.simulate.faults.worlds import in_laboratory, plates_of, record, world_of
from solver.simulate.laboratory import MeasurementSettings, measure, recorded_markers
from solver.simulate.simulated_trial import Scenario, SyntheticTrial, simulate_trial
from solver.simulate.treadmill import read_belts

SURE = 0.9
ONCE = ("off_plate_step", "external_contact", "belt_acceleration")  # not there in the next trial
NEXT = "next"
SCALE_ERROR = 0.001  # relative
HEAD = ("further trial", "right and sure (≥ 90 %)", "then another name or none")


@dataclass(frozen=True)
class Tried:
    """One case with one more trial."""

    case: int
    hidden: str
    way: str  # proposed, random, or another one of the list
    trial: str
    before: float  # confidence of the right name, 0 where another one is surer
    after: float
    predicted_nats: float  # for the right one of the two
    came_nats: float  # NaN: neither is right, or it is not known


def draw(number: int) -> CasePlan:
    """A case: a person, a laboratory and what is hidden there."""
    rng = np.random.default_rng([51, number])
    world, handout, seed = draw_setting(rng)
    id = str(rng.choice([i for i in IDS if i not in MARKER_IDS and fits(i, world)]))
    least = 2.0 if world.activity == "squat" else 1.0
    size = 1.0 if id in UNSIZED else float(rng.choice((0.5, 0.75, 1.0, 1.5))) * least
    return CasePlan(f"case_{number}", "single", (id,), (size,), replace(world, trials=1), handout, seed)


class Laboratory:
    """A case's person with what is hidden, ready to be recorded again."""

    def __init__(self, plan: CasePlan) -> None:
        self.plan, self.id, self.world = plan, plan.ids[0], world_of(plan.world)
        self.first, self.seed = self.world.trial, int(np.random.default_rng(plan.seed).integers(2**31))
        effect = None
        if self.id in PHYSICAL:
            rng = np.random.default_rng(self.seed)
            self.first, effect = hide_physical(self.world, self.id, plan.sizes[0], rng)
        self.lasting = self.world.trial if self.id in ONCE else self.first  # what is on the person stays
        self.clean = record(self.world, [self.first], plan.handout)
        self.recording, measured = self._hidden_in(self.clean)
        self.effect = effect or measured
        self.order = -1 if plan.world.layout == "treadmill" and not plan.world.right_plate_first else 1
        self.plates = plates_of(self.world)[:: self.order]  # as in the files

    def _hidden_in(self, recording: Recording) -> tuple[Recording, Hidden | None]:
        hide, rng = self.id in MEASUREMENT, np.random.default_rng(self.seed)
        return hide_measurement(recording, self.id, self.plan.sizes[0], rng) if hide else (recording, None)

    def with_next(self, kind: str, targets: Sequence[str]) -> Recording:
        """The recording and one more trial of the list; NoPlaceError: something else would be hidden."""
        if kind == "scale":
            error = SCALE_ERROR * np.random.default_rng([self.seed, 2]).standard_normal()
            return replace(self.recording, scale_kg=self.lasting.body.skeleton.mass * (1 + error))
        trial = self._stood(kind, targets) if targets else self._walked(kind)
        handout, floor = self.plan.handout, plates_of(self.world)
        markers, forces = np.random.default_rng([handout.seed, 1]).spawn(2)
        settings = MeasurementSettings(marker_noise_m=handout.marker_noise_m, zeroed=handout.zeroed)
        if self.plan.world.layout == "treadmill" and not targets:
            read = read_belts(trial, (floor[0], floor[1]), settings, forces)[:: self.order]
        else:
            read = measure(trial, self.plates, ("C7",), settings, forces).plates
        read = tuple(replace(p, name=f"ground_force_{k + 1}") for k, p in enumerate(read))
        more = Capture(NEXT, recorded_markers(trial, MARKERS, settings, markers), read)
        if self.id in ONCE:
            return replace(self.recording, trials=(*self.recording.trials, more))
        both, effect = self._hidden_in(replace(self.clean, trials=(*self.clean.trials, more)))
        if effect and self.effect and effect.target != self.effect.target:
            raise NoPlaceError(f"{self.plan.name}: hidden at another place in the next trial.")
        return both

    def _walked(self, kind: str) -> SyntheticTrial:
        world, plan, there = self.world, self.plan.world, self.lasting
        scenario = replace(world.walk_overground.scenario, name=NEXT)
        rng = np.random.default_rng(self.seed + 1)
        if kind == "faster":
            scenario, plan = (replace(one, speed=1.2 * plan.speed) for one in (scenario, plan))
        if kind == "back":
            x, z = 2 * np.mean([p.centre for p in self.plates], axis=0)
            scenario, rng = replace(scenario, heading_deg=180.0, centre=(float(x), float(z))), world.steps()
        body = there.body if there.external is None else world.body
        trial = in_laboratory(simulate_trial(scenario, body, rng), plan)
        return replace(trial, body=there.body, external=there.external)

    def _stood(self, kind: str, targets: Sequence[str]) -> SyntheticTrial:
        plates = [self.plates[int(t.removeprefix("plate_")) - 1] for t in targets]
        x, z = np.mean([p.centre for p in plates], axis=0)
        apart = plates[0].centre_ground - plates[-1].centre_ground
        scenario = Scenario(
            NEXT,
            "stand" if kind == "turned" else kind,  # type: ignore[arg-type]
            duration={"squat": 5.0, "bend": 4.0, "shift": 4.0}.get(kind, 3.0),
            heading_deg=180.0 if kind == "turned" else float(np.degrees(np.arctan2(apart[0], apart[2]))),
            centre=(float(x), float(z)),
            width=float(np.linalg.norm(apart)) or None,
        )
        return simulate_trial(
            scenario, self.lasting.body, np.random.default_rng(self.seed + 1), self.lasting.external
        )


def diagnosed(recording: Recording) -> tuple[DiagnosisReport, Balance]:
    """What the files of a recording say."""
    with tempfile.TemporaryDirectory() as folder:
        write_recording(Path(folder) / "subject", recording)
        subject = open_subject(Path(folder) / "subject")
        found = look_at(subject, settings_for(subject.folder), trials=None, reviews={}, progress=silent)
        return diagnosis_from(found), found.balance


def is_right(id: str, target: str, hidden: Hidden) -> bool:
    """Whether a name says what was hidden, and where."""
    places = [sorted(place.split("+")) for place in (hidden.target, *hidden.same_as)]
    return id == hidden.id and sorted(target.split("+")) in places


def confidence(answer: DiagnosisReport, hidden: Hidden) -> float:
    """Of the right name; 0 where it is not the surest."""
    return next((e.confidence for e in answer.effects[:1] if is_right(e.id, e.target, hidden)), 0.0)


def nats_between(balance: Balance, asked: ToBeSure, answer: DiagnosisReport) -> float:
    """Log evidence of a name against its rival, beside the other names; NaN where one cannot be refitted."""
    rest = [(e.id, e.target) for e in answer.effects if (e.id, e.target) != (asked.id, asked.target)]
    rival = [(asked.other_id, asked.other_target)] if asked.other_target else []
    return _evidence(balance, [*rest, (asked.id, asked.target)]) - _evidence(balance, [*rest, *rival])


def _evidence(balance: Balance, keys: Sequence[tuple[str, str]]) -> float:
    terms, solved = [], balance.solve([])
    for key in (key for key in keys if key[0] not in MARKER_IDS):
        some = [c for c in catalogue(balance.scenes, balance.paths) if c.key == key]
        starts = [balance.term(c, eta) for c in some for eta in c.starts(balance.scenes)]
        tried = [(balance.solve_at([*terms, t], solved.noise_scale).log_evidence, t) for t in starts if t]
        if not tried:
            return np.nan
        terms.append(max(tried, key=lambda one: one[0])[1])
        for _ in range(2):  # at the noise scale before, and at its own
            terms[-1] = refine(balance, terms[-1], terms[:-1], solved.noise_scale)
            solved = balance.solve(terms, near=solved.noise_scale)
    return solved.log_evidence


def played(number: int, *, every: bool) -> Iterator[Tried]:
    """A case with the proposed trial, a random one, and others on demand; nothing where its name is sure."""
    try:
        laboratory = Laboratory(draw(number))
        answer, balance = diagnosed(laboratory.recording)
    except (NoPlaceError, SolverError):
        return
    if (asked := answer.to_be_sure) is None or (hidden := laboratory.effect) is None:
        return
    listed = list(short_trials(balance.scenes[0], f"{asked.target}+{asked.other_target}".split("+")))
    other = listed[int(np.random.default_rng([number, 2]).integers(len(listed)))]
    ways = [("proposed", asked.trial, asked.plates)] if asked.trial else []
    ways.append(("random", other.kind.id, other.plates))
    ways += [("other", t.kind.id, t.plates) for t in listed if every]
    before = nats_between(balance, asked, answer)
    rivals = ((asked.id, asked.target, 1.0), (asked.other_id, asked.other_target, -1.0))
    sign = next((s for id, target, s in rivals if is_right(id, target, hidden)), np.nan)
    for way, kind, plates in ways:
        try:
            both, after = diagnosed(laboratory.with_next(kind, plates))
        except (NoPlaceError, SolverError):
            continue
        came = sign * (nats_between(after, asked, answer) - before) if way == "proposed" else np.nan
        nats = asked.nats if sign > 0 else asked.nats_if_other
        what, name = " ".join((kind, *plates)), f"{hidden.id} {hidden.target}"
        yield Tried(number, name, way, what, confidence(answer, hidden), confidence(both, hidden), nats, came)


def summary(tried: Sequence[Tried]) -> str:
    """The section of the page."""
    ways = {way: [o for o in tried if o.way == way] for way in ("proposed", "random", "other")}
    every, asked, listed = ({o.case for o in some} for some in (tried, ways["proposed"], ways["other"]))
    sure, lost = ({w: sum(f(o.after) for o in ways[w]) for w in ways} for f in (SURE.__le__, (0.0).__ge__))
    rows = [(w, rate(sure[w], len(every)), rate(lost[w], len(ways[w]))) for w in ("proposed", "random")]
    left = listed - {o.case for o in ways["proposed"] if o.after >= SURE}
    best = rate(len({o.case for o in tried if o.case in left and o.after >= SURE}), len(left))
    others = f"Of {len(left)} that this leaves unsure, another one decides {best}.\n\n" if left else ""
    came = [o.came_nats / o.predicted_nats for o in ways["proposed"] if np.isfinite(o.came_nats)]
    ratio = np.array(came or [np.nan])
    off, (low, middle, high) = 100 * np.median(np.abs(ratio - 1)), np.quantile(ratio, (0.25, 0.5, 0.75))
    return (
        "## A trial to be sure\n\nHidden causes of 0.5 to 1.5 reference sizes whose name is less sure than "
        "90 %, recorded once more: the trial that the diagnosis proposes, and a random one of the list. "
        f"In {len(asked)} of {len(every)} cases it proposes one.\n\n{table(HEAD, rows)}\n\n"
        f"{others}Nats between the name and the rival that it is told from, where one of them is right "
        f"({len(came)} cases): those that come differ from the predicted ones by {off:.0f} %, "
        f"and are {middle:.2f} times as many, in the median; {low:.2f} to {high:.2f} in the middle half."
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path, help="every finished case, a line each")
    parser.add_argument("cases", type=int, nargs="*", help="numbers; none: write the section")
    parser.add_argument("--every", action="store_true", help="each trial of the list")
    given = parser.parse_args()
    with given.out.open("a") as file:
        tried = [Tried(**json.loads(line)) for line in given.out.read_text().splitlines()]
        for number in given.cases:
            for one in () if number in {t.case for t in tried} else played(number, every=given.every):
                tried.append(one)
                print(json.dumps(asdict(one)), file=file, flush=True)
    if not given.cases:
        write_section(Path(__file__).parent / "HIDDEN.md", "deciding", summary(tried))


if __name__ == "__main__":
    main()
