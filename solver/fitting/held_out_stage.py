"""Forces held out from the fit and then predicted, layout by layout, by one step from where the fit ended.

Steps without a layout's rows are steps of the quadratic model that ended there: to second order, that forgets
what the fit saw of these forces. The test of this stage holds it against a fit that never saw them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from solver.common.cpu_timer import CpuTimer
from solver.common.progress import Progress
from solver.common.true_runs import runs
from solver.dynamics.cross_validation.held_out import HeldOut, HeldOutLayout, judged_blocks
from solver.dynamics.cross_validation.held_out_layouts import (
    BLOCKS,
    LAYOUTS,
    hold_out_blocks,
    hold_out_steps,
    stances_of,
)
from solver.dynamics.cross_validation.held_out_steps import HeldOutSteps, TrialHeldOut
from solver.dynamics.force_prediction.held_out_prediction import HeldOutPrediction
from solver.dynamics.force_prediction.prediction_columns import PredictionTrial
from solver.dynamics.force_prediction.prediction_fit import held_out_prediction
from solver.dynamics.inverse_dynamics import counted_wrenches, used_frames
from solver.dynamics.trajectory.extension import Extension
from solver.dynamics.trajectory.frame_spans import Span, are_long, teaching_spans, windows
from solver.dynamics.trajectory.trajectory_fit import inertia_caution
from solver.dynamics.trajectory.trajectory_solver import basis_for, knot_spacing
from solver.dynamics.trajectory.trial_data import ExtraParameters
from solver.fitting.fit_result import Fit, StanceInfluence, TrialFit
from solver.fitting.predicted_std import with_predicted_std
from solver.fitting.seen_part import in_whole, seen_part
from solver.fitting.settings import Settings
from solver.fitting.state import MassAndGains
from solver.fitting.torques_stage import under_forces
from solver.fitting.trajectory_stage import all_data, before_forces, extra_of
from solver.kinematics.frame_solver import root_dofs
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.scaling import with_mass
from solver.skeleton.skeleton import Skeleton

CUTOFFS_HZ = (3.0, 4.0, 6.0, 8.0, 10.0, 12.0, 15.0, 20.0, 30.0)  # of all that laboratories use for markers
FramesByTrial = Sequence[Bool[np.ndarray, " frames"]]
Choices = Sequence[tuple[Bool[np.ndarray, " extra"], float]]
Rows = Sequence[Float[np.ndarray, "held_out 6"]]  # by trial


def predict_held_out(
    fit: Fit,
    settings: Settings,
    progress: Progress,
    extension: Extension | None = None,
    *,
    before: Sequence[HeldOutLayout] = (),
) -> Fit:
    """The fit judged on all layouts, where that was still due; with the fit's extension.

    Args:
        fit: of the subject.
        settings: of the fit.
        progress: told the fraction done; may raise `Cancelled`.
        extension: of the fit; its parameters do not see the held-out forces either.
        before: of the fit that this one began with, if any: the kinds of learnt terms stay.
    """
    if not fit.held_out_due or fit.groundwork is None or fit.groundwork.settled is None:
        return fit
    cpu_timer = CpuTimer()
    with cpu_timer("held_out"):
        judge = _Judge(fit, settings, extension)
        layouts = [judge.layout(*one) for one in LAYOUTS]
        kinds = {(layout.kind, layout.number): layout.learnt for layout in before}
        for layout in layouts:
            layout.choose(judge.teacher, kinds.get((layout.kind, layout.number)))
        for done, part in judge.parts():
            progress("held_out", done)
            for layout in layouts:
                layout.ask(part)
        judged = [judge.judged(layout) for layout in layouts]
        first = layouts[0] if any(frames.any() for frames in layouts[0].held_out) else None
        fit = judge.taught(fit, first) if first else fit
    trials, fitted = list(fit.trials), _fitted(fit.trials)
    seconds = {"held_out": cpu_timer.seconds["held_out"] / max(1, len(fitted))}
    for k, i in enumerate(fitted if first else ()):
        whole = in_whole(replace(judge.seen[k], held_out=judged[0][k]), trials[i])
        trials[i] = replace(trials[i], held_out=whole.held_out, seconds=trials[i].seconds | seconds)
    judged_fit = replace(
        fit,
        trials=tuple(trials),
        held_out_due=False,
        held_out_layouts=tuple(
            judge.by_blocks(layout, each) for layout, each in zip(layouts, judged, strict=True)
        ),
    )
    return with_predicted_std(judged_fit)


def with_figures_of(former: Fit, fit: Fit) -> Fit:
    """A fit that differs from the one that was judged by a small edit alone; edited forces are not judged.

    Args:
        former: that was judged, or is to be.
        fit: with the same trials.
    """
    trials, edited = [], {}
    for then, now in zip(former.trials, fit.trials, strict=True):
        frames = then.forces_known != now.forces_known
        edited[now.capture.name] = now.capture.markers.first_frame + np.flatnonzero(frames)
        held_out = then.held_out and replace(then.held_out, frames=then.held_out.frames & ~frames)
        trials.append(replace(now, held_out=held_out))
    layouts = []
    for layout in former.held_out_layouts:
        blocks = {name: judged.without(edited[name]) for name, judged in layout.trials.items()}
        left = {name: judged for name, judged in blocks.items() if len(judged.ranges)}
        layouts.append(replace(layout, trials=left))
    return with_predicted_std(
        replace(fit, trials=tuple(trials), held_out_due=former.held_out_due, held_out_layouts=tuple(layouts))
    )


def leave_stances_out(
    fit: Fit, settings: Settings, extension: Extension | None = None
) -> Iterator[StanceInfluence]:
    """Each whole stance with known forces, left out of the fit by one step from its end.

    Args:
        fit: of the subject; of trials without standard deviations nothing is told.
        settings: of the fit.
        extension: of the fit.
    """
    if fit.groundwork is None or fit.groundwork.settled is None:
        return
    judge, of_root = _Judge(fit, settings, extension), root_dofs(fit.skeleton)
    fitted, told = _fitted(fit.trials), set[tuple[int, int, int]]()
    for _, part in judge.parts():
        for own, span in enumerate(part.spans):
            trial, whole = judge.seen[span.trial], fit.trials[fitted[span.trial]]
            if whole.std is None:
                continue
            assert trial.contacts is not None
            feet, rate = trial.contacts.foot_bodies, trial.motion.rate
            of_span = slice(span.start, span.end)
            in_contact = trial.contacts.in_contact[of_span]
            for foot, (start, end) in stances_of(trial.forces_known[of_span], in_contact, rate):
                if (span.trial, foot, span.start + start) in told:  # in the window before as well
                    continue
                held_out = [np.zeros(len(data.counts), dtype=bool) for data in part.data]
                held_out[own][start:end] = True
                change = np.full(trial.motion.q.shape, np.nan)
                change[of_span] = part.torque_change(own, part.moved_without(held_out)[own], trial, of_span)
                stance = span.start + start, span.start + end
                change[slice(*stance)] = np.nan
                told.add((span.trial, foot, stance[0]))
                found = _influence(whole, feet[foot], stance, np.where(of_root, np.nan, change))
                if found is not None:
                    yield found


def _influence(
    trial: TrialFit, foot: str, stance: tuple[int, int], change: Float[np.ndarray, "posed dofs"]
) -> StanceInfluence | None:
    """None where no torque with a band is used elsewhere."""
    assert trial.dynamics is not None
    assert trial.std is not None
    first = int(np.argmax(trial.motion.posed))
    laid = np.full(trial.motion.q.shape, np.nan)
    laid[first : first + len(change)] = change
    share = np.abs(laid) / trial.std.torque
    share[~trial.dynamics.used] = np.nan
    if np.isnan(share).all():
        return None
    frame, dof = np.unravel_index(np.nanargmax(share), share.shape)
    return StanceInfluence(
        trial.capture.name,
        foot,
        (first + stance[0], first + stance[1]),
        laid,
        trial.motion.dofs[dof],
        int(frame),
        float(laid[frame, dof]),
        float(trial.std.torque[frame, dof]),
    )


class _Layout:
    """One layout, and what parts of the fit that are asked about it say."""

    def __init__(self, kind: str, number: int, held_out: FramesByTrial) -> None:
        self.kind, self.number, self.held_out = kind, number, held_out
        self.learnt: tuple[str, ...] | None = None  # kinds of terms; None: nobody was asked
        self.predicted, self.of_motion = (
            [np.full((len(frames), 6), np.nan) for frames in held_out] for _ in range(2)
        )

    def choose(self, teacher: "_Part", known: tuple[str, ...] | None) -> None:
        """Kinds of learnt terms: those known, where an edit left them columns, or a teacher's choice."""
        if teacher.trials is not None and any(frames.any() for frames in self.held_out):
            self.learnt = known
            if known not in teacher.sets:
                self.learnt = teacher.kinds(self._frames_of(teacher), whole_steps=self.kind != BLOCKS)

    def ask(self, part: "_Part") -> None:
        """What a part of the fit misses where it holds frames of the layout."""
        own = self._frames_of(part)
        if not any(frames.any() for frames in own):
            return
        if part.trials is None or (self.kind, self.number) == LAYOUTS[0]:
            self._lay(self.of_motion, part, own, part.missed_by_motion(own))
        if self.learnt is not None:
            taken = tuple(kind for kind in self.learnt if (kind,) in part.ended.sets)  # of a window
            self._lay(self.predicted, part, own, part.ended.missed(own, taken))

    def _frames_of(self, part: "_Part") -> FramesByTrial:
        return [self.held_out[span.trial][span.start : span.end] for span in part.spans]

    @staticmethod
    def _lay(into: list[np.ndarray], part: "_Part", own: FramesByTrial, missed: Rows) -> None:
        for span, frames, rows in zip(part.spans, own, missed, strict=True):
            into[span.trial][span.start + np.flatnonzero(frames)] = rows


