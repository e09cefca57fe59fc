"""A subject's B3D file of a release: its trials in segments, with labels and verdicts."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from addb_viewer.dataset.frame_rows import TrialRows
from addb_viewer.dataset.identifiers import labels_without_names
from addb_viewer.dataset.release_subject import ReleaseSubject
from addb_viewer.dataset.trial_labels import UNKNOWN, TrialLabels
from addb_viewer.dataset.trials_on_demand import TrialsOnDemand
from solver.capture.formats.b3d.schema import B3dFile, B3dTrial, TrialType
from solver.export.b3d.cutting import cut

CUSTOM = ("counts", "torque_predicted", "detected_ok")  # a number a frame each, 0 or 1
TYPES = {
    "treadmill": TrialType.TREADMILL,
    "overground": TrialType.OVERGROUND,
    "static": TrialType.STATIC,
    "other": TrialType.OTHER,
}


def subject_b3d(
    whole: B3dFile, who: ReleaseSubject, notes: Sequence[str], segments: Sequence[B3dTrial]
) -> B3dFile:
    """The file: whose it is and on what terms stands in its header.

    Args:
        whole: all trials on the grid.
        who: the subject.
        notes: of the fit, without names.
        segments: what goes into the file.
    """
    first = whole.header.notes.split("\n", 1)[0]
    header = replace(
        whole.header,
        notes="\n".join([first, *notes]),
        marker_name=tuple(labels_without_names(whole.header.marker_name)),
        subject_tag=(who.source, *((who.licence,) if who.licence else ())),
        href=who.url or "",
        age_years=min(whole.header.age_years, 90),
        custom_value_name=CUSTOM,
        custom_value_length=np.ones(len(CUSTOM), np.int32),
    )
    return B3dFile(header, segments)


def segments_of(
    whole: B3dFile, rows: Sequence[TrialRows], labels: Mapping[str, TrialLabels]
) -> TrialsOnDemand:
    """Each segment of each trial as a trial of its own, cut when it is asked for.

    Args:
        whole: all trials on the grid, in the order of the rows.
        rows: of the trials.
        labels: by trial.
    """
    found = []
    for trial, one in zip(whole.trials, rows, strict=True):
        verdicts, said = one.gridded.verdicts, labels[one.gridded.name]
        dynamics = one.gridded.trial.dynamics
        predicted = None if dynamics is None else dynamics.wrench_is_predicted
        none = np.zeros_like(verdicts.counts)
        flags = (
            verdicts.counts,
            none if predicted is None else np.any(predicted, axis=1),
            verdicts.detected_ok,
        )
        sensors = replace(trial.sensors, custom_values=np.column_stack(flags).astype(float))
        header = replace(
            trial.header,
            missing_GRF_reason=verdicts.missing_number.astype(np.int32),
            has_manual_GRF_annotation=verdicts.reviewed,
            trial_type=TYPES[said.trial_type],
            trial_tag=tuple(tag for tag in (said.activity, said.activity_sub) if tag and tag != UNKNOWN),
        )
        own = replace(trial, header=header, sensors=sensors)
        found += [partial(cut, own, piece.start, piece.end, k) for k, piece in enumerate(one.cuts.kept)]
    return TrialsOnDemand(tuple(found))
