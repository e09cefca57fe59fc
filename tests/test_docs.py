"""The documentation keeps up with the code: generated parts, settings, pages, links."""

import importlib.util
import re
from pathlib import Path

import pytest

from addb_viewer.app.shell.commands import COMMANDS
from annotations.event_codec import KINDS
from annotations.events import Status
from solver.fitting.settings import Settings, tables

PROJECT = Path(__file__).resolve().parent.parent
DOCS = PROJECT / "docs"
TOP = [PROJECT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")]
PAGES = {page.relative_to(PROJECT).as_posix(): page for page in (*TOP, *DOCS.glob("**/*.md"))}
TABLES = dict(tables(Settings()))
SENT_TO = ("CONTRIBUTING.md", "docs/how-to/extend.md")  # pages that send contributors to files


def made():
    """The program that writes what the code says into the pages."""
    spec = importlib.util.spec_from_file_location("reference_tables", PROJECT / "scripts/reference_tables.py")
    program = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(program)
    return program


MADE = made()


def text_of(name):
    return PAGES[name].read_text(encoding="utf-8")


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


@pytest.mark.parametrize("page", MADE.PAGES)
def test_the_pages_say_what_the_code_says(page):
    now = text_of(f"docs/{page}")
    up_to_date = MADE.renewed(now, MADE.PAGES[page]()) == now
    assert up_to_date, f"docs/{page} lags behind the code: run `python scripts/reference_tables.py`"


def test_every_command_has_its_heading():
    headed = re.findall(r"^## ([a-z ]+)\n\n<!-- ", text_of("docs/reference/command-line.md"), re.M)
    assert set(headed) == set(MADE.command_line()) - {"commands", "shared options"}


def test_keys_in_the_how_to_page_are_those_of_the_app():
    named = set(
        re.findall(r"\*\*?([A-Z]|Shift [A-Z]\w*|Enter|Backspace|Space)\*", text_of("docs/how-to/review.md"))
    )
    assert len(named) > 10
    assert named <= {key for command in COMMANDS for key in command.shown.split(" or ")}


def test_the_kinds_of_edits_and_the_statuses_of_a_review():
    page = text_of("docs/reference/annotations.md")
    rows = page.split("\n## A log of edits\n")[1].split("\n## ")[0]
    kinds = [name for row in re.findall(r"^\| (`.*?) \|", rows, re.M) for name in re.findall(r"`(.*?)`", row)]
    assert sorted(kinds) == sorted(KINDS)
    assert page.split("\n## Status\n\n")[1].startswith(", ".join(f"`{status}`" for status in Status))


def test_settings_that_pages_name_are_there():
    named = {
        name
        for page in DOCS.glob("**/*.md")
        for name in re.findall(r"`\[([a-z_.]+)\]`", page.read_text("utf-8"))
    }
    assert named - {"release"} <= set(TABLES)  # a table of subject.toml


def test_the_map_leads_to_every_page():
    mapped = {target.split("#")[0] for name, target in links() if name == "docs/index.md"}
    assert {page.relative_to(DOCS).as_posix() for page in DOCS.glob("**/*.md")} - {"index.md"} <= mapped


def test_the_site_has_every_page():
    navigation = (PROJECT / "mkdocs.yml").read_text(encoding="utf-8").split("\nnav:\n")[1]
    named = re.findall(r": ([\w/-]+\.md)$", navigation, re.M)
    pages = {page.relative_to(DOCS).as_posix() for page in DOCS.glob("**/*.md")}
    made_for_it = {"map.md", "reference/settings.md"}
    assert set(named) == pages | made_for_it, "nav in mkdocs.yml has to name each page of docs/"
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


@pytest.mark.parametrize("page", SENT_TO)
def test_places_that_contributors_are_sent_to_are_there(page):
    named = re.findall(r"`((?:solver|addb_viewer|tests|docs|benchmarks|scripts)/[\w/.*-]+)`", text_of(page))
    placeholders = re.compile(r"\b(ID|FORMAT|TERM)\b|test_ID")
    missing = [p for p in named if not placeholders.search(p) and not any(PROJECT.glob(p.rstrip("/")))]
    assert named
    assert missing == []


def test_pages_that_code_names_are_there():
    code = [
        f
        for room in ("solver", "addb_viewer", "annotations", "benchmarks")
        for f in (PROJECT / room).rglob("*.py")
    ]
    named = {place for f in code for place in re.findall(r"docs/[\w/-]+\.md", f.read_text(encoding="utf-8"))}
    assert named
    assert [place for place in named if not (PROJECT / place).exists()] == []


def test_the_readme_fits_on_a_screen_and_a_half():
    assert len(text_of("README.md").splitlines()) <= 120
