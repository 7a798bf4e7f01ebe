"""`tribowatch bridge`: drives on a CAN bus become streams."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from monitor.cli.options import AsJson
from plant.errors import InputError

if TYPE_CHECKING:
    from plant.bridge_settings import BridgeSettings
    from plant.can_layout import AxisLayout


def bridge_command(
    config: Annotated[Path, typer.Option("--config", help="The bridge file (TOML); see deploy/bridge.toml.")],
    duration: Annotated[float | None, typer.Option(help="Stop after so many seconds.", show_default=False)] = None,
    connect: Annotated[
        list[str] | None,
        typer.Option(help="Zenoh endpoint of the daemon, instead of the file's; may be repeated.", show_default=False),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Bridge a CAN bus: frames in, samples out on Zenoh, what was counted on stderr and under `.../bridge`."""
    if duration is not None and not duration > 0:
        raise InputError(f"--duration is {duration:g} s, but must be > 0 s")
    import threading

    from monitor.bridge_news import news
    from monitor.cli.output import emit_json, note
    from plant.bridge_can import run_bridge
    from plant.bridge_file import read_bridge
    from plant.zenoh_session import open_session

    settings = read_bridge(config)
    for remark in settings.remarks:
        note(remark)
    latest: list[dict[str, Any]] = []

    def tell(status: dict[str, Any]) -> None:
        for line in news(latest[-1] if latest else None, status):
            note(f"{settings.name}: {line}")
        latest[:] = [status]

    endpoints = tuple(connect or settings.zenoh.connect)
    stop, interrupted = threading.Event(), False
    with open_session("client", connect=endpoints) as session:
        note(f"{settings.name}: {settings.can.interface} {settings.can.channel} to {', '.join(endpoints)}")
        try:
            status = run_bridge(settings, session, stop=stop, duration=duration, on_status=tell)
        except KeyboardInterrupt:
            if not latest:
                raise
            interrupted, status = True, latest[-1]
    if as_json:
        emit_json(status)
    else:
        _show(status)
    if interrupted:
        raise typer.Exit(130)


def _show(status: dict[str, Any]) -> None:
    """Print the counters for people."""
    from monitor.cli.output import make_table, screen

    out, frames, bus, clock = screen(), status["frames"], status["bus"], status["clock"]
    out.print(
        f"{status['bridge']}: {frames['frames']} frames in {status['seconds']:.1f} s; unknown {frames['unknown']}, "
        f"wrong length {frames['wrong_length']}, errors {frames['errors']}, bus-off {frames['bus_off']}, dropped "
        f"{bus['overruns']}; bus opened anew {bus['reconnects'] + bus['reopened']} times; SYNCs {clock['syncs']}, lost "
        f"{clock['syncs_lost']}, drift {clock['drift'] * 1e6:.0f} ppm."
    )
    rows = [
        (
            axis,
            f"{one['sent']}",
            f"{one['lost']}",
            f"{one['filled']}",
            f"{one['committed_seq'] + 1}",
            one["refused"] or one["suspicion"] or one["state"] or "no frames yet",
        )
        for axis, one in status["axes"].items()
    ]
    out.print(make_table(("axis", ">sent", ">lost", ">filled", ">committed", "state"), rows))


def summarise_bridge(path: Path, settings: BridgeSettings) -> dict[str, Any]:
    """What the bridge would do with its file; for `tribowatch check-config`."""
    from plant.keys import bridge_key, samples_key

    site, prefix = settings.site, settings.zenoh.prefix
    return {
        "verdict": "ok",
        "config": str(path),
        "bridge": settings.name,
        "site": site,
        "bus": {**dataclasses.asdict(settings.can), "options": dict(settings.options)},
        "time": dataclasses.asdict(settings.time),
        "connect": list(settings.zenoh.connect),
        "status_key": bridge_key(site, settings.name, prefix),
        "remarks": list(settings.remarks),
        "axes": [
            {
                "name": layout.axis,
                "node": layout.node,
                "samples_key": samples_key(site, layout.axis, prefix),
                "frames": _frames(layout),
            }
            for layout in settings.layouts
        ],
    }


def _frames(layout: AxisLayout) -> list[dict[str, Any]]:
    from plant.can_layout import show_id

    return [
        {
            "id": show_id(frame.key),
            "name": frame.name,
            "bytes": frame.length,
            "pages": {page.switch.name: list(page.values) for page in frame.pages},
            "signals": [
                {
                    "channel": signal.channel,
                    "name": signal.name,
                    "start_bit": signal.start,
                    "bits": signal.length,
                    "signed": signal.signed,
                    "byte_order": "big-endian" if signal.big_endian else "little-endian",
                    "scale": signal.scale,
                    "offset": signal.offset,
                }
                for signal in frame.signals
            ],
        }
        for frame in layout.frames
    ]


def show_bridge(summary: dict[str, Any]) -> None:
    """Print the summary of a bridge file for people."""
    from monitor.cli.output import make_table, screen

    out, bus = screen(), summary["bus"]
    out.print(
        f"{summary['config']}: ok. Bridge {summary['bridge']} of site {summary['site']}: {bus['interface']} "
        f"{bus['channel']} to {', '.join(summary['connect'])}."
    )
    rows = [
        (
            axis["name"],
            frame["id"],
            f"{frame['bytes']}",
            f"{signal['start_bit']}+{signal['bits']}",
            signal["channel"],
            f"{signal['scale']:.6g}",
            signal["name"],
        )
        for axis in summary["axes"]
        for frame in axis["frames"]
        for signal in frame["signals"]
    ]
    out.print(make_table(("axis", "id", ">bytes", ">bits", "channel", ">SI per count", "signal"), rows))
    for remark in summary["remarks"]:
        out.print(remark)
