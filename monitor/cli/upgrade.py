"""`tribowatch upgrade`: bring the history to this program's schema, with a back-up first."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Annotated, Any

import typer

from monitor.cli.options import AsJson, ConfigFile, StateDir, history_url


def upgrade_command(
    check: Annotated[bool, typer.Option("--check", help="Only say what would be done.")] = False,
    backup: Annotated[bool, typer.Option("--backup/--no-backup", help="Copy the history first.")] = True,
    config: ConfigFile = None,
    state_dir: StateDir = None,
    as_json: AsJson = False,
) -> None:
    """Upgrade the history database to this version of tribowatch; a back-up is made beside it first."""
    from monitor.schema import Schema, schema_of

    url, folder = history_url(config, state_dir)
    schema = schema_of(url)
    told: dict[str, Any] = {"from": schema.current, "to": schema.head, "steps": list(schema.pending), "backup": None}
    if schema.pending and not check:
        from monitor.service import own

        with own(folder):
            if backup:
                from monitor.store_backup import back_up

                stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")
                target = folder / f"tribowatch-schema-{schema.current}-{stamp}.backup"
                back_up(url, target)
                told["backup"] = str(target)
            from monitor.database import make_engine
            from monitor.schema import migrate

            engine = make_engine(url)
            try:
                migrate(engine, url)
            finally:
                engine.dispose()
        schema = Schema(schema.head, schema.head, ())
    told["current"] = schema.current
    if as_json:
        from monitor.cli.output import emit_json

        emit_json(told)
    else:
        typer.echo(_words(told, check))


def _words(told: dict[str, Any], check: bool) -> str:
    if not told["steps"]:
        return f"schema {told['current']}: up to date"
    steps = "; ".join(told["steps"])
    if check:
        return f"schema {told['from']} would become {told['to']}: {steps}"
    kept = f"; back-up in {told['backup']}" if told["backup"] else ""
    return f"schema {told['from']} became {told['to']}: {steps}{kept}"
