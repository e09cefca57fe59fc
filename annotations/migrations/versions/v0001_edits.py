"""The log of edits; SQLite refuses to change or remove one."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None

FORBID = """
CREATE TRIGGER edits_no_{verb} BEFORE {verb} ON edits
BEGIN SELECT RAISE(ABORT, 'the review log is append-only'); END
"""
OUR_FIRST = "schema_version"  # table of databases that were made before Alembic kept the version


def upgrade() -> None:
    """Make the table, unless a program without Alembic made this very one; such programs are turned away."""
    connection = op.get_bind()
    if sa.inspect(connection).has_table(OUR_FIRST):
        op.execute(f"UPDATE {OUR_FIRST} SET version = 2")
        return
    op.create_table(
        "edits",
        sa.Column("number", sa.Integer, primary_key=True),
        sa.Column("subject", sa.String, nullable=False),
        sa.Column("trial", sa.String, nullable=False),
        sa.Column("author", sa.String, nullable=False),
        sa.Column("made_at", sa.String, nullable=False),
        sa.Column("kind", sa.String, nullable=False),
        sa.Column("content", sa.JSON, nullable=False),
        sqlite_autoincrement=True,  # a number is never given twice
    )
    op.create_index("edits_of_trial", "edits", ["subject", "trial"])
    if connection.dialect.name == "sqlite":
        for verb in ("UPDATE", "DELETE"):
            op.execute(FORBID.format(verb=verb))
