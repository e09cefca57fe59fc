"""External contact: something that nobody measures pushes or pulls at a segment."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.diagnosis.causes.about import (
    NOT_SHOWN,
    ON_SEGMENT,
    About,
    Arrow,
    AtFault,
    Entry,
    Named,
    Place,
    Reading,
    Steady,
    TimeHistory,
    along,
)
from solver.diagnosis.causes.contact_windows import HOP_S, INDEPENDENT_HOPS, UP, contact_windows
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Fitted, InPieces, Range, Signature
from solver.diagnosis.causes.observed_trial import Scene, force_at
from solver.diagnosis.causes.off_plate_step import off_plate_stances
from solver.diagnosis.causes.on_segments import BETWEEN_OTHERS_ODDS, columns_at_point, inner_segments
from solver.diagnosis.causes.time_history import Stretch, frames_of, join
from solver.skeleton.forward import cross
from solver.skeleton.skeleton import Body

KNOTS_S = 0.10  # a hand's push grows and fades no faster
MOST_KNOTS = 20  # a long hold changes slowly
EDGE_S = 0.05  # by which its time history goes beyond a window found in the balance
WHOLE_S = 0.08  # by which the contact does: windows end at half the force, and a push grows over 0.1 to 0.2 s
EDGE_STD_S = 0.06  # of either end
LIGHTEST_SHARE = 0.003  # of body mass: less than a hand, more than a kneecap
PRIOR_N = 60.0  # a hand on a rail; what the balance lacks where that is more
CHANGE_SHARE = 0.5  # of the force's scale: how much its time history differs from a constant
LEAST_REACH_M = 0.05  # from a segment's centre of mass to where it is touched, beside its radius of gyration
MOMENT_SHARE_M = 0.012  # error of the balance's moments over body weight, for finding the point
INDEPENDENT_S = INDEPENDENT_HOPS * HOP_S  # how long an error of the balance lasts
MOST_BODIES = 8
MOST_ALONE = 4  # windows that are also tried without the others
MOST_SHARE = 0.95  # of a trial, for a contact to be one that begins or ends in it
LEAST_N = 15.0  # a sleeve caught on a rail
MOST_WEIGHTS = 1.5  # on average: a seat carries one; opposite forces on near segments would grow without end

Missing = Mapping[str, Float[np.ndarray, "frames 6"]]  # by trial: what the balance lacks, weight corrected


@dataclass(frozen=True)
class ExternalContact(InPieces):
    """In each window a free time history of force at one point of the body.

    Each axis has a constant and splines about it, at the segment's centre of mass. The point's way d from
    there is bilinear with the force f: columns (0, R eᵢ × f) for its components take f from the balance.
    """

    windows: tuple[Stretch, ...] = ()  # of any trials, each with parameters of its own
    scales_N: tuple[float, ...] = ()  # of the force in each window
    wrong_weights_N: tuple[tuple[str, float], ...] = ()  # missing upward all along, by trial
    between_others: bool = False
    weight_N: float = np.inf  # of the person

    about = About(
        id="external_contact",
        entry=Entry(
            "body",
            "something pushes or pulls for a while",
            (
                "`force_x_N`, `force_y_N`, `force_z_N` (mean, on the person), `point_x_m`, `point_y_m`, "
                "`point_z_m` (in the body)"
            ),
        ),
        title="an unmeasured contact: {target}",
        sentence=("Something that no plate measures pushes or pulls at {target}: a seat, a rail, a hand."),
        remedy=("Look at the video for what touches the person there, keep it away, or put a sensor on it."),
        separate_by="the same movement without anything within reach",
        branch="on the person/touch",
        names=Named.BODIES,
        at_fault=AtFault.MOVEMENT,
        time_history=TimeHistory.NOW_AND_THEN,
        odds_against=4.0,
        readings=(
            *along("force_{}_N", "mean force on the person {{amount}} towards {{which}}", "N", axes="x"),
            Reading("force_y_N", "{amount} {which}", "N", which=("upwards", "downwards")),
            *along("force_{}_N", "{{amount}} towards {{which}}", "N", axes="z"),
            Place(
                "point_{}_m", f"it acts {ON_SEGMENT}", "mm", 1e3, f"where on the segment it acts, {NOT_SHOWN}"
            ),
        ),
        picture=Arrow(Steady("force_{}_N"), "point_{}_m", mean_on_label=True),
    )

    @property
    def place_odds(self) -> float:
        """Hands reach, seats and rails meet trunk and thighs; what is between is touched in passing."""
        return BETWEEN_OTHERS_ODDS if self.between_others else 0.0

    def pieces(self, scene: Scene, eta: Eta) -> Iterator[Signature]:
        """Constants and splines of every window, then shifts of the point."""
        if scene.name not in {w.trial for w in self.windows}:
            return
        body = scene.skeleton.body_index(self.target)
        segment = scene.skeleton.bodies[body]
        place = scene.point_ground(body, segment.com_body)
        eased = np.zeros((scene.frames, 1))
        for window, scale in zip(self.windows, self.scales_N, strict=True):
            time_histories = _time_histories(window)
            columns = np.zeros((scene.frames, 6, 3 * time_histories.shape[1]))
            if window.trial == scene.name:
                moving = [force_at(c[:, None] * axis, place) for axis in np.eye(3) for c in time_histories.T]
                columns = np.stack(moving, axis=-1)
                eased += time_histories[:, :1]
            shares = np.array([1.0, *([CHANGE_SHARE] * (time_histories.shape[1] - 1))])
            yield Signature(columns, np.tile(scale * shares, 3))
        force = eased * _missing_ground(scene, dict(self.wrong_weights_N).get(scene.name, 0.0))[:, :3]
        shifts = columns_at_point(scene, body, segment.com_body, force)[:, :, 1:]
        yield Signature(shifts, np.full(3, reach_m(segment)))

    def estimates(self, scenes: Sequence[Scene], fit: Fitted) -> dict[str, Estimate]:
        """Mean force on the person while in contact, and the point in the body's frame.

        The impulse is what the balance tells; where a contact begins and ends is less sure, so the mean is.
        """
        mean = self._mean_force(scenes)
        force, spread = mean @ fit.x, mean @ fit.covariance @ mean.T
        by_edges = force * self._duration_std()
        found = {
            f"force_{axis}_N": Estimate(float(force[i]), float(np.hypot(np.sqrt(spread[i, i]), by_edges[i])))
            for i, axis in enumerate("xyz")
        }
        skeleton = scenes[0].skeleton
        com = skeleton.bodies[skeleton.body_index(self.target)].com_body
        for i, axis in enumerate("xyz"):
            k = len(fit.x) - 3 + i
            found[f"point_{axis}_m"] = Estimate(
                float(com[i] + fit.x[k]), float(np.sqrt(fit.covariance[k, k]))
            )
        return found

    def _mean_force(self, scenes: Sequence[Scene]) -> Float[np.ndarray, "3 parameters"]:
        """Of a unit of each parameter, over the frames of all windows; shifts of the point have none."""
        inside = {s.name: frames_of(self._touching(), s) for s in scenes}
        frames = sum(int(within.sum()) for within in inside.values())
        blocks = []
        for window in self.windows:
            time_histories = _time_histories(window)
            of_frames = (
                time_histories[inside[window.trial]].sum(axis=0) / frames if window.trial in inside else 0.0
            )
            blocks.append(np.kron(np.eye(3), np.broadcast_to(of_frames, time_histories.shape[1:])))
        return np.concatenate([*blocks, np.zeros((3, 3))], axis=1)

    def is_possible(self, estimates: dict[str, Estimate]) -> bool:
        """Nobody is pushed harder for long."""
        return _size_N(estimates) < MOST_WEIGHTS * self.weight_N

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """More than a touch."""
        return self.is_possible(estimates) and _size_N(estimates) > LEAST_N

    def frames(
        self, scenes: Sequence[Scene], eta: Eta, x: Float[np.ndarray, " parameters"]
    ) -> tuple[Range, ...]:
        """From where the force begins to where it is gone."""
        return tuple(Range(w.trial, w.start, w.end) for w in self._touching())

    def _touching(self) -> tuple[Stretch, ...]:
        """What begins or ends within a trial still does so when widened."""
        whole = [
            replace(wide, start=max(wide.start, int(w.begins)), end=min(wide.end, wide.frames - int(w.ends)))
            for w in self.windows
            for wide in [w.widen(WHOLE_S)]
        ]
        trials = dict.fromkeys(w.trial for w in whole)
        return tuple(s for t in trials for s in join(w for w in whole if w.trial == t))

    def _duration_std(self) -> float:
        """Of the contacts' whole duration, as a share of it, by the ends that lie within a trial."""
        touching = self._touching()
        ends = sum(int(w.begins) + int(w.ends) for w in self.windows)
        return EDGE_STD_S * float(np.sqrt(ends)) / sum(w.seconds for w in touching)

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """At the bodies whose place suits the balance: all its windows, and each alone.

        What acts all along is no contact that begins or ends: it is left to causes that say why.
        Where a foot stands beside the plates the balance lacks a whole step; no contact is looked for there.
        """
        stances = [s.stretch for s in off_plate_stances(scenes) if s.gross]
        found = [w for scene in scenes for w in contact_windows(scene, frames_of(stances, scene))]
        found.sort(key=lambda w: -w.score)
        weights = {w.stretch.trial: w.wrong_weight_N for w in found}
        missing = {s.name: _missing_ground(s, weights[s.name]) for s in scenes if s.name in weights}
        sets = [tuple(w.stretch for w in found)] if found else []
        if len(found) > 1:
            sets += [(w.stretch,) for w in found[:MOST_ALONE]]
        frames = {s.name: s.frames for s in scenes}
        sets = [
            windows
            for windows in sets
            if any(w.end - w.start < MOST_SHARE * frames[w.trial] for w in windows)
        ]
        made: list[Candidate] = []
        inner = inner_segments(scenes[0].skeleton) if scenes else frozenset()
        for windows in sets:
            trials = [s for s in scenes if s.name in {w.trial for w in windows}]
            scales = tuple(max(PRIOR_N, _mean_force_N(trials, window, missing)) for window in windows)
            own = tuple((trial.name, weights[trial.name]) for trial in trials)
            nearest = sorted(_touchable(scenes[0]), key=lambda body: _misfit(trials, windows, body, missing))
            for body in nearest[:MOST_BODIES]:
                name = scenes[0].skeleton.body_names[body]
                made.append(cls(name, windows, scales, own, body in inner, scenes[0].weight_N))
        return made


