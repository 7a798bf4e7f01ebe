"""The command `tribowatch`: one file per command; heavy imports happen inside the commands."""

from __future__ import annotations

from monitor.cli.app import app, main
from monitor.cli.check_config import check_config_command
from monitor.cli.identify import identify_command
from monitor.cli.simulate import simulate_command

app.command("simulate")(simulate_command)
app.command("identify")(identify_command)
app.command("check-config")(check_config_command)

__all__ = ["app", "main"]
