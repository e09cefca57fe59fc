import json
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.hidden import cases
from benchmarks.hidden.cases import CLEAN, INSIDE, OUTSIDE, OVERSIZES, draw_setting, plan_public
from benchmarks.hidden.format import (
    CAUSES,
    NONE,
    SOMETHING_ELSE,
    Salts,
    SealError,
    check_seals,
    kept_salts,
    seal,
)
from solver.simulate.faults.cases import IDS
from solver.simulate.faults.hidden import UNSIZED
from solver.simulate.faults.physical import UNKNOWN
from solver.simulate.faults.worlds import draw_handout, plan_world
from solver.skeleton.default_body import default_skeleton

WORDS = ("effect", "hidden", "truth", "clean", "seed", "inside", "outside", "simulat", "synth")
TELLTALES = (*IDS, *UNKNOWN, *WORDS)
COUNT = 6


def short(plan_of_world):
    return replace(plan_of_world, duration=1.49, speed=1.25, trials=1)


@pytest.fixture(scope="module")
def made_twice(tmp_path_factory):
    """Six short cases of one walk, a third of each group, made twice with the same salts."""
    root = tmp_path_factory.mktemp("public")
    world = short(plan_world(np.random.default_rng(5), "walk", "treadmill"))
    with pytest.MonkeyPatch.context() as patch:
        drawn = (world, replace(draw_handout(np.random.default_rng(1), "generic"), zeroed=True))
        patch.setattr(cases, "draw_setting", lambda rng: (*drawn, int(rng.integers(2**31))))
        patch.setattr(cases, "IDS", ("plate_gain", "subject_mass"))
        (root / "truth").mkdir()
        (root / "truth" / "salts.json").write_text('{"draw": "%s"}' % ("5a" * 16))
        cases.make(root / "out", root / "truth", COUNT, 3)
        (root / "again_truth").mkdir()
        (root / "again_truth" / "salts.json").write_bytes((root / "truth" / "salts.json").read_bytes())
        cases.make(root / "again", root / "again_truth", COUNT, 3)
    return root