def _size_N(estimates: dict[str, Estimate]) -> float:
    return float(np.hypot.reduce([estimates[f"force_{axis}_N"].value for axis in "xyz"]))


def _time_histories(window: Stretch) -> Float[np.ndarray, "frames time histories"]:
    """One while in contact, and splines about it."""
    wide = window.widen(EDGE_S)
    humps = wide.humps(max(KNOTS_S, wide.seconds / MOST_KNOTS))
    return np.concatenate([humps.sum(axis=1, keepdims=True), humps], axis=1)


def reach_m(segment: Body) -> float:
    """How far from a segment's centre of mass it is touched: its radius of gyration."""
    return max(LEAST_REACH_M, float(np.sqrt(np.trace(segment.inertia_body) / (2 * segment.mass))))


def _touchable(scene: Scene) -> list[int]:
    """Bodies that weigh something and are not part of a foot."""
    feet = {part.body for sole in scene.soles for part in sole.parts}
    return [b for b in scene.skeleton.bodies_from_share(LIGHTEST_SHARE) if b not in feet]


def _mean_force_N(scenes: Sequence[Scene], window: Stretch, missing: Missing) -> float:
    scene = next(s for s in scenes if s.name == window.trial)
    inside = _usable([window], scene)
    return float(np.linalg.norm(missing[scene.name][inside, :3].mean(axis=0))) if inside.any() else 0.0


