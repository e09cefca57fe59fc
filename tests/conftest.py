"""What all tests share: where the real recordings lie, and saying so when they are missing."""

import os
from pathlib import Path

import pytest

PROJECT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def real_data() -> Path:
    """The folder of real recordings: $ADDB_DATA, else ../shared/data beside the project."""
    folder = Path(os.environ.get("ADDB_DATA", PROJECT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"real recordings not found in {folder}; set ADDB_DATA to their folder")
    return folder