class _Judge:
    """A fit whose trials are judged on forces as if it had not seen them."""

    def __init__(self, fit: Fit, settings: Settings, extension: Extension | None) -> None:
        assert fit.groundwork is not None
        assert fit.groundwork.settled is not None
        groundwork, settled = fit.groundwork, fit.groundwork.settled
        self.groundwork = groundwork
        self.settings, self.extension, self.fitted_skeleton = settings, extension, fit.skeleton
        self.began, self.phi = with_mass(groundwork.skeleton, settled.mass_kg), groundwork.phi
        self.seen = [seen_part(fit.trials[i]) for i in _fitted(fit.trials)]
        self.before = [before_forces(trial) for trial in self.seen]
        self.gains = tuple(settled.gains[trial.capture.name] for trial in self.seen)
        weighed = MassAndGains(settled.mass_kg, self.gains)
        plain = all_data(self.before, groundwork.match, weighed, extension)
        self.data = [replace(d, spline=t.spline) for d, t in zip(plain, self.seen, strict=True)]
        self.alone = [_markers_alone(trial, fit.skeleton, settings) for trial in self.before]
        self.are_long = are_long([len(own.counts) for own in self.data], settings.trajectory)

    def layout(self, kind: str, number: int) -> _Layout:
        """Nobody has been asked about it yet."""
        frames = [_frames(trial, (kind, number), self.settings, self.extension) for trial in self.seen]
        return _Layout(kind, number, frames)

    @cached_property
    def teacher(self) -> "_Part":
        """All trials as one problem, or of long ones what terms are learnt from."""
        if not self.are_long:
            spans = [Span(i, 0, len(own.counts)) for i, own in enumerate(self.data)]
            return _Part(self, self.began, self.phi, spans)
        spacing = [knot_spacing(own.start, self.settings.trajectory) for own in self.data]
        spans = teaching_spans(self.data, spacing, self.settings.trajectory)
        return _Part(self, self.fitted_skeleton, None, spans)

    def parts(self) -> "Iterator[tuple[float, _Part]]":
        """All trials as one problem, or window by window with inertias that stay; how much came before."""
        weights = self.settings.trajectory
        if not self.are_long:
            yield 0.0, self.teacher
            return
        self.__dict__.pop("teacher", None)  # it holds as much memory as a window
        spans = [
            span
            for i, own in enumerate(self.data)
            for span in windows(i, len(own.counts), knot_spacing(own.start, weights), weights)
        ]
        for k, span in enumerate(spans):
            yield k / len(spans), _Part(self, self.fitted_skeleton, None, [span])

    def taught(self, fit: Fit, layout: _Layout) -> Fit:
        """With kinds that a layout chose; where no force was missing, with what they learn, for an edit."""
        groundwork, trials = replace(self.groundwork, prediction_kinds=layout.learnt), list(fit.trials)
        if layout.learnt is not None and groundwork.learnt is None and not self.are_long:
            learnt, splines = self.teacher.ended.learnt(layout.learnt)
            for i, spline in zip(_fitted(trials), splines, strict=True):
                trials[i] = replace(trials[i], prediction_spline=spline)
            known = {trial.capture.name: tuple(runs(trial.forces_known)) for trial in self.seen}
            groundwork = replace(groundwork, learnt=learnt, learnt_on=known)
        return replace(fit, trials=tuple(trials), groundwork=groundwork)

    def judged(self, layout: _Layout) -> list[HeldOut]:
        """Each trial on a layout that all parts were asked about."""
        judged, learns = [], self.settings.prediction.enabled
        for k, (frames, trial) in enumerate(zip(layout.held_out, self.before, strict=True)):
            used = self._used(trial)
            markers, cutoffs = self.alone[k].at_best(used & ~frames)
            predicted, of_motion = (self.gains[k] * rows[k] for rows in (layout.predicted, layout.of_motion))
            judged.append(
                HeldOut(frames & used, predicted, markers, cutoffs, of_motion, layout.learnt or ())
                if learns
                else HeldOut(frames & used, of_motion, markers, cutoffs)
            )
        return judged

    def by_blocks(self, layout: _Layout, judged: Sequence[HeldOut]) -> HeldOutLayout:
        """A layout's figures, block by block."""
        blocks = {}
        for held_out, frames, trial in zip(judged, layout.held_out, self.seen, strict=True):
            found = judged_blocks(held_out, frames, trial.capture.markers.first_frame)
            if found is not None:
                blocks[trial.capture.name] = found
        return HeldOutLayout(layout.kind, layout.number, blocks, layout.learnt or ())

    def _used(self, trial: TrialFit) -> Bool[np.ndarray, " frames"]:
        assert trial.contacts is not None
        assert trial.mask is not None
        used = used_frames(trial.contacts, trial.mask, self.settings.dynamics.end_frames)
        extra = extra_of(trial, self.extension)
        return used if extra is None else used & extra.known


