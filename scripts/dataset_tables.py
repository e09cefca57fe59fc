"""Write the tables of docs/dataset.md anew from addb_viewer/dataset/schema.py."""

import re
from pathlib import Path

from addb_viewer.dataset.columns import Table
from addb_viewer.dataset.schema import TABLES

PAGE = Path(__file__).parent.parent / "docs" / "dataset.md"


def shown(table: Table) -> str:
    """A table's part of the page."""
    path = table.path.format(subject="SUBJECT", name="NAME")
    about = f"{table.description}. `{path}`; key: {', '.join(table.key)}."
    return f"### {table.name}\n\n{about}\n\n{table.as_markdown()}\n"


def main() -> None:
    """Put every table in the place of the one before."""
    before, rest = PAGE.read_text(encoding="utf-8").split("\n## Tables\n")
    introduction, tables = rest.split("\n### ", 1)
    after = re.search(r"\n## ", tables)
    behind = tables[after.start() :] if after else ""
    parts = "\n".join(shown(table) for table in TABLES)
    PAGE.write_text(f"{before}\n## Tables\n{introduction}\n{parts}{behind}", encoding="utf-8")


if __name__ == "__main__":
    main()
