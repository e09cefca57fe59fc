"""The report's shell: style, scripts, and a policy under which the page reaches nothing outside itself."""

import base64
import hashlib
import html
from collections.abc import Sequence
from importlib.resources import files

from addb_viewer.report.markup import Safe, text


def page_html(
    title: str, body: Safe, scripts: Sequence[str] = (), styles: Sequence[str] = ("report.css",)
) -> str:
    """A whole page.

    Args:
        title: of the window.
        body: what stands on it.
        scripts: names of this package's files; they run, and no other script does.
        styles: likewise, the later ones over the earlier.
    """
    sources = [_read(name) for name in scripts]
    hashes = " ".join(f"'sha256-{_digest(source)}'" for source in sources) or "'none'"
    policy = (
        f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src {hashes}; "
        "base-uri 'none'; form-action 'none'"
    )
    running = "".join(f"<script>{source}</script>" for source in sources)
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{html.escape(policy)}">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<meta name="color-scheme" content="light dark"><meta name="referrer" content="no-referrer">'
        f"<title>{text(title)}</title><style>{''.join(map(_read, styles))}</style></head>\n"
        f"<body>{body}{running}</body></html>\n"
    )


def _read(name: str) -> str:
    return files("addb_viewer.report").joinpath(name).read_text(encoding="utf-8")


def _digest(source: str) -> str:
    """As a content security policy names a script."""
    return base64.b64encode(hashlib.sha256(source.encode()).digest()).decode()