def _missing_ground(scene: Scene, wrong_weight_N: float) -> Float[np.ndarray, "frames 6"]:
    """What the balance lacks beyond a wrong weight."""
    return np.asarray(scene.missing_ground - wrong_weight_N * force_at(UP, scene.com_ground))


def _misfit(scenes: Sequence[Scene], windows: Sequence[Stretch], body: int, missing: Missing) -> float:
    """How badly the missing force makes the missing moment about a segment's centre of mass at its best d.

    (R d) × f = n, least squares over the windows with d ~ N(0, reach²); half a sum of squares in standard
    deviations.
    """
    segment = scenes[0].skeleton.bodies[body]
    precision, pull, total = np.eye(3) / reach_m(segment) ** 2, np.zeros(3), 0.0
    for scene in scenes:
        inside = _usable(windows, scene)
        wrench = missing[scene.name][inside]
        centre = scene.point_ground(body, segment.com_body)[inside]
        moment = wrench[:, 3:] - cross(centre, wrench[:, :3])
        R = scene.R_ground_body[inside, body]
        arm = np.stack([cross(R[:, :, i], wrench[:, :3]) for i in range(3)], axis=-1)
        weight = 1 / (INDEPENDENT_S * scene.rate * (MOMENT_SHARE_M * scene.weight_N) ** 2)
        precision = precision + weight * np.einsum("tij,tik->jk", arm, arm)
        pull = pull + weight * np.einsum("tij,ti->j", arm, moment)
        total += weight * float((moment**2).sum())
    return 0.5 * (total - float(pull @ np.linalg.solve(precision, pull)))


def _usable(windows: Sequence[Stretch], scene: Scene) -> Bool[np.ndarray, " frames"]:
    return frames_of(windows, scene) & scene.counts