def bytes_below(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.mark.slow
def test_the_same_seed_and_salts_make_the_same_bytes(made_twice):
    assert bytes_below(made_twice / "out") == bytes_below(made_twice / "again")
    assert bytes_below(made_twice / "truth") == bytes_below(made_twice / "again_truth")


@pytest.mark.slow
def test_nothing_that_is_handed_out_tells_the_truth(made_twice):
    out = made_twice / "out"
    truths = [json.loads(p.read_text()) for p in sorted((made_twice / "truth").glob("case_*.json"))]
    assert Counter(t["group"] for t in truths) == {INSIDE: 2, OUTSIDE: 2, CLEAN: 2}
    assert {p.name for p in out.iterdir()} == {"cases.json", *(t["case"] for t in truths)}
    files, keys, models = set(), set(), set()
    for truth in truths:
        folder = out / truth["case"]
        files.add(tuple(sorted(p.name for p in folder.rglob("*"))))
        keys.add(tuple(line.split("=")[0] for line in (folder / "subject.toml").read_text().splitlines()))
        models.add((folder / "model.osim").read_bytes())
        for path in (folder, *folder.rglob("*")):
            assert path.stat().st_mtime == cases.FILE_TIME_S
        for path in folder.iterdir():
            text = path.read_text(encoding="utf-8").lower()
            assert not [word for word in TELLTALES if word in text], path
    assert len(files) == len(keys) == 1
    assert len(models) == 1  # the generic model is nobody's, whatever mass is entered
    listed = json.loads((out / "cases.json").read_text())
    assert set(listed) == {"cases"}
    assert [set(case) for case in listed["cases"]] == [{"name", "sha256"}] * COUNT
    assert [case["name"] for case in listed["cases"]] == sorted(t["case"] for t in truths)


@pytest.mark.slow
def test_forces_end_before_the_held_out_frames_and_the_truth_holds_them(made_twice):
    from solver.simulate.faults.hidden import read_recording

    for path in sorted((made_twice / "truth").glob("case_*.json")):
        truth = json.loads(path.read_text())
        (trial,) = read_recording(made_twice / "out" / truth["case"]).trials
        held_out = truth["held_out"][trial.name]
        assert held_out["first_frame"] + held_out["frames"] == trial.markers.frames
        assert held_out["first_frame"] - 1 < 0.8 * trial.markers.frames <= held_out["first_frame"]
        if truth["group"] == OUTSIDE:  # a clock of that size shortens the trial
            continue
        assert trial.markers.frames == 150
        assert min(p.times[-1] for p in trial.plates) > trial.markers.times[118]
        assert all(p.times[-1] < trial.markers.times[120] for p in trial.plates)
        vertical = np.array(held_out["force_N"])[held_out["scored"], 1]
        assert len(vertical) >= 20
        assert 0.6 < np.median(vertical) / (9.81 * truth["world"]["mass_kg"]) < 1.4


@pytest.mark.slow
def test_a_changed_truth_is_not_the_one_that_was_published(made_twice, tmp_path):
    for path in (made_twice / "truth").iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    listing = made_twice / "out" / "cases.json"
    assert check_seals(listing, tmp_path) == COUNT
    changed = tmp_path / "case_0002.json"
    changed.write_bytes(changed.read_bytes().replace(b"case_0002", b"case_0003"))
    with pytest.raises(SealError, match=r"case_0002.*not the one"):
        check_seals(listing, tmp_path)
    changed.unlink()
    with pytest.raises(SealError, match=r"case_0002.*no truth"):
        check_seals(listing, tmp_path)


def test_a_seal_is_the_digest_of_salt_and_truth():
    # sha256 of the bytes 00 01 followed by "abc", as `printf '\000\001abc' | sha256sum` gives it
    assert seal("0001", b"abc") == "c038ae3bc0bc351d1a67b5446f000f21df05e24bdfd434e905afd2c3eaf801e4"


def test_salts_stay_once_they_are_drawn(tmp_path):
    first = kept_salts(tmp_path, ["a"])
    more = kept_salts(tmp_path, ["a", "b"])
    assert more.draw == first.draw
    assert more.cases["a"] == first.cases["a"] != more.cases["b"]
    assert Salts("00" * 32, {}).seed(1) != Salts("01" * 32, {}).seed(1)


def test_the_recording_is_drawn_before_what_is_hidden_in_it():
    cases = plan_public(11, 90)
    worlds = np.random.default_rng(11).spawn(3)[0]
    for case in cases:
        assert (case.plan.world, case.plan.handout, case.plan.seed) == draw_setting(worlds)
    assert len({case.plan.world.seed for case in cases}) == len(cases)


def test_a_third_each_and_every_kind_of_outside():
    cases = plan_public(12, 300)
    assert Counter(c.group for c in cases) == {INSIDE: 100, OUTSIDE: 100, CLEAN: 100}
    assert {c.plan.ids[0] for c in cases if c.group == INSIDE} == set(CAUSES) - {NONE, SOMETHING_ELSE}
    outside = [c.plan for c in cases if c.group == OUTSIDE]
    unknown = [p for p in outside if p.kind == "unknown"]
    assert {p.ids[0] for p in unknown} == set(UNKNOWN)
    beyond = [p for p in outside if p.kind == "single"]
    assert {p.sizes[0] for p in beyond} == set(OVERSIZES)
    assert not {p.ids[0] for p in beyond} & {*UNSIZED, "subject_mass"}
    assert 30 <= len(unknown) <= 70
    assert [c.group for c in cases] != [c.group for c in plan_public(13, 300)]


@pytest.mark.slow
def test_a_wrong_mass_leaves_the_generic_model_as_it_is(made_twice):
    truths = [json.loads(p.read_text()) for p in (made_twice / "truth").glob("case_*.json")]
    assert any(e["id"] == "subject_mass" for t in truths for e in t["effects"])
    from solver.skeleton.osim import load_skeleton

    for truth in truths:
        model = load_skeleton(made_twice / "out" / truth["case"] / "model.osim")
        assert model.mass == pytest.approx(default_skeleton().mass)
