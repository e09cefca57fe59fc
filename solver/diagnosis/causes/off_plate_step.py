"""Off-plate step: a foot stands on the ground where no plate measures it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.common.true_runs import runs
from solver.contact.contact_phases import contact_phases
from solver.contact.detected_ranges import CLIPPED, OUTLIERS, within
from solver.diagnosis.causes.about import (
    About,
    Arrow,
    AtFault,
    CorrectedBy,
    Entry,
    Named,
    Reading,
    Steady,
    TimeHistory,
)
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Fitted, InPieces, Range, Signature
from solver.diagnosis.causes.observed_trial import Scene, force_at
from solver.diagnosis.causes.time_history import Stretch, frames_of, join, stretch_of
from solver.skeleton.forward import cross

KNOTS_S = 0.07  # a heel strike rises in as much; the two peaks of a step are 0.3 s apart
TANGENT_KNOTS_S = 0.10  # braking and pushing off
SLOW_KNOTS_S = 0.25  # the centre of pressure wanders aside slowly
LEAST_SHARE = 0.12  # of body weight, mean over the stance
PRESS_SHARE = 0.05  # of body weight: where a stance begins and ends
LEAST_PRESSING = 0.9  # of the impulse, pulls and presses counted alike: noise pulls where little presses
HEEL_OR_TIP_SHARE = 0.7  # of the load
TANGENT_SHARE = 0.2  # of the load
MOST_WALKING = 1.5  # of body weight, however fast; a runner's ground carries up to three times body weight
SIDEWAYS_M = 0.02  # of the centre of pressure from the sole's middle line
TWIST_M = 0.008  # free moment over vertical force
UP = 1  # y, among the components of a force
EDGE_S = 0.04  # how early and late a sole's motion and a detection may see a contact
SUSPECT_SHARE = 0.08  # of body weight, mean over a stance: worth trying
SUSPECT_ONE_SIGNED = 0.7  # of its frames lack force
GROSS_SHARE = 0.3  # of body weight, likewise: nothing else is looked for there
SHORTEST_SHARE = 0.4  # of the subject's median stance
SHORTEST_S = 0.06  # where no whole stance is known
PLATES_OWN = (CLIPPED, OUTLIERS)  # reasons of proposals that say nothing of where a foot stands


@dataclass(frozen=True)
class OffPlateStance:
    """A foot that may stand beside the plates."""

    foot_body: str
    stretch: Stretch
    gross: bool  # no plate carries the foot, and much of body weight is lacking
    load_N: float  # of which the shares below are: body weight in walking, more in running


def off_plate_stances(scenes: Sequence[Scene]) -> list[OffPlateStance]:
    """Foot by foot in order of time: long enough, and a deficit of one sign over most of it.

    A foot stands there by its motion or because the detection thinks so, and no plate carries it.
    """
    shortest = shortest_stance_s(scenes)
    found = []
    for scene in scenes:
        missing, counted = missing_force(scene) / scene.weight_N, np.pad(scene.counts, 1)
        for foot, sole in enumerate(scene.soles):
            carried = scene.contacts.in_contact[:, scene.contacts.foot_bodies.index(sole.foot_body)]
            suspects = []
            for start, end in seems_to_stand(scene, foot):
                cut_off = not (counted[start] and counted[end + 1])  # the frames beside it
                lacks = missing[start:end]
                if (end - start) / scene.rate < (SHORTEST_S if cut_off else shortest):
                    continue
                if lacks.mean() > SUSPECT_SHARE and (lacks > 0).mean() > SUSPECT_ONE_SIGNED:
                    suspects.append(stretch_of(scene, start, end).widen(EDGE_S))
            for stretch in join(suspects):
                inside = slice(stretch.start, stretch.end)
                gross = (
                    missing[inside].mean() > GROSS_SHARE and carried[inside].mean() < 1 - SUSPECT_ONE_SIGNED
                )
                load_N = scene.weight_N * max(1.0, float(missing[inside].max()) / MOST_WALKING)
                found.append(OffPlateStance(sole.foot_body, stretch, bool(gross), load_N))
    return found


def missing_force(scene: Scene) -> Float[np.ndarray, " frames"]:
    """Vertical force that the motion demands beyond what was recorded, low-passed [N]."""
    return scene.missing_ground[:, UP]


def seems_to_stand(scene: Scene, foot: int) -> list[tuple[int, int]]:
    """Stretches on which a foot stands by its motion and no plate carries it, or the detection thinks so.

    What the detection proposes is there by itself as well: by its motion a foot may stand before it lands.
    Frames that don't count are not there: of a force that is missing there nothing is known.
    """
    body = scene.soles[foot].foot_body
    column = scene.contacts.foot_bodies.index(body)
    standing = np.zeros(scene.frames, dtype=bool)
    phases = contact_phases(
        scene.contacts,
        scene.R_ground_body,
        scene.p_ground_body,
        skeleton=scene.skeleton,
        rate=scene.rate,
        settings=scene.contact_settings,
    )
    for phase in phases:
        if phase.foot == column:
            standing[phase.start : phase.end] = True
    standing &= ~scene.contacts.in_contact[:, column]
    own = [p for p in scene.proposals if p.foot == body and p.reason not in PLATES_OWN]
    proposed = [p.range for p in within(own, scene.counts)]
    for start, end in proposed:
        standing[start:end] = True
    return [*runs(standing & scene.counts), *proposed]


def shortest_stance_s(scenes: Sequence[Scene]) -> float:
    """Least duration of a missing stance, from the measured ones [s]."""
    lengths = [
        (end - start) / scene.rate
        for scene in scenes
        for foot in scene.contacts.in_contact.T
        for start, end in runs(foot)
        if start > 0 and end < scene.frames
    ]
    return max(SHORTEST_S, SHORTEST_SHARE * float(np.median(lengths))) if lengths else SHORTEST_S


@dataclass(frozen=True)
class OffPlateStep(InPieces):
    """In each stance a free time history of force through the foot's sole.

    The vertical force is shared between heel and tip, so that the centre of pressure lies between them as
    long as both press; histories of tangential force act at a sole's middle; couples for a centre of pressure
    aside of the middle line and for a free moment complete the wrench.
    """

    stances: tuple[OffPlateStance, ...] = ()  # of any trials, each with parameters of its own

    about = About(
        id="off_plate_step",
        entry=Entry(
            "foot",
            "a foot stands where no plate measures it",
            "`force_y_N` (mean), `weight_share` (of body weight)",
        ),
        title="a step that no plate measured: {target}",
        sentence="No plate measures the force under {target}: no plate is there, or it recorded nothing.",
        remedy="Flag these frames, unless detection left them out already, or repeat the trial with every "
        "step on a plate.",
        separate_by="a trial with every step on a plate",
        branch="ground/missed step",
        names=Named.BODIES,
        at_fault=AtFault.MOVEMENT,
        time_history=TimeHistory.NOW_AND_THEN,
        corrected_by=CorrectedBy.FLAGGED,
        seen_standing=True,
        readings=(
            Reading("force_y_N", "the ground carries {amount} there on average", "N"),
            Reading("weight_share", "that is {amount} of body weight", "%", 1e2),
        ),
        picture=Arrow(Steady(upward="force_y_N"), like_ground_force=True, mean_on_label=True),
    )

    def pieces(self, scene: Scene, eta: Eta) -> Iterator[Signature]:
        """Columns of all stances one after another; zero for those of other trials."""
        if scene.name not in {s.trial for s in self._stretches}:
            return
        for stance in self.stances:
            columns = (
                _columns(scene, stance)
                if stance.stretch.trial == scene.name
                else np.zeros((scene.frames, 6, _count(stance.stretch)))
            )
            yield Signature(columns, stance.load_N * _prior_shares(stance.stretch))

    def estimates(self, scenes: Sequence[Scene], fit: Fitted) -> dict[str, Estimate]:
        """force_y_N: mean vertical force; weight_share: of body weight; pressing_share: of the impulse."""
        trials = {s.trial for s in self._stretches}
        own, weight = [scene for scene in scenes if scene.name in trials], scenes[0].weight_N
        inside = {scene.name: frames_of(self._stretches, scene) for scene in own}
        time_history = self._vertical_sums(own) / sum(int(frames.sum()) for frames in inside.values())
        mean, std = float(time_history @ fit.x), float(np.sqrt(time_history @ fit.covariance @ time_history))
        force = np.concatenate([self._vertical(scene, fit.x)[inside[scene.name]] for scene in own])
        pressing = force.clip(min=0).sum() / max(np.abs(force).sum(), np.finfo(float).tiny)
        return {
            "force_y_N": Estimate(mean, std),
            "weight_share": Estimate(mean / weight, std / weight),
            "pressing_share": Estimate(float(pressing), 0.0),
        }

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """The ground presses and hardly pulls, and not by a trifle."""
        enough = estimates["weight_share"].value > LEAST_SHARE
        return enough and estimates["pressing_share"].value > LEAST_PRESSING

    def frames(
        self, scenes: Sequence[Scene], eta: Eta, x: Float[np.ndarray, " parameters"]
    ) -> tuple[Range, ...]:
        """Where the ground pressed, stance by stance."""
        weight, found = scenes[0].weight_N, []
        trials = {s.trial for s in self._stretches}
        force = {scene.name: self._vertical(scene, x) for scene in scenes if scene.name in trials}
        for s in self._stretches:
            share = force[s.trial][s.start : s.end] / weight if s.trial in force else np.zeros(1)
            if share.mean() > LEAST_SHARE:
                first, last = max(runs(share > PRESS_SHARE), key=lambda run: run[1] - run[0])
                found.append(Range(s.trial, s.start + first, s.start + last))
        return tuple(found)

    def _vertical(self, scene: Scene, x: Float[np.ndarray, " parameters"]) -> Float[np.ndarray, " frames"]:
        """The vertical force of all stances of a trial [N]: what presses on heel and tip."""
        force, first = np.zeros(scene.frames), 0
        for stretch in self._stretches:
            if stretch.trial == scene.name:
                pressing = stretch.sparse_humps(KNOTS_S)
                heel, tip = x[first:][: 2 * pressing.shape[1]].reshape(2, -1)
                force[stretch.start : stretch.end] += pressing @ (heel + tip)
            first += _count(stretch)
        return force

    def _vertical_sums(self, scenes: Sequence[Scene]) -> Float[np.ndarray, " parameters"]:
        """The vertical force that a unit of each parameter makes, summed over the frames of these trials."""
        sums = []
        for stretch in self._stretches:
            own = np.zeros(_count(stretch))
            if stretch.trial in {scene.name for scene in scenes}:
                pressing = np.asarray(stretch.sparse_humps(KNOTS_S).sum(axis=0))
                own[: 2 * len(pressing)] = np.tile(pressing, 2)
            sums.append(own)
        return np.concatenate(sums)

    @property
    def _stretches(self) -> tuple[Stretch, ...]:
        return tuple(stance.stretch for stance in self.stances)

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """One for each foot that seems to stand while the balance lacks a force; and for all together.

        Where several feet step beside the plates in turn, each alone leaves so much that all else looks
        better.
        Where only some of a foot's stances lack most of their force, these are also tried without the others:
        whatever carries the person all the time makes every stance lack something.
        """
        suspects = off_plate_stances(scenes)
        feet = list(dict.fromkeys(s.foot_body for s in suspects))
        gross = tuple(s for s in suspects if s.gross)
        made: list[Candidate] = []
        for foot in feet:
            own, own_gross = (tuple(s for s in some if s.foot_body == foot) for some in (suspects, gross))
            made += [cls(foot, some) for some in dict.fromkeys((own, own_gross)) if some]
        missing = list(dict.fromkeys(s.foot_body for s in gross))
        return [*made, cls("+".join(missing), gross)] if len(missing) > 1 else made


def _columns(scene: Scene, stance: OffPlateStance) -> Float[np.ndarray, "frames 6 parameters"]:
    heel, tip, left = sole_line(scene, stance.foot_body)
    pressing, tangent, slow = (
        stance.stretch.humps(spacing).T for spacing in (KNOTS_S, TANGENT_KNOTS_S, SLOW_KNOTS_S)
    )
    forward, up, side = np.eye(3)
    columns = [
        force_at(time_history[:, None] * up, point) for point in (heel, tip) for time_history in pressing
    ]
    middle = (heel + tip) / 2
    columns += [
        force_at(time_history[:, None] * axis, middle) for axis in (forward, side) for time_history in tangent
    ]
    couples = [time_history[:, None] * axis for axis in (cross(left, up), up) for time_history in slow]
    columns += [np.concatenate([np.zeros_like(couple), couple], axis=1) for couple in couples]
    return np.stack(columns, axis=-1)


def _count(stance: Stretch) -> int:
    return 2 * sum(stance.hump_count(s) for s in (KNOTS_S, TANGENT_KNOTS_S, SLOW_KNOTS_S))


def _prior_shares(stance: Stretch) -> Float[np.ndarray, " parameters"]:
    """Prior standard deviations over the load; of couples in metres."""
    pressing, tangent, slow = (stance.hump_count(s) for s in (KNOTS_S, TANGENT_KNOTS_S, SLOW_KNOTS_S))
    shares = [HEEL_OR_TIP_SHARE, TANGENT_SHARE, SIDEWAYS_M, TWIST_M]
    return np.repeat(shares, [2 * pressing, 2 * tangent, slow, slow])


def sole_line(
    scene: Scene, foot_body: str
) -> tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 3"]]:
    """Heel and tip of a sole at the height of its lowest corner [m], and the direction to its left."""
    sole = next(s for s in scene.soles if s.foot_body == foot_body)
    corners = sole.corners_ground(scene.R_ground_body, scene.p_ground_body)
    rear, front = len(sole.parts[0].corners_body), len(sole.parts[-1].corners_body)
    last = corners.shape[1] - front + front // 2  # outlines run forward on the right, back on the left
    heel, tip = corners[:, [0, rear - 1]].mean(axis=1), corners[:, [last - 1, last]].mean(axis=1)
    heel[:, UP] = tip[:, UP] = corners[:, :, UP].min(axis=1)
    along = tip - heel
    left = cross(np.array([0.0, 1.0, 0.0]), along)
    return heel, tip, left / np.maximum(np.linalg.norm(left, axis=1, keepdims=True), 1e-9)
