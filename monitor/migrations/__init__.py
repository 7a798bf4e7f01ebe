"""Alembic migrations of the history database; applied by the daemon at start."""
