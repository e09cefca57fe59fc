"""One word a thing, the field's own: words that were given up do not come back."""

import re
import subprocess
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[1]
PLACES = (
    "solver",
    "annotations",
    "addb_viewer",
    "benchmarks",
    "scripts",
    "tests",
    "docs",
    "README.md",
    "CONTRIBUTING.md",
)
SUFFIXES = {".py", ".js", ".toml", ".md"}

# The retired word, as a part of identifiers and texts, and what is said instead.
RETIRED = {
    "foret(old|ell)": "predicted, predict, prediction",
    "inferred": "predicted",
    "sister": "prediction fit",
    "with(held|hold)": "held out",
    "heldout": "held_out",
    "witness": "direct check; of a plate's sign: evidence",
    "accus(e|ing)": "suspect",
    "(?<![a-z])rungs?(?![a-z])": "noise scale",
    "(?<![a-z])ladder": "noise grid",
    "obeying_": "apply_reviews, fit_to_forces",
    "unheard": "unrecorded",
    "(?<![a-z])righted": "corrected",
    "put_right": "corrected",
    "(?<![a-z])mend(s|ed)?(?![a-z])": "correct",
    "demanded": "required",
    "(?<![a-z])flesh": "soft tissue",
    "(?<![a-z])clues?(?![a-z])": "evidence",
    "happenings": "events",
    "(?<![a-z])talks(?![a-z])": "comments",
    "in_short(?![a-z])": "key findings",
    "give_back": "release_memory",
    "freed_memory": "memory_release",
    "student[._]": "statistics",
    "made[-_]up": "synthetic",
    "puppet": "kinematic gait",
    "told_as.{0,6}lead|a lead, not": "tentative",
    "(?<!of )(?<![a-z])course(?![a-z])": "time history",
}
RETIRED_IN_DOCS = {
    "(?<![a-z])told(?![a-z_])": "stated, estimated, reported, given: what is meant",
    "(?<![a-z])strangers?(?![a-z])": "untrusted",
    "(?<![a-z])unmeasured(?! external)(?![A-Z_])": "predicted; that no plate measured",
    "(?<![a-z])blind(?![a-z])": "held out",
    "motion demands": "motion requires",
}  # code has some of these still
ITSELF = Path(__file__).name


def _files():
    listed = subprocess.run(
        ["git", "ls-files", *PLACES], cwd=PROJECT, capture_output=True, text=True, check=False
    ).stdout.split("\n")
    return [PROJECT / name for name in listed if Path(name).suffix in SUFFIXES and Path(name).name != ITSELF]


FILES = _files()


@pytest.mark.skipif(not FILES, reason="no checkout of Git")
@pytest.mark.parametrize(("retired", "instead"), RETIRED.items())
def test_a_retired_word_does_not_come_back(retired, instead):
    pattern = re.compile(retired)
    found = [
        f"{file.relative_to(PROJECT)}:{number}: {line.strip()[:80]}"
        for file in FILES
        if file.is_file()
        for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), start=1)
        if pattern.search(line)
    ]
    assert not found, f"say '{instead}': {found[:5]}"


@pytest.mark.parametrize(("retired", "instead"), RETIRED_IN_DOCS.items())
def test_a_word_retired_in_the_documentation_does_not_come_back(retired, instead):
    pages = [*(PROJECT / "docs").glob("**/*.md"), PROJECT / "README.md", PROJECT / "CONTRIBUTING.md"]
    found = [page.name for page in pages if re.search(retired, page.read_text(encoding="utf-8"))]
    assert not found, f"say '{instead}': {found}"
