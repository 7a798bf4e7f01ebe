"""`tribowatch check-config`: read a configuration and its axis files, as the daemon would, and show what they mean."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from monitor.cli.options import AsJson, read_configuration

if TYPE_CHECKING:
    from monitor.config import Config
    from plant.axis import Axis


def check_config_command(
    config: Annotated[Path, typer.Argument(help="Configuration of the daemon, or a bridge file (TOML).")],
    as_json: AsJson = False,
) -> None:
    """Check a configuration, or a bridge file, and every file it lists; unknown keys are errors."""
    from plant.bridge_file import is_bridge_file

    if is_bridge_file(config):
        _check_bridge(config, as_json)
        return
    from monitor.config import read_axes
    from monitor.http_address import address_of

    settings = read_configuration(config)
    axes = read_axes(settings)
    address_of(settings.page)
    summary = summarise(config, settings, axes)
    if as_json:
        from monitor.cli.output import emit_json

        emit_json(summary)
    else:
        _show(summary)


def _check_bridge(path: Path, as_json: bool) -> None:
    """Check a bridge file and show what its frames mean."""
    from monitor.cli.bridge import show_bridge, summarise_bridge
    from monitor.cli.output import emit_json
    from plant.bridge_file import read_bridge

    summary = summarise_bridge(path, read_bridge(path))
    if as_json:
        emit_json(summary)
    else:
        show_bridge(summary)


def summarise(path: Path, config: Config, axes: dict[str, Axis]) -> dict[str, Any]:
    """What the daemon would do with this configuration."""
    rows = [
        {
            "name": axis.name,
            "file": str(entry.file),
            "orientation": axis.mechanics.orientation.value,
            "moving_mass": {"value": axis.mechanics.moving_mass, "unit": axis.inertia_unit},
            "sample_time": axis.stream.sample_time,
            "samples_key": f"{config.zenoh.prefix}/{config.site}/{axis.name}/samples",
        }
        for entry, axis in zip(config.axis, axes.values(), strict=True)
    ]
    return {
        "verdict": "ok",
        "config": str(path),
        "site": config.site,
        "state_dir": str(config.state_dir),
        "listen": list(config.zenoh.listen),
        "page": config.page.listen or None,
        "window": {"samples": config.window.samples, "hop": config.window.hop},
        "workers": config.workers,
        "axes": rows,
    }


def _show(summary: dict[str, Any]) -> None:
    """Print the summary for people."""
    from monitor.cli.output import make_table, screen

    out = screen()
    window = summary["window"]
    out.print(f"{summary['config']}: ok. Site {summary['site']}, state in {summary['state_dir']},")
    out.print(
        f"listens on {', '.join(summary['listen']) or 'nothing'}, page on {summary['page'] or 'no address'}; "
        f"windows of {window['samples']} samples every {window['hop']}; {summary['workers']} worker processes."
    )
    if not summary["axes"]:
        out.print("No [[axis]] is listed: streams would be counted as unknown, none identified.")
        return
    rows = [
        (
            row["name"],
            row["orientation"],
            f"{row['moving_mass']['value']:.4g} {row['moving_mass']['unit']}",
            "from the stream" if row["sample_time"] is None else f"{row['sample_time']:g} s",
            row["samples_key"],
        )
        for row in summary["axes"]
    ]
    out.print(make_table(("axis", "lies", ">inertia", ">sample time", "publish samples to"), rows))
