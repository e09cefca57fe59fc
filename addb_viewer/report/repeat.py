"""What it takes to make the same fit again: versions, files, settings, commands."""

import html
import re

from addb_viewer.recordings.recording import Recording
from addb_viewer.report.markup import Safe, element, joined, pairs, table
from solver.settings import Settings, as_dict, as_toml, by_name, from_dict

HASH = re.compile(r"[0-9a-f]{64}")
OF = "sha256 "


def repeat_part(recording: Recording) -> Safe:
    """Versions, input files by their hashes, settings that differ from the defaults, all settings."""
    fit = recording.fit
    settings = from_dict(fit.settings)
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
    usual = by_name(as_dict(Settings()))
    here = by_name(as_dict(settings))
    return [(name, str(value), str(usual[name])) for name, value in here.items() if value != usual[name]]
