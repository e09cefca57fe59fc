"""What it takes to make the same fit again: versions, files, settings, commands."""

import html
import re
from collections.abc import Mapping
from dataclasses import fields

from addb_viewer.recordings.recording import Recording, settings_of
from addb_viewer.report.markup import Safe, element, joined, pairs, table
from solver.settings import Settings, as_dict, as_toml

HASH = re.compile(r"[0-9a-f]{64}")
OF = "sha256 "


def repeat_part(recording: Recording) -> Safe:
    """Versions, input files by their hashes, settings that differ from the defaults, all settings."""
    fit = recording.fit
    settings = settings_of(fit)
    hashes = {k: v for k, v in fit.provenance.items() if HASH.fullmatch(v)}
    rest = {k: v for k, v in fit.provenance.items() if k not in hashes}
    changed = differing(settings)
    version = fit.provenance.get("addb-viewer", "")
    said = (
        f"These settings differ from the defaults of addb-viewer {version}:"
        if changed
        else f"All settings have the defaults of addb-viewer {version}."
    )
    pieces = [
        element("p", "With the same files, versions and settings, these commands give the same figures:"),
        element("pre", "addb-viewer fit SUBJECT\naddb-viewer report SUBJECT"),
        pairs((k.replace("_", " "), _readable(v)) for k, v in rest.items()),
        table(
            ("Input", "SHA-256"),
            [(k.removeprefix(OF), element("code", v)) for k, v in hashes.items()],
            "hashes",
        ),
        element("p", said),
    ]
    if changed:
        pieces.append(table(("Setting", "Here", "Default"), changed))
    pieces.append(
        element(
            "details",
            element("summary", "All settings, as a settings.toml"),
            element("pre", Safe(html.escape(as_toml(settings)))),
        )
    )
    return joined(pieces)


def _readable(value: str) -> str:
    return "not given" if value == "None" else value.strip("()").replace("'", "")


def differing(settings: Settings) -> list[tuple[str, str, str]]:
    """Name, value and default of each setting that is not at its default."""
    rows = []
    here, defaults = as_dict(settings), as_dict(Settings())
    for stage in (f.name for f in fields(settings)):
        own, usual = here[stage], defaults[stage]
        assert isinstance(own, Mapping)
        assert isinstance(usual, Mapping)
        rows += [(f"{stage}.{k}", str(v), str(usual[k])) for k, v in own.items() if v != usual[k]]
    return rows