class _Part:
    """Frames of trials that are one problem, near the fit."""

    def __init__(
        self,
        judge: _Judge,
        skeleton: Skeleton,
        phi: Float[np.ndarray, " parameters"] | None,
        spans: list[Span],
    ) -> None:
        """Of a judge's trials; without φ the skeleton's inertias stay."""
        settings, extension = judge.settings, judge.extension
        weights = settings.trajectory if phi is not None else replace(settings.trajectory, fit_inertias=False)
        self.spans, self.skeleton, self.weights, self.phi = spans, skeleton, weights, phi
        self.settings, self.fitted = settings.prediction, judge.fitted_skeleton
        self.extra = (extension and extension.parameters) or ExtraParameters.none()
        self.mass_is_fitted = extension is None
        self.data = [
            judge.data[s.trial].part(s.start, s.end, knot_spacing(judge.data[s.trial].start, weights))
            for s in spans
        ]
        self.trials: list[PredictionTrial] | None = None  # None: no terms are learnt
        if self.settings.enabled:
            self.trials = []
            for span, own in zip(spans, self.data, strict=True):
                contacts = judge.before[span.trial].contacts
                assert contacts is not None
                assert own.spline is not None
                motion = replace(own.start, q=basis_for(own.start, weights).evaluate(own.spline))
                begun = replace(own, spline=None, initial=motion)
                in_contact = contacts.in_contact[span.start : span.end]
                self.trials.append(PredictionTrial(begun, contacts.foot_bodies, in_contact))

    @property
    def sets(self) -> Sequence[tuple[str, ...]]:
        """Of kinds with columns, asked where the part is asked anyway."""
        return (self._begun if self.phi is None else self.ended).sets

    def kinds(self, held_out: FramesByTrial, *, whole_steps: bool) -> tuple[str, ...]:
        """Of learnt terms, those that predict other forces best."""
        return self._begun.best_kinds(held_out, taught=not whole_steps)

    @cached_property
    def _begun(self) -> HeldOutPrediction:
        """Where the trajectory fit ended."""
        return self._predicting(is_at_its_end=False)

    @cached_property
    def ended(self) -> HeldOutPrediction:
        """Where the prediction fit ends with no terms learnt."""
        return self._predicting(is_at_its_end=True)

    def _predicting(self, *, is_at_its_end: bool) -> HeldOutPrediction:
        assert self.trials is not None
        given = self.skeleton, self.trials, self.weights, self.settings
        return held_out_prediction(*given, phi=self.phi, extra=self.extra, is_at_its_end=is_at_its_end)

    def missed_by_motion(self, held_out: FramesByTrial) -> Rows:
        """Residuals on held-out frames by the fit's own motion, as if it had not seen them."""
        is_last = self.trials is not None  # then one layout asks
        missed = self._near_motion.missed(*self._of_motion(held_out), is_last=is_last)
        if is_last:
            del self._near_motion  # it holds as much memory as all else
        return [own[0] for own in missed]

    def moved_without(self, held_out: FramesByTrial) -> Sequence[Float[np.ndarray, "coefficients dofs"]]:
        """By what the splines of the fit's own motion would differ if it had not seen held-out frames."""
        (step,) = self._near_motion.steps(*self._of_motion(held_out))
        return step.coefficients

    def torque_change(
        self, trial: int, moved: Float[np.ndarray, "coefficients dofs"], fit: TrialFit, frames: slice
    ) -> Float[np.ndarray, "frames dofs"]:
        """Of one of its trials [N·m or N], under the wrenches that count, by what its spline differs.

        Args:
            trial: which one.
            moved: by what it differs.
            fit: of the trial.
            frames: of the trial that this is a part of.
        """
        data = self.data[trial]
        assert data.spline is not None
        assert fit.contacts is not None
        assert fit.mask is not None
        basis, model = basis_for(data.start, self.weights), RigidBodyModel(self.fitted)
        wrenches = counted_wrenches(fit.contacts.wrench_ground, fit.mask)[frames]
        feet = [self.fitted.body_index(name) for name in fit.contacts.foot_bodies]
        torques = []
        for spline in (data.spline, data.spline + moved):
            q, v, a = (basis.evaluate(spline, order) for order in range(3))
            torques.append(model.inverse_dynamics(q, v, a, wrenches, feet))
        return torques[1] - torques[0]

    @cached_property
    def _near_motion(self) -> HeldOutSteps:
        """From the fit's own motion."""
        return HeldOutSteps(
            self.skeleton,
            self.data,
            self.weights,
            phi=self.phi,
            extra=self.extra,
            mass_is_fitted=self.mass_is_fitted,
        )

    def _of_motion(self, held_out: FramesByTrial) -> tuple[list[TrialHeldOut], Choices, float]:
        """A layout as steps near the motion take it: with all parameters, and the caution that is left."""
        seen = [replace(d, counts=d.counts & ~h) for d, h in zip(self.data, held_out, strict=True)]
        free = self.weights.fit_inertias
        caution = inertia_caution(self.skeleton, seen, self.weights) if free else 1.0
        count = len(self.extra.start)
        none = [np.zeros((len(frames), 6, count)) for frames in held_out]
        layout = [
            TrialHeldOut(frames, columns if own.extra_columns_ground is None else own.extra_columns_ground)
            for frames, columns, own in zip(held_out, none, self.data, strict=True)
        ]
        return layout, [(np.ones(count, dtype=bool), 1.0)], caution


