"""Exchanged labels that a diagnosis names, as a fit takes them once a person accepted them."""

from collections.abc import Mapping
from typing import Any

from addb_viewer.text.diagnosis_vocabulary import about, ranges_of
from solver.diagnosis.causes.about import CorrectedBy
from solver.fitting.fit import Fit
from solver.kinematics.label_faults.fault import EXCHANGED, Exchange


def exchanges_of(figures: Mapping[str, Any]) -> tuple[Exchange, ...]:
    """The exchanged labels of a diagnosis, one for each stretch of frames.

    Args:
        figures: in the shape of `diagnose --json`.
    """
    found = []
    for effect in figures.get("effects", ()):
        if about(effect).corrected_by is CorrectedBy.LABELS:
            one, _, other = effect["target"].partition("+")
            found += [
                Exchange(name, (one, other), start, end) for name, start, end in ranges_of(figures, effect)
            ]
    return tuple(found)


def exchange_in_words(exchange: Exchange, fit: Fit | None) -> str:
    """What every fit does from now on.

    Args:
        exchange: that somebody accepted.
        fit: the last one, which may have done so by itself; None where there is none.
    """
    frames = f"{exchange.start}-{exchange.end - 1} of {exchange.trial}"
    said = f"labels {' and '.join(exchange.labels)} are swapped back in frames {frames}, in every fit"
    if fit is not None and any(
        fault.done == EXCHANGED
        and not fault.accepted
        and set(fault.labels) == set(exchange.labels)
        and fault.start < exchange.end
        and exchange.start < fault.end
        for trial in fit.trials
        if trial.capture.name == exchange.trial
        for fault in trial.label_faults
    ):
        said += "; the last fit did that by itself"
    return said
