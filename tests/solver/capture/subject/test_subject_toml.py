import pytest

from solver.capture.capture import PlanItem, ReleaseWords, Subject, TrialFiles
from solver.capture.subject.subject_toml import described_as_toml, read_subject_toml
from solver.common.errors import CaptureError

WHOLE = """
mass_kg = 70

[release]
source = "Carter 2023"
person = "P01"
licence = "CC-BY-4.0"
consent = "public"
citation = "cite.bib"
doi = "https://doi.org/10.1234/abc.5"
url = "https://example.org/data"
"""


def told(folder, text):
    path = folder / "subject.toml"
    path.write_text(text, encoding="utf-8")
    return read_subject_toml(path)


def test_the_table_is_read_and_a_bibtex_file_with_it(tmp_path):
    (tmp_path / "cite.bib").write_text("@article{carter,\n title = {Ü}}\n", encoding="utf-8")
    release = told(tmp_path, WHOLE).release
    assert release == ReleaseWords(
        source="Carter 2023",
        person="P01",
        licence="CC-BY-4.0",
        consent="public",
        citation="@article{carter,\n title = {Ü}}",
        doi="10.1234/abc.5",
        url="https://example.org/data",
    )


@pytest.mark.parametrize(
    ("text", "counted_kg", "factor"),
    [
        ("mass_kg = 70", 70.0, None),
        ("mass_kg = 70\nscale_kg = 73.5", 73.5, 1.05),
        ("scale_kg = 73.5", 73.5, 1.0),
    ],
)
def test_a_scale_s_word_counts_and_what_was_entered_stays_known(tmp_path, text, counted_kg, factor):
    found = told(tmp_path, text)
    assert (found.counted_kg, found.scale_factor) == (counted_kg, factor and pytest.approx(factor))
    subject = Subject(tmp_path, (), mass_kg=found.counted_kg, scale_factor=found.scale_factor)
    again = told(tmp_path, "\n".join(described_as_toml(subject).splitlines()[:6]))
    assert (again.counted_kg, again.scale_factor) == (counted_kg, factor and pytest.approx(factor))


def test_without_the_table_nothing_is_said(tmp_path):
    assert told(tmp_path, "mass_kg = 70").release is None


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('consent = "yes"', r"release\.consent = \"yes\": choose one of public, restricted, unknown"),
        ('source = "a/b"', r"release\.source = .*becomes a part of names"),
        ('person = ".."', r"release\.person = .*another sign than a dot"),
        ("licence = 4", r"release\.licence = 4: a text in quotes"),
        ('doi = "carter"', r"release\.doi = .*no DOI"),
        ('url = "example.org"', r"release\.url = .*https"),
        ('citation = "none.bib"', r"release\.citation = .*there is no such file"),
        ('citation = "../../a.bib"', r"release\.citation = .*leads out"),
    ],
)
def test_what_is_wrong_is_named_with_what_to_do(tmp_path, line, said):
    with pytest.raises(CaptureError, match=rf"subject\.toml: {said}"):
        told(tmp_path, f"[release]\n{line}\n")


def test_no_table_and_unknown_keys(tmp_path):
    with pytest.raises(CaptureError, match="a table of its own"):
        told(tmp_path, 'release = "CC0"')
    assert told(tmp_path, '[release]\nlicense = "CC0"\n').notes == (
        "subject.toml: unknown keys are ignored: release.license (licence?)",
    )


def test_what_is_written_reads_as_what_was_understood(tmp_path):
    (tmp_path / "walk.trc").touch()
    subject = Subject(tmp_path, (TrialFiles("walk", tmp_path / "walk.trc"),))
    assert told(tmp_path, described_as_toml(subject)).release is None
    words = ReleaseWords(source="Carter", consent="public", citation="@a{b,\n c}")
    written = described_as_toml(Subject(tmp_path, subject.trials, release=words))
    assert told(tmp_path, written).release == words


def test_a_plan_is_read_and_written_again(tmp_path):
    plan = told(tmp_path, "[plan]\nright_steps = 5\nruns = 2\n").plan
    assert plan == (PlanItem("right_steps", 5), PlanItem("runs", 2))
    written = described_as_toml(Subject(tmp_path, (TrialFiles("a", tmp_path / "a.trc"),), plan=plan))
    assert "[plan]\nright_steps = 5\nruns = 2\n" in written


@pytest.mark.parametrize(
    ("plan", "said"),
    [
        ("[plan]\njumps = 2", r"plan\.jumps = 2: nothing of that name can be counted; choose one of trials"),
        ("[plan]\nruns = 0", r"plan\.runs = 0: a whole number from 1"),
        ("[plan]\nruns = true", r"plan\.runs = true: a whole number"),
        ("[plan]\nruns = 1.5", r"plan\.runs = 1\.5: a whole number"),
        ("plan = 5", r"plan = 5: it is a table of its own"),
    ],
)
def test_what_nobody_can_count_is_refused(tmp_path, plan, said):
    with pytest.raises(CaptureError, match=rf"subject\.toml: {said}"):
        told(tmp_path, plan)
