"""Alembic comes in here: the steps run inside the transaction of the connection that it was given."""

from alembic import context

from annotations.schema import VERSION_TABLE

context.configure(
    connection=context.config.attributes["connection"],
    version_table=VERSION_TABLE,
    transactional_ddl=True,
)
with context.begin_transaction():
    context.run_migrations()
