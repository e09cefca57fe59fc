"""`manifest.json`: what is in a release, from what and how it was made, and which version it is."""

import hashlib
import json
import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Any

from addb_viewer.dataset.options import BuildOptions
from addb_viewer.dataset.schema import FORMAT_VERSION, schema_json
from addb_viewer.dataset.segments import LONGEST, SHORTEST
from addb_viewer.dataset.task import REASONS, MadeFile, Receipt
from solver.capture.plates.force_settings import CONDITIONING

FIRST_VERSION = "1.0.0"
TEXTS = ("croissant.json", "README.md", "DATASHEET.md", "CITATION.bib")  # that follow from the rest
_PACKAGES = ("addb-viewer", "numpy", "scipy", "pin", "pyarrow")


def manifest_of(
    name: str,
    options: BuildOptions,
    receipts: Mapping[str, Receipt],
    files: Mapping[str, MadeFile],
    trials: Sequence[Mapping[str, Any]],
    *,
    totals: Mapping[str, Any],
    previous: Mapping[str, Any] | None,
) -> dict[str, Any]:
    """All of it; no dates, no places.

    Args:
        name: of the release.
        options: that it was built with.
        receipts: by subject.
        files: by path.
        trials: rows of the table.
        totals: of the release.
        previous: manifest of the release that this one takes the place of.
    """
    settings = {_sha(one.settings): one.settings for one in receipts.values()}
    subjects = {
        subject: {
            "key": one.key,
            "inputs": dict(one.inputs),
            "settings": _sha(one.settings),
            "trials": [row["trial_id"] for row in trials if row["subject_id"] == subject],
            "frames": sum(row["frames_rows"] for row in trials if row["subject_id"] == subject),
        }
        for subject, one in sorted(receipts.items())
    }
    plain: dict[str, Any] = {
        "format_version": FORMAT_VERSION,
        "name": name,
        "created_with": {"python": platform.python_version(), **{p: version(p) for p in _PACKAGES}},
        "machine": platform.machine(),
        "rate_hz": options.rate_hz,
        "filter": {
            "cutoff_hz": CONDITIONING.cutoff_Hz,
            "nyquist_share": CONDITIONING.nyquist_share,
            "order": CONDITIONING.order,
            "passes": 2,
        },
        "segments": {"longest": LONGEST, "shortest": SHORTEST},
        "options": _told(options),
        "withdrawn": list(options.withdrawals),
        "gates": {level: dict(reasons) for level, reasons in REASONS.items()},
        "settings": dict(sorted(settings.items())),
        "subjects": subjects,
        "files": described(files),
        "totals": dict(totals),
        "schema_sha256": _sha(json.dumps(schema_json(), sort_keys=True)),
    }
    plain["version"] = next_version(previous, plain)
    if previous is not None:
        same = plain["version"] == previous["version"]
        told = (
            previous.get("previous") if same else {"name": previous["name"], "version": previous["version"]}
        )
        plain["previous"] = told
    return plain


def _told(options: BuildOptions) -> dict[str, Any]:
    """Options without the names and hashes of who withdrew."""
    plain = options.as_plain()
    del plain["withdrawn"]
    return plain | {"without": len(options.without)}


def next_version(previous: Mapping[str, Any] | None, now: Mapping[str, Any]) -> str:
    """A frame of an old subject changed: MAJOR; subjects or columns added: MINOR; other files: PATCH.

    Args:
        previous: manifest of the release before; None: there is none.
        now: of this one, without its version.
    """
    if previous is None:
        return FIRST_VERSION
    major, minor, patch = (int(part) for part in previous["version"].split("."))
    before, after = _frame_files(previous), _frame_files(now)
    if any(after.get(path) != digest for path, digest in before.items()):
        return f"{major + 1}.0.0"
    if set(after) - set(before) or previous["schema_sha256"] != now["schema_sha256"]:
        return f"{major}.{minor + 1}.0"
    return previous["version"] if _hashes(previous) == _hashes(now) else f"{major}.{minor}.{patch + 1}"


def _hashes(manifest: Mapping[str, Any]) -> dict[str, str]:
    """Of all files that do not themselves state the version."""
    return {path: one["sha256"] for path, one in manifest["files"].items() if path not in TEXTS}


def _frame_files(manifest: Mapping[str, Any]) -> dict[str, str]:
    return {path: one["sha256"] for path, one in manifest["files"].items() if path.startswith("frames/")}


def described(files: Mapping[str, MadeFile]) -> dict[str, dict[str, Any]]:
    """Size, hash and rows of each file, in order of their paths."""
    return {path: _file(one) for path, one in sorted(files.items())}


def _file(one: MadeFile) -> dict[str, Any]:
    plain: dict[str, Any] = {"sha256": one.sha256, "bytes": one.bytes}
    return plain if one.rows is None else plain | {"rows": one.rows}


def _sha(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
