"""A root of many trials, made by hand: small recordings, figures of a fit, proposals, and some reviews.

Nothing is solved, and no trial of them can be opened.
"""

import json
from pathlib import Path

import numpy as np

from addb_viewer.jobs.review_store import open_log
from annotations.events import FlagRange, SetActivity, SetStatus, Status
from annotations.work import Assign, Comment
from solver.common.typed_json import plain
from solver.contact.detected_ranges import Proposal
from solver.fitting.results.codec import Encoder
from tests.addb_viewer.fit_figures import force, moment, of_subject, of_trial

FRAMES, RATE = 400, 100
PEOPLE = ("Anna", "Ben", "Chen")


def write_root(root: Path, trials: int, seed: int = 1) -> None:
    """Make the folders: two in three fitted, one in three reviewed."""
    rng = np.random.default_rng(seed)
    for number in range(trials):
        folder = root / f"study {number // 100 + 1}" / f"S{number:04d}"
        folder.mkdir(parents=True)
        (folder / "walk.trc").write_text(_markers())
        (folder / "subject.toml").write_text('[trials.walk]\nmarkers = "walk.trc"\n')
        if number % 3:
            _write_fit(folder / "results", rng)
        if number % 3 == 1:
            _write_review(folder, number, rng)


def _markers() -> str:
    names = ("HEAD", "RASI", "LASI", "RHEEL", "LHEEL")
    lines = [
        "PathFileType\t4\t(X/Y/Z)\twalk.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits",
        f"{RATE}\t{RATE}\t10\t{len(names)}\tm",
        "Frame#\tTime\t" + "\t\t\t".join(names),
        "\t\t" + "\t".join(f"X{k}\tY{k}\tZ{k}" for k in range(1, len(names) + 1)),
    ]
    values = "\t".join(["0.0\t1.0\t0.0"] * len(names))
    return "\n".join([*lines, *(f"{k + 1}\t{k / RATE}\t{values}" for k in range(10))]) + "\n"


def _write_fit(results: Path, rng: np.random.Generator) -> None:
    """Figures as `fit --json` has them, and proposals as the fit's file keeps them."""
    lost, force_BW, moment_BWh = (
        int(rng.integers(0, 150)),
        float(rng.gamma(2, 0.02)),
        float(rng.gamma(2, 0.003)),
    )
    places = sorted(int(place) for place in rng.integers(0, FRAMES - 40, rng.integers(0, 4)))
    proposals = tuple(
        Proposal((place, place + 30), "calcn_r", "notOverForcePlate", float(rng.uniform(0.3, 1)), {})
        for place in places
    )
    encoder = Encoder(results)
    tree = {"fields": {"capture": {"fields": {"name": "walk"}}, "proposals": encoder.encode(proposals)}}
    (results / "solve-1" / "trials").mkdir(parents=True)
    np.savez(results / "solve-1" / "trials" / "walk.npz", tree=np.array(json.dumps(tree)), **encoder.arrays)
    trial = of_trial(
        frames=FRAMES,
        rate_hz=RATE,
        frames_with_force_used=FRAMES - lost,
        frames_used_ranges=((lost // 2, FRAMES - (lost - lost // 2)),),
        mask_source=str(rng.choice(["proposals", "review + proposals", "review.json", "none"])),
        linear_residual=force(700.0 * force_BW, force_BW),
        angular_residual=moment(1200.0 * moment_BWh, moment_BWh),
    )
    head = plain(of_subject(trial, files=("fit.json", "solve-1/trials/walk.npz")))
    (results / "fit.json").write_text(json.dumps(head))


def _write_review(folder: Path, number: int, rng: np.random.Generator) -> None:
    first, second = rng.permutation(PEOPLE)[:2]
    with open_log(folder) as log:
        log.append("walk", FlagRange(100, 150, "notOverForcePlate", "calcn_r"), str(first))
        log.append("walk", SetActivity(0, FRAMES, str(rng.choice(["walk", "run", "jump"]))), str(first))
        if number % 7 == 0:
            log.append("walk", FlagRange(120, 150, "forceDiscrepancy", "calcn_r"), str(second))
        if number % 2:
            log.append("walk", SetStatus(Status.FINISHED), str(first))
        if number % 5 == 0:
            log.work.append(["walk"], Assign(str(second)), str(first))
            log.work.append(["walk"], Comment("Is that a stumble?", frame=120), str(first))
