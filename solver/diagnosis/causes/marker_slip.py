"""Marker slip: from one moment on a marker sits elsewhere on its segment."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.lib.stride_tricks import sliding_window_view

from solver.diagnosis.causes.about import (
    About,
    CorrectedBy,
    Entry,
    Markers,
    Named,
    Reading,
    Size,
    TimeHistory,
)
from solver.diagnosis.causes.effect import Estimate, Range
from solver.diagnosis.causes.marker_effect import (
    FEWEST_SEEN,
    NOISE_M,
    RESOLVED_M,
    SHIFT_STD_M,
    MarkerFinding,
    Places,
    PoseFree,
    near_angles,
    pose_free,
    seen_share,
)
from solver.diagnosis.causes.observed_trial import Scene

SOFT_TISSUE = 1.5  # a segment's markers move together by half as much again as each moves for itself
SPANS_S = (0.0, 0.05, 0.15, 0.4)  # over which medians before and after must all differ; 0: next frames
END_S = 0.3  # nearer to an end, or to a longer gap, a slip looks like a disturbance that passes
LONGEST_GAP_S = 0.1
FEWEST_SAMPLES = 20
LEAST_HELD = 0.04  # information below which a direction is not known well enough
LEAST_M = 0.007  # jumps in real recordings of sound markers that look like slips stay below 5 mm
LEAST_GAIN = 20.0  # a trunk that deforms in a jump reaches 15
LARGEST_OTHER_STDS = 3.0  # the largest other jump of a trial is about three standard deviations of them
# the largest other change from one frame to the next, of theirs: a few frames are far worse
LARGEST_AT_ONCE_STDS = 5.5
SAME_TIME_S = 0.05  # neighbours seem to jump with the marker that did
MOST_SLIPS = 6
ANGLE_STD_M = 0.03  # prior of how far soft tissue moves a marker per rad, and per rad² below
SQUARE_STD_M = 0.02

AngleFit = Callable[[int | None], tuple[Float[np.ndarray, "samples axes"], Float[np.ndarray, " axes"]]]
"""From the sample of a step, or None, to what angles leave of a marker's place, and the step's size [m]."""


@dataclass(frozen=True, eq=False)
class MarkerSlip(MarkerFinding):
    """observed(t) = true(t) + R(t) shift for t ≥ time_s, R the orientation of the marker's segment.

    Only the components of the shift in which the other markers hold the segment are known.
    """

    marker: int  # of the fit in which it was found; after a repair, another may use fewer
    body: int  # its segment
    shift_body: Float[np.ndarray, "3"]  # [m]
    R_ground_body: Float[np.ndarray, "frames 3 3"]  # of the marker's segment
    in_its_path: bool = False  # its own path is cut there (`leaps`), not only its place among the others

    about = About(
        id="marker_slip",
        entry=Entry(
            "marker",
            "from a moment on the marker sits elsewhere on its segment",
            "`shift_m`, `time_s`, `shift_x_m`, `shift_y_m`, `shift_z_m`",
        ),
        title="a marker that moved on its segment: {target}",
        sentence="Marker {target} has moved on its segment during the trial and stayed there.",
        remedy=(
            'In this recording leave it out: set it to "" in the map that `addb-viewer markers SUBJECT` '
            "writes. Before the next one, attach it again and record another static trial."
        ),
        separate_by="a static trial before and after the recording",
        branch="markers/one",
        names=Named.MARKERS,
        time_history=TimeHistory.EVENT,
        corrected_by=CorrectedBy.FILES,
        in_markers=True,
        sizes=(Size("shift_m", 0.012, 0.04, 0.3, "the segment's length at most"),),
        readings=(
            Reading("shift_m", "by {amount}", "mm", 1e3),
            Reading("time_s", "at {amount} from the trial's start", "s"),
        ),
        picture=Markers(),
    )

    def repair(self, observed_ground: Places) -> Places:
        """The marker put back to where it sat before."""
        corrected = observed_ground.copy()
        after = slice(self.frames.start, None)
        corrected[after, self.marker] -= self.R_ground_body[after] @ self.shift_body
        return corrected


@dataclass(frozen=True, eq=False)
class UnusedMarkerSlip(MarkerFinding):
    """Likewise, of a marker that the model does not use: nothing was fitted to it."""

    about = MarkerSlip.about

    def repair(self, observed_ground: Places) -> Places:
        """As recorded: the model has no such marker."""
        return observed_ground


@dataclass(frozen=True, eq=False)
class _Jump:
    """The most abrupt change of one marker's place, and what else changes there."""

    marker: int
    frame: int  # first after it
    shift_body: Float[np.ndarray, "3"]
    size: float  # [m] least over the spans
    std: float  # [m] of such changes elsewhere in the trial
    std_at_once: float  # [m] of changes elsewhere from one sample to the next, whether they last or not
    energy: float  # in squares of metres: what of all markers' errors it explains
    places: int

    @property
    def gain(self) -> float:
        """Of the clearer: larger than what lasts elsewhere, or than what happens there within a frame."""
        usual = min(self.std, self.std_at_once)
        return 0.5 * (self.size / usual) ** 2 - float(np.log(self.places))


