"""docs/reference/api.md names everything that is public."""

import re
from pathlib import Path

import pytest

import addb_viewer
from addb_viewer import Cause, Diagnosis, Fit, FittedTrial, Series, Subject, Table

PAGE = (Path(__file__).parents[3] / "docs" / "reference" / "api.md").read_text(encoding="utf-8")
CODE = " ".join(a or b for a, b in re.findall(r"`([^`\n]+)`|```python(.*?)```", PAGE, re.S))
NAMED = set(re.findall(r"\w+", CODE))
ON_ANY = {
    "trials",
    "shape",
    "unit",
    "key",
    "file",
    "new",
    "name",
    "notes",
    "columns",
    "rate",
    "feet",
    "title",
}


def members(kind):
    annotated = {name for base in kind.__mro__ for name in getattr(base, "__annotations__", {})}
    own = {name for base in kind.__mro__ for name in vars(base)}
    return {name for name in own | annotated if not name.startswith("_")} - ON_ANY


@pytest.mark.parametrize("name", sorted(set(addb_viewer.__all__) - {"__version__"}))
def test_every_public_name_stands_on_the_page(name):
    assert name in NAMED


@pytest.mark.parametrize("kind", [Subject, Fit, FittedTrial, Diagnosis, Cause, Series, Table])
def test_every_member_stands_on_the_page(kind):
    assert members(kind) - NAMED == set()
