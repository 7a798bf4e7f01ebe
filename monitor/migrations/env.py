"""Alembic's entry: migrates the connection it is handed by `monitor.schema`."""

from __future__ import annotations

from alembic import context

from monitor.models_life import RollUpRow

context.configure(
    connection=context.config.attributes["connection"], target_metadata=RollUpRow.metadata, render_as_batch=True
)
with context.begin_transaction():
    context.run_migrations()