def findings(scene: Scene) -> list[MarkerSlip]:
    """Slips of a trial's markers, the clearest first. Exchanged markers have to be repaired before.

    A slip is a jump of the marker, in the axes of its segment and against where all other markers put it,
    that lasts; it has to stand out from every other jump of the same marker, whose ordinary movement with the
    near joints' angles is taken off, or from all that happens to it between two samples. Slips in longer gaps
    and near the ends are not looked for, but for those in a gap at which another marker seems to jump.
    """
    found, at = list[MarkerSlip](), scene
    for _ in range(MOST_SLIPS):
        free, enough = pose_free(at, SOFT_TISSUE), seen_share(at) >= FEWEST_SEEN
        one_of_many = float(np.log(len(at.markers.names)))
        paths = [path for m in range(len(at.markers.names)) if (path := _path(at, free, m, enough))]
        jumps = [jump for path in paths if (jump := _largest_jump(path)) and jump.size > LEAST_M]
        clear = [jump for jump in jumps if jump.gain - one_of_many > LEAST_GAIN]
        if not clear:
            break
        first = max(clear, key=lambda j: j.gain)
        near = [j for j in jumps if abs(j.frame - first.frame) <= SAME_TIME_S * scene.rate]
        lost = [j for c in paths if (j := _beside_a_gap(c, first.frame)) and j.size > first.size]
        near += [jump for jump in lost if jump.gain - one_of_many > LEAST_GAIN]
        slip = _finding(scene, max(near, key=lambda j: j.energy), first.gain - one_of_many)
        found.append(slip)
        at = replace(at, markers=replace(at.markers, observed_ground=slip.repair(at.markers.observed_ground)))
    return found


def slip_at(scene: Scene, marker: int, frame: int) -> MarkerSlip | None:
    """The slip of a marker at a frame; None where it is not seen well enough or does not jump there."""
    path = _path(scene, pose_free(scene, SOFT_TISSUE), marker, seen_share(scene) >= FEWEST_SEEN)
    if path is None or not (near := np.abs(path.frames - frame) <= SAME_TIME_S * scene.rate).any():
        return None
    size = near * _changes(path.place, scene.rate)[1]
    jump = _jump_at(path, int(size.argmax()))
    return (
        None if jump is None else _finding(scene, jump, jump.gain - float(np.log(len(scene.markers.names))))
    )


def _finding(scene: Scene, jump: _Jump, gain: float) -> MarkerSlip:
    shift = float(np.linalg.norm(jump.shift_body))
    components = {
        f"shift_{axis}_m": Estimate(float(value), jump.std)
        for axis, value in zip("xyz", jump.shift_body, strict=True)
    }
    return MarkerSlip(
        target=scene.markers.names[jump.marker],
        parameters={
            "shift_m": Estimate(shift, jump.std),
            "time_s": Estimate(jump.frame / scene.rate, 1 / scene.rate),
            **components,
        },
        frames=Range(scene.name, jump.frame, scene.frames),
        gain=gain,
        marker=jump.marker,
        body=int(scene.markers.body[jump.marker]),
        shift_body=jump.shift_body,
        R_ground_body=scene.R_ground_body[:, scene.markers.body[jump.marker]],
    )


