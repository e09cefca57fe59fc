"""The documentation keeps up with the code: keys, settings, pages, links."""

import re
from dataclasses import fields, is_dataclass
from itertools import pairwise
from pathlib import Path

import pytest

from addb_viewer.app.shell.commands import COMMANDS
from solver.fitting.settings import Settings, as_toml, tables

PROJECT = Path(__file__).resolve().parent.parent
DOCS = PROJECT / "docs"
TOP = [PROJECT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")]
PAGES = {page.relative_to(PROJECT).as_posix(): page for page in (*TOP, *DOCS.glob("*.md"))}
TABLES = dict(tables(Settings()))


def text_of(name):
    return PAGES[name].read_text(encoding="utf-8")


def section(name, heading):
    """What stands below a heading of a page, up to the next one of its kind."""
    return text_of(name).split(f"\n## {heading}\n")[1].split("\n## ")[0]


def anchors(name):
    """The headings of a page as links name them."""
    without_code = re.sub(r"^```.*?^```", "", text_of(name), flags=re.M | re.S)
    headings = re.findall(r"^#+ (.*)", without_code, re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def links():
    """Every link inside the project: the page that has it, and its target."""
    for name in PAGES:
        for target in re.findall(r"\]\(([^)\s]+)\)", text_of(name)):
            if not re.match(r"[a-z]+:", target):
                yield name, target


def test_the_keys_of_the_app_are_those_on_its_page():
    rows = [line.strip("|").split("|") for line in section("docs/app.md", "Keys").splitlines() if "|" in line]
    told = [tuple(cell.strip() for cell in row) for row in rows[2:]]
    assert told == [(command.shown, command.label, f"`{command.action}`") for command in COMMANDS]


def test_the_keys_in_the_readme_do_what_it_says():
    rows = [
        line.strip("|").split("|") for line in section("README.md", "Reviewing").splitlines() if "|" in line
    ]
    told = [tuple(cell.strip() for cell in row) for row in rows[2:]]
    assert len(told) >= 10
    assert set(told) <= {(command.shown, command.label) for command in COMMANDS}


@pytest.mark.parametrize("stage", TABLES)
def test_every_table_of_settings_is_named_on_a_page(stage):
    assert any(f"`[{stage}]`" in text_of(name) for name in PAGES)


@pytest.mark.parametrize("stage", TABLES)
def test_every_setting_is_printed_with_its_unit_and_reason(stage):
    table = as_toml(Settings()).split(f"[{stage}]\n")[1].split("\n[")[0]
    lines = table.strip().splitlines()
    printed = {}
    for comment, line in pairwise(lines):
        name = line.split(" = ")[0]
        if not line.startswith("#") and comment.startswith("# "):
            printed[name] = comment
    for setting in fields(TABLES[stage]):
        if is_dataclass(getattr(TABLES[stage], setting.name)):
            continue  # a table of its own
        reason, unit = setting.metadata["why"], setting.metadata["unit"]
        assert len(reason.split()) >= 3, f"[{stage}] {setting.name}: '{reason}' is no reason"
        assert reason in printed[setting.name]
        assert not unit or f"[{unit}]" in printed[setting.name]


def test_the_map_leads_to_every_page():
    mapped = {target.split("#")[0] for name, target in links() if name == "docs/index.md"}
    assert {page.name for page in DOCS.glob("*.md")} - {"index.md"} <= mapped


def test_the_site_has_every_page():
    navigation = (PROJECT / "mkdocs.yml").read_text(encoding="utf-8").split("\nnav:\n")[1]
    named = re.findall(r": ([\w-]+\.md)$", navigation, re.M)
    pages = {page.name for page in DOCS.glob("*.md")}
    assert set(named) == pages | {"map.md"}, "nav in mkdocs.yml has to name each page of docs/"
    assert len(named) == len(set(named))


def test_the_map_shows_every_room():
    drawing = text_of("docs/index.md").split("```")[1]
    rooms = {init.parent.name for init in (PROJECT / "solver").glob("*/__init__.py")}
    for room in (*rooms, "annotations", "addb_viewer"):
        assert re.search(rf"\b{room}\b", drawing), room


@pytest.mark.parametrize(("page", "target"), sorted(set(links())))
def test_links_lead_somewhere(page, target):
    path, _, anchor = target.partition("#")
    file = (PAGES[page].parent / path).resolve() if path else PAGES[page]
    assert file.exists(), f"{page} links to {target}"
    if anchor:
        assert anchor in anchors(file.relative_to(PROJECT).as_posix()), f"{page} links to {target}"


def test_places_that_contributors_are_sent_to_are_there():
    named = re.findall(
        r"`((?:solver|addb_viewer|tests|docs|benchmarks)/[\w/.*-]+)`", text_of("CONTRIBUTING.md")
    )
    assert len(named) > 12
    assert [place for place in named if not any(PROJECT.glob(place.rstrip("/")))] == []
