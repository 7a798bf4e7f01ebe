"""Write what comes from the code: docs/cli.md, docs/configuration.md; deploy/*.toml with every default.

`make docs` runs it; a test fails when one of them and the code differ.
"""

from __future__ import annotations

import html
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent


def cli_reference() -> str:
    """Every command with its options, from the help texts."""
    done = subprocess.run(
        [sys.executable, "-m", "typer", "monitor.cli", "utils", "docs", "--name", "tribowatch"],
        capture_output=True,
        text=True,
        check=True,
        cwd=HERE.parent,
        env=None,
    )
    text = html.unescape(done.stdout)
    text = re.sub(r"\{(\w+)\}", lambda match: match.group(1).upper(), text)
    text = text.replace("# `tribowatch`\n", "# Commands\n\n" + CLI_PREFACE, 1)
    return text.rstrip() + "\n"


def configuration_reference() -> str:
    """Every key of the configuration, from the models that check it."""
    from pydantic import BaseModel
    from pydantic_core import PydanticUndefined

    from monitor.config import Config
    from monitor.config_sections import AxisSection

    def rows(model: type[BaseModel], skip: tuple[str, ...] = ()) -> list[str]:
        table = ["| key | default | meaning |", "|---|---|---|"]
        for name, field in model.model_fields.items():
            if name in skip:
                continue
            default = "required" if field.default is PydanticUndefined else f"`{_toml(field.default)}`"
            table.append(f"| `{name}` | {default} | {field.description or ''} |")
        return table

    sections = {
        name: field.default for name, field in Config.model_fields.items() if isinstance(field.default, BaseModel)
    }
    lines = [CONFIG_PREFACE, "## Top level", "", *rows(Config, (*sections, "axis")), ""]
    for name, default in sections.items():
        first = (type(default).__doc__ or "").strip().splitlines()[0]
        lines += [f"## `[{name}]`", "", first, "", *rows(type(default)), ""]
    lines += ["## `[[axis]]`, repeated", "", "The axes to identify; see [the axis file](axis-file.md).", ""]
    lines += [*rows(AxisSection), ""]
    return "\n".join(lines)


def example_configuration() -> str:
    """A configuration that says every default, with its meaning beside it."""
    from pydantic import BaseModel
    from pydantic_core import PydanticUndefined

    from monitor.config import Config

    def lines(model: type[BaseModel]) -> list[str]:
        found = []
        for name, field in model.model_fields.items():
            if name == "axis" or isinstance(field.default, BaseModel):
                continue
            value = EXAMPLE[name] if field.default is PydanticUndefined else _toml(field.default)
            found.append(f"{f'{name} = {value}':40}# {field.description or ''}".rstrip(" #"))
        return found

    text = [EXAMPLE_PREFACE, *lines(Config)]
    for name, field in Config.model_fields.items():
        if isinstance(field.default, BaseModel):
            text += ["", f"[{name}]", *lines(type(field.default))]
    return "\n".join([*text, EXAMPLE_AXES])


def example_bridge() -> str:
    """A bridge file that says every default, with its meaning beside it."""
    from plant.bridge_settings import SECTIONS, AxisTable, meanings

    def lines(kind: type[Any], mark: str = "") -> list[str]:
        return [
            f"{f'{mark}{name} = {BRIDGE_EXAMPLE.get(name, _toml(default))}':40}# {meaning}"
            for name, default, meaning in meanings(kind)
        ]

    text = [BRIDGE_PREFACE]
    for name, kind in SECTIONS.items():
        text += ["", f"# {(kind.__doc__ or '').strip().splitlines()[0]}", f"[{name}]", *lines(kind)]
    text += ["", f"# {(AxisTable.__doc__ or '').strip().splitlines()[0]}", "[[axis]]"]
    text += [("" if line.split(" ")[0] in BRIDGE_USED else "# ") + line for line in lines(AxisTable)]
    return "\n".join([*text, BRIDGE_AXES])


def _toml(value: Any) -> str:
    """A default as one writes it in TOML."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return "[" + ", ".join(_toml(item) for item in value) + "]"
    if isinstance(value, (str, Path)):
        return f'"{value}"'
    return f"{value}"


CLI_PREFACE = """\
Generated from the code by `make docs`; do not edit.

Every command that prints a result takes `--json`: one JSON object on stdout and nothing else there; logs and progress
go to stderr. Exit codes: 0 done (whatever the verdict), 2 bad input or configuration (one line on stderr says what,
where, the value with its unit, and what to do), 3 service or database out of reach, 130 and 143 interrupted by ^C and
by SIGTERM, 1 an error of ours (the line names the file with the details).
"""

CONFIG_PREFACE = """\
# Configuration of the daemon

Generated from the code by `make docs`; do not edit.

One TOML file, given to `tribowatch run --config FILE`. Unknown keys are errors that name the nearest allowed key;
`tribowatch check-config FILE` checks the file and the axis files it lists. Relative paths are relative to the file.
Every key can be overridden by the environment: `TRIBOWATCH_ZENOH__PREFIX=plant` sets `prefix` in `[zenoh]`.
"""

EXAMPLE = {"site": '"plant-1"'}
EXAMPLE_PREFACE = """\
# Configuration of the daemon with every default; only `site` is required. Generated from the code by `make docs`.
# tribowatch check-config tribowatch.toml; tribowatch run --config tribowatch.toml
"""
EXAMPLE_AXES = """
# One [[axis]] per axis; an axis that streams without being listed is counted, not identified.
# [[axis]]
# file = "axes/axis-0001.toml"
"""

BRIDGE_EXAMPLE = {
    "name": '"axis-0001"',
    "node": "1",
    "counts_per_unit": "1e6",
    "rated_torque": "8.0",
    "sync_id": "0x80",
    "file": '"axis-0001.toml"',
    "dbc": '"plant.dbc"',
}
BRIDGE_USED = {"name", "node", "counts_per_unit", "rated_torque"}
BRIDGE_PREFACE = """\
# Bridge file: drives on a CAN bus become streams; docs/can.md explains it. Generated from the code by `make docs`.
# tribowatch check-config bridge.toml; tribowatch bridge --config bridge.toml
name = "bridge-1"                       # of the bridge, in its own keys
site = "plant-1"                        # second part of every key"""
BRIDGE_AXES = """\
# pdo = [{ id = 0x181, objects = ["6041:16", "6064:32", "6077:16"] }]
# signals = { torque = "AX1_TPDO1.TorqueActual", position = "AX1_TPDO1.PositionActual" }   # with dbc
# scale = { position = 0.001 }          # with dbc: its unit -> SI
"""

PAGES = {
    "docs/cli.md": cli_reference,
    "docs/configuration.md": configuration_reference,
    "deploy/tribowatch.toml": example_configuration,
    "deploy/bridge.toml": example_bridge,
}

if __name__ == "__main__":
    sys.path.insert(0, str(HERE.parent))
    for name, page in PAGES.items():
        (HERE.parent / name).write_text(page(), encoding="utf-8")
        sys.stdout.write(f"{name}\n")
