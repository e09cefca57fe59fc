"""A trial that a solve fails on is left out, with the reason; the others are fitted as if without it."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TypeVar

from numpy.linalg import LinAlgError

from solver.capture.capture import Subject, TrialFiles, UnreadTrial, UnusedFile
from solver.capture.subject.opened_subject import unused
from solver.common.errors import Cancelled, FitError, SolverError

Trial = TypeVar("Trial")
Result = TypeVar("Result")
Failed = tuple[UnreadTrial, ...]
UNSOLVABLE = (
    "its markers or forces leave nothing to solve, as frozen or invented numbers do. Look at it with "
    "`addb-viewer open`, and export it again or leave it out."
)


class TrialFailedError(Exception):
    """Something about one trial alone cannot be computed; its cause says what."""

    def __init__(self, trial: str) -> None:
        """Not yet left out.

        Args:
            trial: its name.
        """
        super().__init__(trial)
        self.trial = trial


@contextmanager
def about(trial: str) -> Iterator[None]:
    """Whatever goes wrong inside is this trial's doing, but for an end that somebody asked for.

    Raises:
        TrialFailedError: from what went wrong.
    """
    try:
        yield
    except (Cancelled, MemoryError, TrialFailedError):
        raise
    except Exception as error:
        raise TrialFailedError(trial) from error


def together(
    trials: Sequence[Trial], name_of: Callable[[Trial], str], solve_some: Callable[[Sequence[Trial]], Result]
) -> Result:
    """Solve trials together; where that breaks down in a way nobody foresaw, find the one that does so alone.

    Args:
        trials: of a subject.
        name_of: each of them.
        solve_some: solves these.

    Raises:
        TrialFailedError: from what that trial alone does.
    """
    try:
        return solve_some(trials)
    except (SolverError, MemoryError, TrialFailedError):
        raise
    except Exception as error:
        if len(trials) == 1 and isinstance(error, LinAlgError):
            raise TrialFailedError(name_of(trials[0])) from error
        for trial in trials if len(trials) > 1 else ():
            with about(name_of(trial)), suppress(SolverError):  # a trial may lack alone what others have
                solve_some([trial])
        raise


def without_failing(
    subject: Subject, names: Sequence[str] | None, solve_some: Callable[..., Result]
) -> Result:
    """Solve trials together, without those that fail.

    Args:
        subject: whose.
        names: of the wanted trials; None for all.
        solve_some: solves some of the subject's trials, given which `failed` before.

    Raises:
        SolverError: all of them fail; what the first one met.
    """
    chosen = _chosen(subject, names)
    failed: Failed = ()
    first: BaseException | None = None
    while True:
        left_out = {trial.name for trial in failed}
        try:
            return solve_some([files for files in chosen if files.name not in left_out], failed=failed)
        except TrialFailedError as failure:
            first = first or failure.__cause__
            assert first is not None
            if len(failed) + 1 == len(chosen):
                if isinstance(first, LinAlgError):
                    name = failed[0].name if failed else failure.trial
                    raise FitError(f"{subject.folder}: {name}: {UNSOLVABLE}") from first
                raise first from None
            files = next(files for files in chosen if files.name == failure.trial)
            failed = (*failed, UnreadTrial(files.name, _why(failure.__cause__, subject, files)))


def _chosen(subject: Subject, names: Sequence[str] | None) -> list[TrialFiles]:
    known = {t.name: t for t in subject.trials}
    for name in names or ():
        if name not in known:
            raise FitError(f"{subject.folder}: no trial '{name}'; trials: {', '.join(known)}.")
    return [known[name] for name in dict.fromkeys(names)] if names else list(subject.trials)


def _why(error: BaseException | None, subject: Subject, files: TrialFiles) -> UnusedFile:
    if isinstance(error, SolverError):
        return unused(error, subject, files.markers, files.forces)
    said = f"the fit breaks down on it ({type(error).__name__}: {error}). Look at it with `addb-viewer open`."
    return unused(SolverError(said), subject, files.markers, files.forces)