@dataclass(frozen=True, eq=False)
class _Path:
    """Where one marker is against the place that the others give it, along the axes that they hold."""

    marker: int
    frames: Int[np.ndarray, " samples"]
    rate: float
    axes_body: Float[np.ndarray, "3 axes"]
    information: Float[np.ndarray, "axes axes"]  # the usual one
    place: Float[np.ndarray, "samples axes"]  # [m]
    without_angles: AngleFit

    @cached_property
    def stretches(self) -> list[tuple[int, int]]:
        """First samples and ends of what lies between longer gaps."""
        after_gaps = np.flatnonzero(np.diff(self.frames) > LONGEST_GAP_S * self.rate) + 1
        return list(pairwise([0, *after_gaps.tolist(), len(self.frames)]))

    @cached_property
    def clear(self) -> Bool[np.ndarray, " samples"]:
        """Samples far enough from the ends and from longer gaps for a change to be seen to last."""
        clear = np.zeros(len(self.frames), dtype=bool)
        for first, end in self.stretches:
            own = self.frames[first:end]
            clear[first:end] = np.minimum(own - own[0], own[-1] - own) >= END_S * self.rate
        return clear


def _path(scene: Scene, free: PoseFree, marker: int, enough: Bool[np.ndarray, " frames"]) -> _Path | None:
    frames = np.flatnonzero(free.seen[:, marker] & enough)
    if len(frames) < FEWEST_SAMPLES:
        return None
    usual = np.median(free.information_body[frames, marker], axis=0)
    held, axes = np.linalg.eigh(usual)
    axes = axes[:, held > LEAST_HELD]
    if not axes.shape[1]:
        return None
    information = axes.T @ free.information_body[frames, marker] @ axes + 0.01 * np.eye(axes.shape[1])
    score = free.score_body[frames, marker] @ axes
    place = np.linalg.solve(information, score[..., None])[..., 0]
    angles = near_angles(scene, int(scene.markers.body[marker]))[frames]
    fit = _angle_fit(angles, place, scene.rate)
    return _Path(marker, frames, scene.rate, axes, axes.T @ usual @ axes, place, fit)


def _largest_jump(path: _Path) -> _Jump | None:
    """The clearer of what a step found beside the angles and one found before them leads to.

    A slip turns the fitted pose and with it the angles: fitted alone they would take the step for their own.
    """
    jumps = []
    for start in (path.place, path.without_angles(None)[0]):
        size = path.clear * _changes(start, path.rate)[1]
        if size.max() > LEAST_M / 2:
            jumps.append(_followed(path, int(size.argmax())))
    return max((jump for jump in jumps if jump), key=lambda jump: jump.gain, default=None)


def _followed(path: _Path, step: int) -> _Jump | None:
    """The jump that a first guess leads to, once angles and step are fitted together."""
    for _ in range(2):
        size = path.clear * _changes(path.without_angles(step)[0], path.rate)[1]
        if int(size.argmax()) == step:
            break
        step = int(size.argmax())
    return _jump_at(path, step)


def _beside_a_gap(path: _Path, frame: int) -> _Jump | None:
    """The jump of a marker that was lost when another one seemed to jump, and is back elsewhere."""
    reach = round(SAME_TIME_S * path.rate)
    for (first, back), (_, end) in pairwise(path.stretches):
        lost, found = path.frames[back - 1], path.frames[back]
        seen = min(lost - path.frames[first], path.frames[end - 1] - found)  # before, and after
        if lost - reach <= frame <= found + reach and seen >= END_S * path.rate:
            size = _changes(path.place, path.rate)[1][back : back + reach + 1]
            return _jump_at(path, back + int(size.argmax()))
    return None


