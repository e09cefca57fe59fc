"""What a release holds, and where its numbers come from, in words."""

from collections import Counter
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from typing import Any

from addb_viewer.dataset.errors import ReleaseError
from addb_viewer.dataset.reader import Release
from addb_viewer.text.amounts import counted, lasting

_FIGURES = (
    ("marker_rms_m", "marker error, RMS", "m"),
    ("linear_rms_bw", "residual force, RMS", "body weights"),
    ("angular_rms_bwh", "residual moment, RMS", "body weights · height"),
    ("held_out_linear_rms_N", "residual force on held-out blocks, RMS", "N"),
    ("average_speed_m_s", "average speed", "m/s"),
)


def overview(release: Release) -> Iterator[str]:
    """How much there is, from whom, on what terms, and what was left out; a line each."""
    manifest, totals = release.manifest, release.manifest["totals"]
    yield f"{manifest['name']} {manifest['version']}"
    yield (
        f"{counted(totals['subjects'], 'subject')}, {counted(totals['persons'], 'person')}, "
        f"{counted(totals['trials'], 'trial')}, {counted(totals['segments'], 'segment')}"
    )
    hours, count = lasting(totals["hours"]), lasting(totals["hours_counting"])
    yield f"{counted(totals['frames'], 'frame')}, {hours}; of these {count} count"
    rows = release.subjects.to_pylist()
    for source in sorted({row["source"] for row in rows}):
        own = [row for row in rows if row["source"] == source]
        licences = ", ".join(sorted({row["licence"] for row in own}))
        yield f"  {source}: {counted(len(own), 'subject')}, {licences}"
    trials = release.trials.to_pylist()
    activities = Counter(row["activity"] for row in trials)
    told = ", ".join(f"{name} {count}" for name, count in sorted(activities.items()))
    suggested = sum(row["activity_by"] not in ("person", "nobody") for row in trials)
    yield f"activities, trials: {told}; {suggested} of {len(trials)} as rules suggest"
    reasons: dict[str, int] = {}
    for row in release.table("left_out").to_pylist():
        reasons[row["reason"]] = reasons.get(row["reason"], 0) + 1
    left = ", ".join(f"{name} {count}" for name, count in sorted(reasons.items()))
    yield f"left out: {left or 'nothing'}"
    made = ", ".join(f"{name} {version}" for name, version in manifest["created_with"].items())
    yield f"made with {made}"


def trial_in_words(release: Release, name: str) -> Iterator[str]:
    """A trial: what is in it, from which files, how it was made, who decided what.

    Args:
        release: that holds it.
        name: its id, or the end of it where that is one trial's alone.

    Raises:
        ReleaseError: there is no such trial, or several.
    """
    trial = _trial(release, name)
    (subject,) = (r for r in release.subjects.to_pylist() if r["subject_id"] == trial["subject_id"])
    made = release.manifest["subjects"][subject["subject_id"]]
    yield trial["trial_id"]
    yield f"person {subject['person_id']}, licence {subject['licence']}, consent {subject['consent']}"
    yield (
        f"{trial['frames']} frames from {trial['rate_native_hz']:g} Hz, {trial['duration_s']:.2f} s; forces "
        f"and pass F below {trial['filter_cutoff_hz']:g} Hz"
    )
    sure = trial["activity_confidence"]
    by = f"by {trial['activity_by']}" + ("" if sure is None else f", {100 * sure:.0f} % sure")
    yield (
        f"activity {trial['activity']} ({by}); which forces count: "
        f"{trial['mask_source']}{'' if trial['reviewed'] else ', review not finished'}"
    )
    for column, words, unit in _FIGURES:
        if trial[column] is not None:
            yield f"{words}: {trial[column]:.4g} {unit}"
    for row in release.table("segments").to_pylist():
        if row["trial_id"] == trial["trial_id"]:
            span = f"frames {row['start_frame']} to {row['end_frame'] - 1}"
            yield f"segment {row['segment']}: {span}, {row['counted']} count"
    for row in release.table("reviews").to_pylist():
        if row["trial_id"] == trial["trial_id"]:
            who = f", {row['reviewer']}" if row["reviewer"] else ""
            yield (
                f"not counted: frames {row['start_frame']} to {row['end_frame'] - 1}, {row['foot']}, "
                f"{row['reason']} ({row['source']}{who})"
            )
    yield f"fit {made['key'][:16]}, settings {made['settings'][:16]} (manifest.json has both whole), from:"
    for path, digest in made["inputs"].items():
        yield f"  {path}  sha256 {digest[:16]}"


def _trial(release: Release, name: str) -> Mapping[str, Any]:
    rows = release.trials.to_pylist()
    found = [row for row in rows if row["trial_id"] == name]
    found = found or [row for row in rows if row["trial_id"].endswith(f"/{name}")]
    if len(found) == 1:
        return found[0]
    names = [row["trial_id"] for row in found or rows]
    near = names[:5] if found else get_close_matches(name, names, cutoff=0.3) or names[:5]
    why = "several trials end so" if found else "no such trial; nearest"
    raise ReleaseError(f"{name}: {why}: {', '.join(near)}")
