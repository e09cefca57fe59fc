"""Write the tables of docs/diagnosis.md anew: the causes from the catalogue, the checks from their list."""

from pathlib import Path

from solver.diagnosis.causes.about import About
from solver.diagnosis.causes.catalogue import ABOUT
from solver.diagnosis.decisions import CHECKS

PAGE = Path(__file__).parent.parent / "docs" / "diagnosis.md"
ASKED_OF = {
    "HeldOut": "a cause that is added, exchanged or paired",
    "Added": "a cause that is added",
    "Kept": "a cause, once later ones are there",
    "OnReading": "a cause that reading undid",
    "BesideUnknown": "a named cause beside an unknown force",
    "AllInPlace": "all named causes together",
    "AgainstAnything": "a named cause at the end",
    "Remainder": "an unknown force",
}


def table(*rows: tuple[str, ...]) -> str:
    """The first row is the head."""
    head, *body = ("| " + " | ".join(row) + " |" for row in rows)
    return "\n".join([head, "|" + "---|" * len(rows[0]), *body]) + "\n"


def entry(one: About) -> tuple[str, ...]:
    """What a cause is."""
    return f"`{one.id}`", one.entry.target, one.entry.happened, one.entry.parameters


def beside(one: About) -> tuple[str, ...]:
    """What stands beside a cause."""
    sizes = "; ".join(f"`{s.parameter}` {s.usual:g} / {s.rare:g} / {s.most:g}: {s.why}" for s in one.sizes)
    picture = "label" if one.picture is None else type(one.picture).__name__.lower()
    told = (
        one.branch,
        one.at_fault.value,
        one.time_history.value,
        f"{one.odds_against:g}",
        one.corrected_by.value,
    )
    return f"`{one.id}`", *told, picture, sizes


def tables() -> dict[str, str]:
    """By the name between the marks of the page."""
    asked = [(c.name, c.question, "; ".join(ASKED_OF[kind.__name__] for kind in c.asked_of)) for c in CHECKS]
    heads = ("id", "branch", "at fault", "over time", "odds", "corrected by", "picture", "sizes")
    return {
        "catalogue": table(("id", "target", "what happened", "parameters"), *map(entry, ABOUT.values())),
        "causes": table(heads, *map(beside, ABOUT.values())),
        "checks": table(("check", "question", "asked of"), *asked),
    }


def renewed(page: str) -> str:
    """The page with its tables as they should be."""
    for name, text in tables().items():
        start, end = f"<!-- {name}: made by scripts/{Path(__file__).name} -->\n", f"<!-- end of {name} -->"
        before, rest = page.split(start)
        page = before + start + text + end + rest.split(end, 1)[1]
    return page


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