def _jump_at(path: _Path, step: int) -> _Jump | None:
    """The change at a sample, against all others in time; None where angles do better than a step."""
    rest, shift = path.without_angles(step)
    change, size = _changes(rest, path.rate)
    if np.linalg.norm(shift) < 0.5 * size[step]:
        return None
    after = np.arange(len(path.frames)) >= step
    others, elsewhere = _changes(rest - after[:, None] * shift, path.rate)
    at_once = np.linalg.norm(np.delete(others[0], step, axis=0), axis=1)
    jump = np.median(change[:, step], axis=0)
    return _Jump(
        marker=path.marker,
        frame=int(path.frames[step]),
        shift_body=path.axes_body @ jump,
        size=float(size[step]),
        std=float((path.clear * elsewhere).max() + RESOLVED_M) / LARGEST_OTHER_STDS,
        std_at_once=float(at_once.max() + RESOLVED_M) / LARGEST_AT_ONCE_STDS,
        energy=float(jump @ path.information @ jump),
        places=len(path.frames),
    )


def _angle_fit(
    angles: Float[np.ndarray, "samples angles"], place: Float[np.ndarray, "samples axes"], rate: float
) -> AngleFit:
    """What angles leave of a marker's place, and the step at a sample that is fitted with them."""
    pairs = [angles[:, i] * angles[:, j] for i in range(angles.shape[1]) for j in range(i, angles.shape[1])]
    basis = np.column_stack([np.ones(len(angles)), angles, *pairs])
    std = np.r_[np.inf, np.full(angles.shape[1], ANGLE_STD_M), np.full(len(pairs), SQUARE_STD_M)]
    noise = NOISE_M**2 * 0.1 * rate

    def left(step: int | None) -> tuple[np.ndarray, np.ndarray]:
        columns, own_std = basis, std
        if step is not None:
            columns = np.column_stack([basis, np.arange(len(basis)) >= step])
            own_std = np.r_[std, SHIFT_STD_M]
        normal = columns.T @ columns + noise * np.diag(own_std**-2.0)
        fitted = np.linalg.solve(normal, columns.T @ place)
        shift = fitted[-1] if step is not None else np.zeros(place.shape[1])
        return place - basis @ fitted[: basis.shape[1]], shift

    return left


def _changes(
    place: Float[np.ndarray, "samples axes"], rate: float
) -> tuple[Float[np.ndarray, "spans samples axes"], Float[np.ndarray, " samples"]]:
    """Medians from each sample on less those before it, and their least length along their mean."""
    change = np.zeros((len(SPANS_S), *place.shape))
    change[:, 1:] = np.diff(place, axis=0)
    worth = np.flatnonzero(np.linalg.norm(change[0], axis=1) > RESOLVED_M)  # the least of all spans counts
    for k, span in enumerate(SPANS_S[1:], start=1):
        change[k, worth] = _median_changes(place, worth, round(span * rate))
    mean = change.mean(axis=0)
    direction = mean / (np.linalg.norm(mean, axis=1, keepdims=True) + 1e-12)
    size = np.einsum("ktc,tc->kt", change, direction).min(axis=0).clip(0.0)
    return change, size


def _median_changes(
    place: Float[np.ndarray, "samples axes"], at: Int[np.ndarray, " some"], count: int
) -> Float[np.ndarray, "some axes"]:
    """Median of `count` samples from some on less that of as many before; of those there are at the ends."""
    edge = np.full((count, place.shape[1]), np.nan)
    windows = sliding_window_view(np.concatenate([edge, place, edge]), count, axis=0)
    return _medians(windows[at + count]) - _medians(windows[at])


def _medians(windows: Float[np.ndarray, "some axes count"]) -> Float[np.ndarray, "some axes"]:
    """Of what each window holds that is not NaN; for short windows far quicker than `nanmedian`."""
    ordered = np.sort(windows, axis=-1)  # NaN last
    held = np.isfinite(ordered).sum(axis=-1, keepdims=True)
    middle = [np.take_along_axis(ordered, np.maximum(k, 0) // 2, axis=-1) for k in (held - 1, held)]
    return np.asarray((middle[0] + middle[1])[..., 0] / 2)
