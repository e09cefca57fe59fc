"""Commands on a .b3d file: decisions go beside it, and the file stays as it is."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from addb_viewer.commands.cli import app
from addb_viewer.jobs.root_folder import OutsideError, open_root
from annotations.log import ReviewLog

pytestmark = pytest.mark.real


@pytest.fixture
def recording(real_data, tmp_path):
    source = real_data / "b3d" / "results.b3d"
    if not source.is_file():
        pytest.skip(f"{source} is not there")
    copy = tmp_path / "person.b3d"
    copy.write_bytes(source.read_bytes())
    return copy


def run(*arguments):
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    return result.exit_code, result.output


def test_a_flag_goes_beside_the_file_and_into_the_next_fit(recording):
    before = recording.read_bytes()
    assert run("flag", recording, "walking1", "40:60", "--author", "ada")[0] == 0
    code, said = run("fit", recording)
    assert code == 0
    assert "frames chosen by the review" in said
    assert "figures stored in the file" in said
    assert recording.read_bytes() == before
    decisions, results = (recording.with_name(recording.name + end) for end in (".subject", ".results"))
    assert [path.name for path in decisions.iterdir() if path.suffix == ".sqlite"] == ["annotations.sqlite"]
    assert (results / "fit.json").is_file()
    with ReviewLog.open(decisions / "annotations.sqlite") as log:
        assert log.trials() == ("walking1",)
    again = run("fit", recording, "--notes")[1]
    assert "unchanged: kept fit" in again
    assert "its file says of its kinematics pass" in again


def test_a_subject_toml_for_it_holds_what_may_be_corrected(recording):
    code, _ = run("init", recording)
    assert code == 0
    text = Path(f"{recording}.subject", "subject.toml").read_text()
    assert "mass_kg = 68.0" in text
    assert 'model_is = "scaled"' in text
    assert "[trials" not in text
    assert "there already" in run("init", recording)[1]


def test_a_file_that_is_not_there_is_named_as_it_was_given(tmp_path):
    code, said = run("flags", tmp_path / "nobody.b3d")
    assert code != 0
    assert "nobody.b3d: no such folder" in said.replace("\n", "")


def test_the_app_opens_the_file_and_nothing_beside_it(recording, tmp_path):
    root = open_root(recording)
    assert root.names == (".",)
    assert root.subject(".").name == "person"
    folder = open_root(tmp_path)
    assert folder.names == ("person.b3d.subject",)
    assert folder.subject("person.b3d.subject").recording == recording.resolve()


def test_a_link_to_a_file_elsewhere_is_not_opened(recording, tmp_path):
    inside = tmp_path / "cohort"
    inside.mkdir()
    (inside / "linked.b3d").symlink_to(recording)
    with pytest.raises(OutsideError, match="leads out of"):
        open_root(inside)
