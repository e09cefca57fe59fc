"""For many hands: the last edit of a subject is found at once, and PostgreSQL's log only grows as well."""

from alembic import op

revision = "0002"
down_revision = "0001"

REFUSE = """
CREATE FUNCTION edits_append_only() RETURNS trigger LANGUAGE plpgsql AS
$$ BEGIN RAISE EXCEPTION 'the review log is append-only'; END $$
"""
FORBID = """
CREATE TRIGGER edits_append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON edits
FOR EACH STATEMENT EXECUTE FUNCTION edits_append_only()
"""


def upgrade() -> None:
    """Add the index, and the trigger where SQLite's is not there."""
    op.create_index("edits_of_subject", "edits", ["subject", "number"])
    if op.get_bind().dialect.name == "postgresql":
        op.execute(REFUSE)
        op.execute(FORBID)