def _fitted(fits: Sequence[TrialFit]) -> list[int]:
    return [i for i, fit in enumerate(fits) if fit.kinematics_only is not None]


def _frames(
    fit: TrialFit, layout: tuple[str, int], settings: Settings, extension: Extension | None
) -> Bool[np.ndarray, " frames"]:
    """A trial's part of a layout; none where too few forces would be left to fit it to."""
    (kind, number), extra = layout, extra_of(fit, extension)
    counts, rate = fit.forces_known if extra is None else fit.forces_known & extra.known, fit.motion.rate
    if kind == BLOCKS:
        return hold_out_blocks(counts, rate, settings.trajectory, number)
    assert fit.contacts is not None
    frames = hold_out_steps(counts, fit.contacts.in_contact, rate, number)
    is_left = (counts & ~frames).sum() >= settings.trajectory.fewest_frames
    return frames if is_left else np.zeros_like(frames)


@dataclass(frozen=True)
class _MarkersAlone:
    """Residuals of the markers' motion at each cut-off, against the same forces as the fit."""

    cutoffs_Hz: tuple[float, ...]
    residuals: Float[np.ndarray, "cutoffs frames 6"]

    def at_best(
        self, elsewhere: Bool[np.ndarray, " frames"]
    ) -> tuple[Float[np.ndarray, "frames 6"], tuple[float, float]]:
        """At the cut-offs [Hz] that do best on these frames: force and moment each have their own."""
        squares = self.residuals[:, elsewhere] ** 2
        force, moment = (int(squares[:, :, axes].sum(axis=(1, 2)).argmin()) for axes in np.s_[:3, 3:])
        residual = np.hstack([self.residuals[force][:, :3], self.residuals[moment][:, 3:]])
        return residual, (self.cutoffs_Hz[force], self.cutoffs_Hz[moment])


def _markers_alone(fit: TrialFit, skeleton: Skeleton, settings: Settings) -> _MarkersAlone:
    rate, order = fit.motion.rate, settings.conditioning.order
    cutoffs = tuple(cutoff for cutoff in CUTOFFS_HZ if cutoff < rate / 2) or (rate / 4,)
    found = [under_forces(fit, fit.motion.low_passed(c, order), skeleton, settings) for c in cutoffs]
    return _MarkersAlone(cutoffs, np.stack([dynamics.residual_root for dynamics in found]))
