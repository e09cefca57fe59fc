"""Sections of a page: each is written by one program, which leaves the rest of the page as it is."""

from pathlib import Path

from solver.capture.atomic import write_whole


def replaced(page: str, name: str, section: str) -> str:
    """The page with this section in place of the one before; at its end if there was none.

    Args:
        page: as Markdown.
        name: of the program in `benchmarks` whose section it is, by which its markers are known.
        section: as Markdown, without markers.

    Raises:
        ValueError: the section before has a beginning and no end.
    """
    begin, end = f"<!-- made by python -m benchmarks.{name} -->", f"<!-- end of benchmarks.{name} -->"
    whole = f"{begin}\n\n{section.strip()}\n\n{end}"
    before, found, rest = page.partition(begin)
    if not found:
        return f"{page.rstrip()}\n\n{whole}\n" if page.strip() else f"{whole}\n"
    _, ended, after = rest.partition(end)
    if not ended:
        raise ValueError(f"The page has '{begin}' without '{end}' after it. Write that line back.")
    return f"{before}{whole}{after}"


def write_section(page: Path, name: str, section: str) -> None:
    """Put a section into a page, which is made if it isn't there.

    Args:
        page: a file of Markdown.
        name: as of `replaced`.
        section: as of `replaced`.
    """
    text = page.read_text(encoding="utf-8") if page.exists() else ""
    write_whole(page, replaced(text, name, section))
