"""The page of findings: which diagnoses are wanted, what is kept of them, and how they are told."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace

import pytest

from benchmarks import findings
from benchmarks.findings import Case, answer, cases_of, row, table
from benchmarks.sections import replaced
from solver.capture.capture import Subject, TrialFiles
from solver.common.errors import FitError

FIGURES = {
    "trials": ["walk", "stairs"],
    "verdict": "explained",
    "effects": [
        {
            "id": "off_plate_step",
            "target": "calcn_l",
            "parameters": {"force_y_N": {"value": 519.4, "std": 47.26}},
            "confidence": 0.984,
            "frames": [["walk", 10 * k, 10 * k + 5] for k in range(6)],
        },
        {"id": "marker_slip", "target": "C7", "parameters": {}, "confidence": 0.5, "frames": [[3, 9]]},
    ],
    "alternatives": [
        {"id": "external_contact", "target": "tibia_l", "instead_of": "off_plate_step calcn_l"},
        {"id": "marker_swap", "target": "C7+T10", "instead_of": "marker_slip C7"},
    ],
    "gain": {
        "held_out_linear_residual_N": {"before": 478.4, "after": 180.2, "interval": [79.1, 268.4]},
        "held_out_angular_residual_Nm": {"before": 28.22, "after": 40.14},
    },
    "remaining": {
        "linear_residual_N": 180.2,
        "noise_floor_N": 71.6,
        "location": {"body": "torso", "rms_force_N": 42.4},
    },
}
GAINS = [[224.4, 221.6], [20.1, None]]


@dataclass
class Diagnoses:
    """Counts the diagnoses that were made, in place of the solver's."""

    made: list[tuple[str, ...] | None] = field(default_factory=list)
    fails: bool = False

    def diagnose(self, subject, settings, *, trials, reviews):
        """As `solver.diagnosis.diagnose`."""
        self.made.append(trials)
        if self.fails:
            raise FitError(f"{findings.data_folder()}/somebody: no trial has forces.")
        effects = [SimpleNamespace(gain_nats=224.4, held_out_gain_nats=float("nan"))]
        return SimpleNamespace(effects=effects)


@pytest.fixture
def somebody(tmp_path) -> Subject:
    """Two trials, one of which somebody reviewed."""
    trials = tuple(
        TrialFiles(name, tmp_path / f"{name}.trc", reviews=(tmp_path / "r.json",) if name == "walk" else ())
        for name in ("walk", "stairs")
    )
    return Subject(tmp_path, trials)


@pytest.fixture
def diagnoses(monkeypatch) -> Diagnoses:
    """The solver is not asked; what it is asked for depends on the settings' number alone."""
    stand_in = Diagnoses()
    job = SimpleNamespace(subject=None, settings=1, trials=("walk",), reviews={})
    monkeypatch.setattr(findings, "job_for", lambda *_, **__: job)
    monkeypatch.setattr(findings, "_fingerprint", lambda job: f"inputs {job.settings}")
    monkeypatch.setattr(findings, "diagnose", stand_in.diagnose)
    monkeypatch.setattr(findings, "as_json", lambda found: {"verdict": "clean"})
    stand_in.job = job
    return stand_in


@pytest.fixture
def case(tmp_path) -> Case:
    return Case("labs/somebody", tmp_path, ("walk",), without_flags=True)


def test_all_together_each_alone_and_without_what_people_flagged(somebody):
    cases = cases_of("labs/somebody", somebody)
    assert [(c.trials, c.without_flags) for c in cases] == [
        (group, without) for without in (False, True) for group in (None, ("walk",), ("stairs",))
    ]
    assert len({c.key for c in cases}) == 6
    assert all("/" not in c.key for c in cases)


def test_a_single_trial_without_flags_is_one_case(tmp_path):
    alone = Subject(tmp_path, (TrialFiles("walk", tmp_path / "walk.trc"),))
    assert [(c.trials, c.without_flags) for c in cases_of("one", alone)] == [(None, False)]


def test_an_answer_is_made_once_and_anew_for_other_inputs(diagnoses, case, tmp_path):
    first = answer(case, tmp_path, deadline=1e9)
    assert answer(case, tmp_path, deadline=1e9) == first
    assert len(diagnoses.made) == 1
    diagnoses.job.settings = 2
    answer(case, tmp_path, deadline=1e9)
    assert len(diagnoses.made) == 2


