"""A real walk judged on all layouts of held-out forces."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.subject.opened_subject import open_subject
from solver.common.progress import silent
from solver.common.typed_json import plain
from solver.dynamics.cross_validation.held_out_layouts import LAYOUTS
from solver.fitting.held_out_stage import complete_held_out, judged_layout, layouts_due
from solver.fitting.pipeline import solve
from solver.fitting.settings import Settings
from solver.fitting.summary import summary


@pytest.fixture(scope="module")
def walk(real_data):
    return solve(open_subject(real_data / "walk_gait2354_subject01"), Settings())


@pytest.mark.slow
def test_every_known_frame_but_the_ends_is_held_out_and_the_markers_stand_beside(walk):
    assert layouts_due(walk) == LAYOUTS
    came = []
    judged = complete_held_out(walk, Settings(), silent, came=came.append)
    assert judged.held_out_layouts == tuple(came)
    assert layouts_due(judged) == ()
    trial = judged.trials[0]
    block = round(Settings().trajectory.held_out_block_s * trial.motion.rate)
    known = np.flatnonzero(trial.forces_known)
    blocks = [w.trials["walk1"] for w in judged.held_out_layouts if w.kind == "blocks"]
    seen = np.zeros(trial.motion.frames, dtype=bool)
    for layout in blocks:
        for start, end in layout.ranges:
            seen[start:end] = True
    assert len(blocks) == 6
    assert seen[known[block:-block]].all()
    figures = plain(summary(judged))["trials"][0]["held_out_layouts"]
    for kind in ("blocks", "steps"):
        force, moment = figures[kind]["force"], figures[kind]["moment"]
        assert all(3 <= hz <= 30 for of in (force, moment) for hz in of["markers_cutoffs_hz"])
        assert 0 < force["rms"] < 100 < 10 * force["markers_rms"] < 1000
    first = judged.held_out_layouts[0].trials["walk1"]
    assert trial.held_out is not None
    np.testing.assert_allclose(
        first.missed.sum(axis=0)[0],
        np.sum(trial.held_out.residual_root[trial.held_out.frames, :3] ** 2),
    )


@pytest.mark.parametrize("layout", [("blocks", 2), ("steps", 1)])
def test_neither_the_fit_nor_the_markers_cutoff_has_seen_the_forces_that_judge_it(walk, layout):
    """Forces of the held-out frames moved by ± d: where nobody saw them, the squares add up to the penny."""
    plain = judged_layout(walk, layout, Settings(), silent).trials["walk1"]
    d, sums = 150.0, []
    for sign in (1, -1):
        trial = walk.trials[0]
        wrench = trial.contacts.wrench_ground.copy()
        for start, end in plain.ranges:
            wrench[start:end, 0, 1] += sign * d
        contacts = replace(trial.contacts, wrench_ground=wrench)
        edited = replace(walk, trials=(replace(trial, contacts=contacts),))
        told = judged_layout(edited, layout, Settings(), silent).trials["walk1"]
        assert told.markers_hz == plain.markers_hz
        sums.append((told.missed[:, 0], told.markers_missed[:, 0]))
    for ours, before in zip(np.add(*sums), (plain.missed[:, 0], plain.markers_missed[:, 0]), strict=True):
        np.testing.assert_allclose(ours, 2 * before + 2 * plain.frames * d**2, rtol=1e-6)
