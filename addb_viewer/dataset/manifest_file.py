"""Reading what a release says of itself; nothing but Python is needed for it."""

import json
from pathlib import Path
from typing import Any

from addb_viewer.dataset.errors import ReleaseError
from addb_viewer.dataset.schema import FORMAT_VERSION

FILE = "manifest.json"


def read_manifest(release: Path) -> dict[str, Any]:
    """What a release says of itself.

    Raises:
        ReleaseError: the folder is no release, or one of a format that this version does not read.
    """
    path = release / FILE
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
        written = manifest["format_version"]
    except FileNotFoundError as error:
        raise ReleaseError(f"{release}: no release, since it has no {FILE}. Give another folder.") from error
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ReleaseError(f"{path}: cannot be read ({error}). Build the release anew.") from error
    if written != FORMAT_VERSION:
        remedy = "Update addb-viewer." if written > FORMAT_VERSION else "Build it anew into another folder."
        raise ReleaseError(f"{release}: has format {written}, this version reads {FORMAT_VERSION}. {remedy}")
    return manifest