def test_what_is_no_number_can_be_kept(diagnoses, case, tmp_path):
    kept = answer(case, tmp_path, deadline=1e9)
    assert kept["gain_nats"] == [[224.4, None]]
    text = (tmp_path / f"{case.key}.json").read_text(encoding="utf-8")
    assert json.loads(text, parse_constant=pytest.fail) == kept


def test_after_the_deadline_only_what_is_kept_is_told(diagnoses, case, tmp_path):
    assert answer(case, tmp_path, deadline=0.0) == {"refused": "not made yet"}
    made = answer(case, tmp_path, deadline=1e9)
    assert answer(case, tmp_path, deadline=0.0) == made


def test_why_there_is_none_is_told_without_the_machines_folders(diagnoses, case, tmp_path):
    diagnoses.fails = True
    assert answer(case, tmp_path, deadline=1e9) == {"refused": "somebody: no trial has forces."}
    assert list(tmp_path.iterdir()) == []


def test_a_row_tells_each_cause_with_its_own_rivals(case):
    cells = [c.strip() for c in row(case, {"figures": FIGURES, "gain_nats": GAINS, "cpu_s": 11.4}).split("|")]
    assert cells[1:4] == ["`labs/somebody`", "walk, stairs, people's flags left out", "explained"]
    step, slip = cells[4].split("<br>")
    assert step.startswith("**off_plate_step calcn_l** force_y_N 519 ± 47; frames ['walk', 0, 5]")
    assert step.endswith("and 2 more; sure 0.98, 224 nats, held-out 222; or external_contact tibia_l")
    assert slip.endswith("frames [3, 9]; sure 0.50, 20 nats, held-out ?; or marker_swap C7+T10")
    assert cells[5:7] == ["478 → 180 (79–268)", "28.2 → 40.1 (40.1–40.1)"]
    assert cells[7:10] == ["180 of 72", "torso, 42 N", "11"]
    assert len(cells) == len(findings.HEAD.splitlines()[0].split("|"))


def test_a_clean_recording_has_dashes(case):
    clean = FIGURES | {"verdict": "clean", "effects": [], "alternatives": [], "gain": {}}
    clean = clean | {"remaining": FIGURES["remaining"] | {"location": None}}
    cells = row(case, {"figures": clean, "gain_nats": [], "cpu_s": 3}).split("|")
    assert [cells[k].strip() for k in (3, 4, 5, 6, 8)] == ["clean", "–", "–", "–", "–"]


def test_what_was_not_diagnosed_stands_below_once(case):
    other = Case("labs/another", Path("another"), None, without_flags=False)
    flagged = Case("labs/another", Path("another"), None, without_flags=True)
    text = table(
        [
            (case, {"figures": FIGURES, "gain_nats": GAINS, "cpu_s": 1}),
            (other, {"refused": "no trial has forces."}),
            (flagged, {"refused": "no trial has forces."}),
            ("labs/third", {"refused": "subject.toml:3: no number"}),
        ]
    )
    rows, below = text.split("Not diagnosed:")
    assert rows.count("`labs/somebody`") == 1
    assert below.strip().splitlines() == [
        "- `labs/another`: no trial has forces.",
        "- `labs/third`: subject.toml:3: no number",
    ]


def test_the_page_keeps_what_people_wrote_about_the_table(monkeypatch, tmp_path, case):
    page = tmp_path / "findings.md"
    before = replaced("before", "findings", "old") + "\nafter\n"
    page.write_text(before, encoding="utf-8")
    kept = {"figures": FIGURES, "gain_nats": GAINS, "cpu_s": 1}
    monkeypatch.setattr(findings, "PAGE", page)
    monkeypatch.setattr(findings, "answers", lambda *_: iter([(case, kept)]))
    monkeypatch.setattr("sys.argv", ["findings", "--keep", str(tmp_path / "kept")])
    findings.main()
    text = page.read_text(encoding="utf-8")
    assert text == before.replace("old", table([(case, kept)]))
    assert "off_plate_step" in text
    monkeypatch.setattr("sys.argv", ["findings", "--only", "somebody", "--keep", str(tmp_path / "kept")])
    page.write_text("untouched", encoding="utf-8")
    findings.main()
    assert page.read_text(encoding="utf-8") == "untouched"
