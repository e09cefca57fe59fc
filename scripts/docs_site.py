"""What the site has beside docs/: README, CHANGELOG, CONTRIBUTING, benchmarks, settings, the API reference.

A hook of MkDocs (mkdocs.yml). Links are written as the repository needs them: one to a page of the site leads
there, one to another file leads to the repository.
"""

import ast
import logging
import posixpath
import re
import tomllib
from dataclasses import fields, is_dataclass
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

from solver.fitting.settings import Settings, tables

PROJECT = Path(__file__).resolve().parent.parent
SETTINGS = "reference/settings.md"
REFERENCE = {
    "addb_viewer": "__init__.py",
    "addb_viewer/api": "*.py",
    "addb_viewer/recordings": "*.py",
    "addb_viewer/report": "*.py",
    "annotations": "*.py",
    "solver": "*.py",
    "solver/*": "**/*.py",
}
"""Packages that have a page in the API reference, and which of their files it describes."""

MOVED = {
    "README.md": "index.md",  # the site opens with the README
    "docs/index.md": "map.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
}
CODE = r"^ *```.*?^ *```"
LINK = r"\[(?P<text>(?:[^\]`]|`[^`]*`)*)\]\((?P<target>[^)\s]+)\)"
QUOTED = r"`[^`\n]+`"
RANGES = r"\](?P<space> ?)\["
"""Between two ranges of frames, which is no link by reference: no page has such links."""
logging.getLogger("mkdocs.plugins.mkdocs_autorefs").setLevel(logging.ERROR)
"""A shape before a unit in a docstring, [frames, 3] [m], is no link by reference either."""

TOKENS = re.compile(f"{CODE}|{LINK}|{QUOTED}|{RANGES}", re.M | re.S)


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Complete the navigation, and show the version that pyproject.toml states."""
    project = tomllib.loads((PROJECT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    config.copyright = f"{project['name']} {project['version']}, {project['license']}"
    config.nav += [
        {"Benchmarks": [{_title(source): _place(source)} for source in _benchmarks()]},
        {"API reference": [{_dotted(package): _reference_page(package)} for package in _packages()]},
        {"Project": [{"Changes": "changelog.md"}, {"Contributing": "contributing.md"}]},
    ]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that do not lie in docs/, or stand elsewhere on the site than there."""
    files.remove(files.src_uris["index.md"])
    for source in (*MOVED, *_benchmarks()):
        text = (PROJECT / source).read_text(encoding="utf-8")
        files.append(File.generated(config, _place(source), content=text))
    files.append(File.generated(config, SETTINGS, content=_settings()))
    for package, pattern in _packages().items():
        files.append(File.generated(config, _reference_page(package), content=_reference(package, pattern)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Turn links between files of the repository into links between pages of the site."""
    here = page.file.src_uri
    if here == MOVED["README.md"]:
        page.meta["hide"] = ["navigation"]  # it is the only page of its tab
    source = next((source for source in (*MOVED, *_benchmarks()) if _place(source) == here), f"docs/{here}")

    def moved(token: re.Match[str]) -> str:
        if token["space"] is not None:
            return f"]{token['space']}\\["
        text, (path, hash_sign, anchor) = token["text"], (token["target"] or "").partition("#")
        if not path or re.match(r"[a-z]+:", path):
            return token[0]
        target = posixpath.normpath(posixpath.join(posixpath.dirname(source), path))
        if not (PROJECT / target).exists():
            raise PluginError(f"{source}: the link to {path} leads nowhere")
        place = _place(target)
        if files.get_file_from_path(place) is None:
            return f"[{text}]({config.repo_url}/blob/main/{target})"
        shown = _title(target) if text.endswith(".md") else text
        return f"[{shown}]({posixpath.relpath(place, posixpath.dirname(here) or '.')}{hash_sign}{anchor})"

    return TOKENS.sub(moved, markdown)


def _benchmarks() -> list[str]:
    """Their pages, the results that the README is about first."""
    pages = sorted(
        (PROJECT / "benchmarks").glob("*.md"), key=lambda page: (page.stem != "RESULTS", page.stem)
    )
    return [page.relative_to(PROJECT).as_posix() for page in pages]


def _place(source: str) -> str:
    """Where on the site a file of the repository stands, if it is part of it."""
    return MOVED.get(source, source.removeprefix("docs/").lower())


def _title(source: str) -> str:
    """The heading of a page up to its colon, for links that say a file's name in the repository."""
    return (PROJECT / source).read_text(encoding="utf-8").partition("\n")[0].strip("# ").partition(":")[0]


def _settings() -> str:
    """A table of settings for each stage, as `addb-viewer settings` prints them."""
    parts = [
        "# Settings",
        "`addb-viewer settings` prints these. Copy the lines that you change into `SUBJECT/settings.toml`.",
    ]
    for name, stage in tables(Settings()):
        rows = [
            f"| `{own.name}` | {getattr(stage, own.name)} | {own.metadata['unit']} | {own.metadata['why']} |"
            for own in fields(stage)
            if not is_dataclass(getattr(stage, own.name))
        ]
        parts += [f"## [{name}]", "\n".join(["| setting | value | unit | why |", "|---|---|---|---|", *rows])]
    return "\n\n".join(parts)


def _packages() -> dict[str, str]:
    """Packages of the API reference by their folder, and which files it describes."""
    return {
        path.parent.relative_to(PROJECT).as_posix(): pattern
        for packages, pattern in REFERENCE.items()
        for path in sorted(PROJECT.glob(f"{packages}/__init__.py"))
    }


def _dotted(path: str) -> str:
    return path.replace("/", ".")


def _reference_page(package: str) -> str:
    return f"api/{_dotted(package)}.md"


def _reference(package: str, pattern: str) -> str:
    """The page of a package: what it is for, then each of its modules."""
    heading = f"# {_dotted(package)}"
    if pattern == "__init__.py":
        return f"{heading}\n\n::: {_dotted(package)}"
    init = (PROJECT / package / "__init__.py").read_text(encoding="utf-8")
    paths = [path for path in sorted((PROJECT / package).glob(pattern)) if path.stem != "__init__"]
    modules = [_dotted(path.relative_to(PROJECT).with_suffix("").as_posix()) for path in paths]
    about = ast.get_docstring(ast.parse(init)) or ""
    return "\n\n".join([heading, about, *(f"::: {module}" for module in modules)])
