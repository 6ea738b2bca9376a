"""Alembic's entry: runs the steps on the connection it is given, or writes them as SQL."""

from alembic import context

connection = context.config.attributes.get("connection")
if connection is None:
    context.configure(url=context.config.get_main_option("sqlalchemy.url"), literal_binds=True)
    with context.begin_transaction():
        context.run_migrations()
else:
    context.configure(connection=connection, render_as_batch=True)
    context.run_migrations()
