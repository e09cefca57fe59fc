"""How a database of an older version becomes one of this: one step a file, run by Alembic."""
