"""A re-solve after an edit of the flags: near the edit alone, as long as little else follows from it.

The inertias then stay, and with them all that the former fit says of trials that nobody touched.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from solver.common.true_runs import runs
from solver.dynamics.cross_validation.held_out_layouts import frames_of
from solver.dynamics.dynamics import MassStd
from solver.dynamics.trajectory.extension import Extension
from solver.dynamics.trajectory.near_edits import InertiasBefore, spans_near
from solver.dynamics.trajectory.trajectory_search import Border
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.uncertainty import mass_std
from solver.fitting.fit_result import Groundwork, SettledFit, TrialFit
from solver.fitting.prediction_stage import learnt_before, misses_a_force
from solver.fitting.seen_part import seen_part
from solver.fitting.settings import Settings
from solver.fitting.state import Edit, FitState, MassAndGains

MOST_NEAR = 0.5  # of all frames; with more, the whole costs no more
MOST_SCALED = 2.0  # times `edit_gain`, of the mass; with more, inertias would move too


def follow_small_edit(state: FitState, settings: Settings) -> FitState:
    """With the edit, where it can be followed near it alone: the mass and the gains then stay."""
    if state.weighed is None:
        return state
    edit = small_edit(state.members, state.weighed, state.groundwork, settings, state.extension)
    if edit is None:
        return state
    edited = dict(zip(state.fitted, edit.edited, strict=True))
    trials, untouched = list(state.trials), set[str]()
    for i, (now, whole) in enumerate(zip(state.trials, state.former, strict=True)):
        then = seen_part(whole)
        if not (i in edited and edited[i].any()) and _is_as_it_was(now, then):
            untouched.add(now.capture.name)
            trials[i] = replace(now, std=then.std)
    edit = replace(edit, untouched=frozenset(untouched))
    state = replace(state, trials=tuple(trials), edit=edit, weighed=edit.weighed)
    if edit.is_first_to_predict or edit.weighed.mass_kg != edit.settled.mass_kg:
        return state
    return _of_touched_trials(state, edit)


def _of_touched_trials(state: FitState, edit: Edit) -> FitState:
    """Without the others."""
    taken = [i for i, trial in enumerate(state.trials) if trial.capture.name not in edit.untouched]
    if not set(taken) & set(state.fitted):
        taken = sorted({*taken, state.fitted[0]})  # one has the inertias and the notes on them
    edited = dict(zip(state.fitted, edit.edited, strict=True))
    fitted = [i for i in taken if i in edited]
    gains = tuple(edit.weighed.gains[state.fitted.index(i)] for i in fitted)
    weighed = replace(edit.weighed, gains=gains)
    return replace(
        state,
        trials=tuple(state.trials[i] for i in taken),
        whole=tuple(state.whole[i] for i in taken),
        fitted=tuple(taken.index(i) for i in fitted),
        weighed=weighed,
        edit=replace(edit, edited=tuple(edited[i] for i in fitted), weighed=weighed),
    )


def _is_as_it_was(trial: TrialFit, former: TrialFit) -> bool:
    """Whether the same forces count, by the same words."""
    now, then = trial.mask, former.mask
    if now is None or then is None:
        return now is then
    same = now.reasons == then.reasons and now.sources == then.sources
    return same and np.array_equal(now.counts, then.counts) and trial.proposals == former.proposals


def all_trials(state: FitState) -> tuple[TrialFit, ...]:
    """Those of the solve, and of the former fit those that it left."""
    solved = {trial.capture.name: trial for trial in state.trials}
    left = {
        trial.capture.name: replace(trial, seconds=dict.fromkeys(trial.seconds, 0.0))
        for trial in state.former
    }
    return tuple((left | solved).values())


def small_edit(
    fits: Sequence[TrialFit],
    weighed: MassAndGains,
    groundwork: Groundwork,
    settings: Settings,
    extension: Extension | None,
) -> Edit | None:
    """The edit, if it can be followed near it alone; None where all frames have to be asked.

    Flags change what plates say of the mass and of a trial's gain by next to nothing, and with it every
    frame: so little is left as it was. A mass that moves a little more scales all forces and torques, and
    bends no motion; a trial whose plates' forces do not scale with it is made anew. What adds up over many
    edits is held against the last fit of all frames.

    Args:
        fits: that take part, with contacts and mask.
        weighed: by plates.
        groundwork: of the former fit.
        settings: of every stage.
        extension: what acts beside the recorded forces; its parameters hang on all frames.
    """
    settled = groundwork.settled
    names = {fit.capture.name for fit in fits}
    if extension is not None or settled is None or groundwork.phi is None or names != settled.known.keys():
        return None
    if any(fit.spline is None for fit in fits):
        return None
    learnt, kinds = None, None
    if settings.prediction.enabled and (groundwork.learnt or any(misses_a_force(fit) for fit in fits)):
        learnt, kinds = learnt_before(fits, groundwork), groundwork.prediction_kinds
        first = all(fit.prediction_spline is None for fit in fits)
        if learnt is None and (kinds is None or not first):
            return None
    weights = settings.trajectory
    mass_kg = weighed.mass_kg
    if abs(mass_kg / _mass_to_all(settled) - 1) > MOST_SCALED * weights.edit_gain:
        return None
    if abs(mass_kg / settled.mass_kg - 1) <= weights.edit_gain:
        mass_kg = settled.mass_kg
    scale = mass_kg / settled.mass_kg
    gains = [(now, settled.gains[f.capture.name] / scale) for f, now in zip(fits, weighed.gains, strict=True)]
    regained = [abs(now / then - 1) > weights.edit_gain for now, then in gains]
    known = [fit.forces_known for fit in fits]
    whole = [frames_of(list(settled.known_to_all[f.capture.name]), f.motion.frames) for f in fits]
    before = [frames_of(list(settled.known[f.capture.name]), f.motion.frames) for f in fits]
    changed = sum(int((now != then).sum()) for now, then in zip(known, whole, strict=True))
    if changed > weights.edits_last * sum(int(then.sum()) for then in whole):
        return None
    edited = tuple((now != then) | anew for now, then, anew in zip(known, before, regained, strict=True))
    spans = spans_near(edited, [fit.motion for fit in fits], weights)
    if sum(span.frames for span in spans) > MOST_NEAR * sum(len(frames) for frames in edited):
        return None
    taken = tuple(now if anew else then for (now, then), anew in zip(gains, regained, strict=True))
    kept = replace(weighed, mass_kg=mass_kg, gains=taken)
    inertias = InertiasBefore(groundwork.phi, settled.asked_phi)
    return Edit(edited, kept, settled, inertias, learnt, kinds)


def _mass_to_all(settled: SettledFit) -> float:
    return settled.mass_to_all_kg or settled.mass_kg


def settled_fit(state: FitState, settings: TrajectorySettings) -> SettledFit:
    """What the next re-solve goes by."""
    assert state.result is not None
    assert state.weighed is not None
    known = {fit.capture.name: tuple(runs(fit.forces_known)) for fit in state.members}
    gains = dict(zip(known, state.weighed.gains, strict=True))
    if state.edit is not None:
        known, gains = {**state.edit.settled.known, **known}, {**state.edit.settled.gains, **gains}
    return SettledFit(
        mass_kg=state.weighed.mass_kg,
        gains=gains,
        asked_phi=state.result.asked_phi,
        prediction_notes=state.prediction.notes if state.prediction is not None else (),
        known=known,
        known_to_all=known if state.edit is None else state.edit.settled.known_to_all,
        mass_to_all_kg=None if state.edit is None else _mass_to_all(state.edit.settled),
        mass_std=_mass_std(state.edit, state.result.border, state.weighed, settings),
    )


def _mass_std(
    edit: Edit | None, border: Border | None, weighed: MassAndGains, settings: TrajectorySettings
) -> MassStd | None:
    """After a small edit that of the former fit, whose inertias stay."""
    if edit is not None or border is None:
        return edit.settled.mass_std if edit else None
    return mass_std(border, weighed.std_kg / weighed.mass_kg, settings)
