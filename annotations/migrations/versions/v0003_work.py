"""Who is to review a trial, and what people say about it: a log of its own, which only grows as well."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"

FORBID_SQLITE = """
CREATE TRIGGER work_no_{verb} BEFORE {verb} ON work
BEGIN SELECT RAISE(ABORT, 'the review log is append-only'); END
"""
FORBID = """
CREATE TRIGGER work_append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON work
FOR EACH STATEMENT EXECUTE FUNCTION edits_append_only()
"""


def upgrade() -> None:
    """Make the table."""
    op.create_table(
        "work",
        sa.Column("number", sa.Integer, primary_key=True),
        sa.Column("subject", sa.String, nullable=False),
        sa.Column("trial", sa.String, nullable=False),
        sa.Column("author", sa.String, nullable=False),
        sa.Column("made_at", sa.String, nullable=False),
        sa.Column("kind", sa.String, nullable=False),
        sa.Column("content", sa.JSON, nullable=False),
        sqlite_autoincrement=True,  # a number is never given twice
    )
    op.create_index("work_of_subject", "work", ["subject", "number"])
    if op.get_bind().dialect.name == "sqlite":
        for verb in ("UPDATE", "DELETE"):
            op.execute(FORBID_SQLITE.format(verb=verb))
    else:
        op.execute(FORBID)
