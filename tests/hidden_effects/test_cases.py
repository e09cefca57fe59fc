import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from solver.simulate.faults.cases import IDS, made, one_case
from solver.simulate.faults.hidden import REFERENCE_SIZE, read_recording, write_recording
from solver.simulate.faults.measurement_effects import MEASUREMENT, hide_measurement

HIDER = Path(__file__).parents[2] / "solver" / "simulate" / "faults"


def test_the_hider_knows_nothing_of_the_finder():
    files = list(HIDER.glob("*.py"))
    assert files
    for path in files:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            modules = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            modules += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not any(m.startswith(("solver.diagnosis", "solver.fitting")) for m in modules)


def test_every_id_has_a_reference_size():
    unsized = sorted(set(IDS) ^ set(REFERENCE_SIZE))
    assert not unsized, f"REFERENCE_SIZE in hider/hidden.py and what can be hidden differ by {unsized}"


@pytest.mark.parametrize("id", list(MEASUREMENT))
def test_an_effect_changes_the_files_it_is_about(recording, id):
    changed, hidden = hide_measurement(recording, id, 1.0, np.random.default_rng(2))
    assert hidden.id == id
    about_markers = id in ("marker_slip", "marker_swap", "capture_scale", "soft_tissue")
    before, after = recording.trials[0], changed.trials[0]
    same_markers = before.markers.frames == after.markers.frames and np.array_equal(
        before.markers.positions_ground, after.markers.positions_ground, equal_nan=True
    )
    same_forces = all(
        a.samples == b.samples
        and np.array_equal(a.force_ground, b.force_ground)
        and np.array_equal(a.cop_ground, b.cop_ground, equal_nan=True)
        for a, b in zip(before.plates, after.plates, strict=True)
    )
    if id == "subject_mass":
        assert same_markers
        assert same_forces
        assert changed.mass_kg == pytest.approx(recording.mass_kg / hidden.parameters["mass_factor"])
        assert changed.model.mass == pytest.approx(changed.mass_kg)
    elif about_markers:
        assert same_forces
        assert not same_markers
    else:
        assert not same_forces
    for name in hidden.parameters:
        assert np.isfinite(hidden.parameters[name])


def test_what_is_written_reads_back(recording, tmp_path):
    write_recording(tmp_path / "s", recording)
    back = read_recording(tmp_path / "s")
    assert back.mass_kg == pytest.approx(recording.mass_kg, rel=1e-5)
    assert back.marker_bodies.items() <= recording.marker_bodies.items()
    one, other = recording.trials[0], back.trials[0]
    np.testing.assert_allclose(one.markers.positions_ground, other.markers.positions_ground, atol=1e-8)
    for a, b in zip(one.plates, other.plates, strict=True):
        np.testing.assert_allclose(a.force_ground, b.force_ground, atol=1e-8)
        np.testing.assert_allclose(a.moment_ground, b.moment_ground, atol=1e-6)


def test_the_same_seed_makes_the_same_case(walk_plan):
    plan = one_case("a", ("plate_bias", "external_contact"), 9, world=walk_plan)
    (one, truth), (two, again) = made(plan), made(plan)
    assert truth == again
    np.testing.assert_array_equal(one.trials[0].plates[0].force_ground, two.trials[0].plates[0].force_ground)


def test_what_belongs_to_the_body_is_in_every_trial_and_a_contact_in_one(walk_plan):
    twice = replace(walk_plan, trials=2)
    clean = made(one_case("c", (), 9, world=twice))[0]
    assert [t.name for t in clean.trials] == ["walk", "walk_2"]
    for ids, changed in ((("segment_mass",), 2), (("external_contact",), 1), (("plate_gain",), 2)):
        recording, truth = made(one_case("c", ids, 9, world=twice))
        recorded = [t.plates[0].force_ground for t in recording.trials]
        same = [
            np.allclose(a, b.plates[0].force_ground, atol=0.2)
            for a, b in zip(recorded, clean.trials, strict=True)
        ]
        assert same.count(False) == changed, ids
        if changed == 1:
            assert truth.effects[0].trial == clean.trials[same.index(False)].name
