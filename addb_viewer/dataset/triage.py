"""Which trials deserve a look before a release is built: figures of the kept fits, causes, open decisions."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from addb_viewer.dataset.named_causes import named_causes
from addb_viewer.dataset.scanning import ScannedSubject
from addb_viewer.text.note_kinds import by_kind
from solver.common.errors import SolverError
from solver.common.small_files import json_content
from solver.contact.wrenches import DETECTION
from solver.fitting.results.store import default_folder

NOT_FITTED = "not fitted"
UNDECIDED = "detection left out frames about which nobody has decided"


@dataclass(frozen=True)
class TriageRow:
    """One trial; figures are None where there is no kept fit of it."""

    trial_id: str
    mass_kg: float | None = None
    mass_entered_kg: float | None = None
    linear_rms_bw: float | None = None
    angular_rms_bwh: float | None = None
    concerns: tuple[str, ...] = ()


def triaged(one: ScannedSubject) -> Iterator[TriageRow]:
    """All trials of a subject, whether they are taken or not, as its kept fit and diagnosis have them."""
    entered = one.subject.mass_kg
    file = default_folder(one.subject.folder) / "fit.json"
    try:
        figures: dict[str, Any] = json_content(file) if file.is_file() else {"trials": []}
        causes = named_causes(one.subject)
        fitted = {trial["name"]: trial for trial in figures["trials"]}
        for trial in one.subject.trials:
            trial_id, found = one.who.trial_id(trial.name), fitted.get(trial.name)
            if found is None:
                yield TriageRow(trial_id, mass_entered_kg=entered, concerns=(NOT_FITTED,))
                continue
            undecided = (UNDECIDED,) if DETECTION in found["mask_source"].split(" + ") else ()
            yield TriageRow(
                trial_id,
                figures["subject"]["mass_kg"],
                entered,
                (found["linear_residual"] or {}).get("rms_BW"),
                (found["angular_residual"] or {}).get("rms_BWh"),
                (*undecided, *concerns_of(trial.name, figures["notes"], causes)),
            )
    except (SolverError, ValueError, KeyError, TypeError, AttributeError, OSError) as error:
        yield TriageRow(one.who.subject_id, mass_entered_kg=entered, concerns=(f"{file}: {error}",))


def concerns_of(trial: str, notes: Sequence[str], causes: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    """What somebody should look at: causes that the diagnosis named, then notes of the fit that ask for it.

    Args:
        trial: its name.
        notes: of the fit; a trial's begin with its name.
        causes: as `diagnose --json` has them.
    """
    named = [
        f"{' '.join((cause['id'], cause['target'])).strip()} ({100 * cause['confidence']:.0f} %)"
        for cause in causes
        if cause.get("trial") in (None, trial)
    ]
    own = [note.removeprefix(f"{trial}: ") for note in notes if note.startswith(f"{trial}: ")]
    return (*named, *(found.key_findings for found in by_kind(own) if found.kind.decide))
