"""What is said of each cause stands in one place."""

import re
from pathlib import Path

import pytest

from benchmarks.faults.judge import NAMES
from solver.diagnosis.causes.about import OF_EACH_TRIAL, Place
from solver.diagnosis.causes.catalogue import ABOUT
from solver.simulate.faults.cases import IDS as HIDDEN

ROOT = Path(__file__).parents[1]
EDITED = {id for names in NAMES.values() for id in names.right}


@pytest.mark.parametrize("one", ABOUT.values(), ids=lambda one: one.id)
def test_everything_is_said_of_each_cause(one):
    words = ("title", "sentence", "remedy", "separate_by", "branch")
    said = {name: getattr(one, name) for name in words}
    said |= {"entry.target": one.entry.target, "entry.happened": one.entry.happened}
    lacking = [name for name, text in said.items() if not text]
    assert not lacking, f"ABOUT of {one.id} lacks {', '.join(lacking)}"
    assert all(s.usual < s.rare < s.most and s.why for s in one.sizes)


@pytest.mark.parametrize("one", ABOUT.values(), ids=lambda one: one.id)
def test_the_catalogue_names_each_parameter_that_is_read_out(one):
    named = set(re.findall(r"`([^`]+)`", one.entry.parameters))
    for reading in one.readings:
        axes = "xyz" if isinstance(reading, Place) else [""]
        whole = reading.parameters if isinstance(reading, Place) else reading.parameter
        read = {whole.replace("{}", axis).replace(OF_EACH_TRIAL, "TRIAL") for axis in axes}
        assert read <= named, f"entry of {one.id}: its parameters lack {sorted(read - named)}"


@pytest.mark.parametrize("id", ABOUT)
def test_each_cause_is_hidden_in_recordings_by_other_code(id):
    assert id in {*HIDDEN, *EDITED}, (
        f"nothing hides {id}: hide it in solver/simulate/faults/, or edit it in benchmarks/faults/editor/"
        " and name it as right in benchmarks/faults/judge.py"
    )


@pytest.mark.parametrize("room", ["addb_viewer", "solver/diagnosis", "solver/fitting/diagnosis_settings.py"])
def test_nobody_else_asks_for_the_id_of_a_cause(room):
    place = ROOT / room
    causes = ROOT / "solver" / "diagnosis" / "causes"
    files = [place] if place.is_file() else [f for f in place.rglob("*.py") if causes not in f.parents]
    assert files
    literal = re.compile("|".join(rf"[\"']{id}[\"']" for id in ABOUT))
    found = [f"{f.name}: {m[0]}" for f in files for m in literal.finditer(f.read_text(encoding="utf-8"))]
    assert found == []
