"""The whole page of one subject."""

import re
from dataclasses import replace
from html.parser import HTMLParser
from importlib.resources import files

import pytest

from addb_viewer.report.content import SubjectReport
from addb_viewer.report.subject_page import PARTS, player_html, subject_page, write_report
from addb_viewer.trial_view.recorded_subject import recording_of
from solver.common.notes import Kind, noted
from solver.kinematics.angle_conventions import angles_by_convention

VOID = {"meta", "input", "br"}
HOSTILE = "</script><img src=x onerror=alert(1)>"


class Balanced(HTMLParser):
    """Refuses a page whose elements do not close in order; gathers names and links."""

    def __init__(self):
        super().__init__()
        self.open, self.names, self.ids, self.links = [], set(), set(), []

    def handle_starttag(self, tag, attributes):
        self.names.add(tag)
        found = dict(attributes)
        self.ids.add(found.get("id"))
        self.links += [found[name] for name in ("href", "src") if name in found]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.names.add(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def read(page):
    parser = Balanced()
    parser.feed(page)
    assert parser.open == []
    return parser


def test_every_part_is_there_once_and_every_link_stays_in_the_page(report):
    page = subject_page(report)
    found = read(page)
    for name, words in PARTS:
        there = int(name != "joints")  # nobody takes a stride
        assert page.count(f'id="{name}"') == page.count(f"<h2>{words}</h2>") == there
    assert {link[1:] for link in found.links if link.startswith("#")} <= found.ids
    assert all(link.startswith(("#", "data:image/webp;base64,")) for link in found.links)
    assert page.count('class="still"') == 3


def test_least_and_greatest_angles_of_each_convention(report, skeleton):
    page = subject_page(report)
    angles = page[page.index('id="angles"') :]
    row = re.search(r"pelvis: tilt</th>(.*?)</tr>", angles).group(1)
    cells = re.findall(r"<td>(.*?)</td>", row)
    assert cells[:2] == ["–", "–"]  # this model's coordinates have names of their own
    q = report.recording.fit.trials[0].dynamics.motion.q
    for convention, shown in (("cgm", cells[2:4]), ("isb", cells[4:])):
        tilt = angles_by_convention(skeleton, q, convention)["pelvis_tilt_r"]
        expected = f"{round(tilt.min())} to {round(tilt.max())}".replace("-", "−")
        assert shown == [expected, expected]
    assert "knee: flexion" not in angles  # nor has it such bodies


def test_names_from_files_are_text(make_fit, diagnosis):
    fit = make_fit("walk")
    trial = fit.trials[0]
    names = (HOSTILE, *trial.capture.markers.names[1:])
    capture = replace(
        trial.capture,
        markers=replace(trial.capture.markers, names=names),
        plates=tuple(replace(plate, name=HOSTILE) for plate in trial.capture.plates),
        notes=noted(Kind.OTHER, HOSTILE),
    )
    fit = replace(fit, trials=(replace(trial, capture=capture),), notes=noted(Kind.OTHER, HOSTILE))
    page = subject_page(SubjectReport(recording_of(fit, diagnosis=diagnosis)))
    assert "<img" not in page
    assert "img" not in read(page).names
    assert "\\u003cimg" in page


def test_subjects_without_forces_or_with_several_trials(small_fit):
    page = subject_page(SubjectReport(recording_of(small_fit)))
    read(page)
    assert "no/forces" in page
    assert "3 of 8 frames are usable" in page


def test_it_is_written_whole_or_not_at_all(report, tmp_path):
    file = write_report(report, tmp_path / "report.html")
    assert file.read_text(encoding="utf-8").endswith("</html>\n")
    with pytest.raises(Exception, match=re.escape(str(tmp_path / "no" / "report.html"))):
        write_report(report, tmp_path / "no" / "report.html")


def test_a_long_recording_stays_small():
    from benchmarks.speed.stages import synthetic_fit

    page = subject_page(SubjectReport(recording_of(synthetic_fit())))
    assert len(page.encode()) < 5e6


def test_everything_that_the_script_looks_for_is_there():
    script = files("addb_viewer.report").joinpath("player.js").read_text(encoding="utf-8")
    page = player_html(["walk"], 7)
    wanted = set(re.findall(r'find\("(\w+)"\)', script))
    assert wanted == set(re.findall(r'data-role="(\w+)"', page))
    assert 'data-frame="7"' in page


def test_trials_can_be_chosen_where_there_are_several():
    assert "hidden" in player_html(["walk"], 0)
    page = player_html(["walk", "<run>"], 0)
    assert "hidden" not in page.replace('aria-hidden="true"', "")
    assert '<option value="1">&lt;run&gt;</option>' in page
