"""The command `tribowatch`: one file per command; heavy imports happen inside the commands."""

from __future__ import annotations

from monitor.cli import axes_life
from monitor.cli.alerts import alerts_app, alerts_list_command
from monitor.cli.alerts_act import ACTIONS, make_command, shelve_command
from monitor.cli.alerts_evidence import evidence_command, replay_evidence_command
from monitor.cli.alerts_kpi import kpi_command
from monitor.cli.app import app, main
from monitor.cli.axes import axes_app
from monitor.cli.axes_check import axes_check_command
from monitor.cli.axes_init import axes_init_command
from monitor.cli.axes_report import axes_report_command
from monitor.cli.bridge import bridge_command
from monitor.cli.check_config import check_config_command
from monitor.cli.demo import demo_command
from monitor.cli.diagnose import diagnose_command
from monitor.cli.doctor import doctor_command
from monitor.cli.history import history_app, history_show_command
from monitor.cli.history_keep import backup_command, restore_command
from monitor.cli.history_reanalyse import reanalyse_command
from monitor.cli.identify import identify_command
from monitor.cli.record import record_command
from monitor.cli.replay import replay_command
from monitor.cli.run import run_command
from monitor.cli.simulate import simulate_command
from monitor.cli.token import token_app
from monitor.cli.upgrade import upgrade_command

app.command("demo")(demo_command)
app.command("run")(run_command)
app.command("simulate")(simulate_command)
app.command("identify")(identify_command)
app.command("diagnose")(diagnose_command)
app.command("replay")(replay_command)
app.command("record")(record_command)
app.command("bridge")(bridge_command)
history_app.command("show")(history_show_command)
history_app.command("backup")(backup_command)
history_app.command("restore")(restore_command)
history_app.command("reanalyse")(reanalyse_command)
app.add_typer(history_app)
app.command("upgrade")(upgrade_command)
alerts_app.command("list")(alerts_list_command)
alerts_app.command("shelve")(shelve_command)
for action, explanation in ACTIONS.items():
    alerts_app.command(action)(make_command(action, explanation))
alerts_app.command("kpi")(kpi_command)
alerts_app.command("evidence")(evidence_command)
alerts_app.command("replay-evidence")(replay_evidence_command)
app.add_typer(alerts_app)
axes_app.command("init")(axes_init_command)
axes_app.command("check")(axes_check_command)
axes_app.command("report")(axes_report_command)
axes_app.command("event")(axes_life.event_command)
axes_app.command("events")(axes_life.events_command)
axes_app.command("versions")(axes_life.versions_command)
axes_app.command("relearn")(axes_life.relearn_command)
axes_app.command("promote")(axes_life.promote_command)
axes_app.command("demote")(axes_life.demote_command)
axes_app.command("rename")(axes_life.rename_command)
axes_app.command("delete")(axes_life.delete_command)
app.add_typer(axes_app)
app.command("check-config")(check_config_command)
app.command("doctor")(doctor_command)
app.add_typer(token_app)

__all__ = ["app", "main"]
