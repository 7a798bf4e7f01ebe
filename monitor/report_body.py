"""The page of a report as it grows: sections, tables, figures, numbers with their digits. Pure; for all reports."""

from __future__ import annotations

import html
import json
import math
import platform
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from monitor import report_figures as figures
from monitor.report_figures import Figure, show_unit
from monitor.report_style import POLICY, SCRIPT, STYLE

if TYPE_CHECKING:
    from plant.recording import Recording

WORDY = "what became of it"  # a column of sentences


class Measured(Protocol):
    """A value with its unit and 95 % interval, from wherever."""

    @property
    def value(self) -> float:
        """The number."""

    @property
    def unit(self) -> str:
        """Its unit, ASCII."""

    @property
    def ci95(self) -> tuple[float, float] | None:
        """None where not identifiable."""


@dataclass(slots=True)
class Body:
    """The page as it grows; everything that goes in is escaped here. `length`, `force`: units of the machine."""

    length: str = "m"
    force: str = "N"
    parts: list[str] = field(default_factory=list)
    plots: int = 0

    def document(self, title: str) -> str:
        """The whole page, plotly's program within."""
        from plotly.offline import get_plotlyjs

        content = "\n".join(self.parts)
        return (
            '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
            f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
            '<meta name="viewport" content="width=device-width, initial-scale=1">'
            f"<title>{html.escape(title)}</title><style>{STYLE}</style></head>\n"
            f"<body>{content}\n<script>{get_plotlyjs()}</script>\n<script>{SCRIPT}</script></body></html>\n"
        )

    def head(self, eyebrow: str, word: str, kind: str, headline: str, lead: str) -> None:
        """The verdict in a `word` of the colour `kind` (a class of the style sheet), the headline, the sentence."""
        self.parts.append(
            f'<header><p class="eyebrow">{html.escape(eyebrow)} '
            f'<span class="verdict {html.escape(kind)}">{html.escape(word)}</span></p>'
            f'<h1>{html.escape(headline)}</h1><p class="lead">{html.escape(lead)}</p></header>'
        )

    def cards(self, shown: Sequence[tuple[str, str]]) -> None:
        """The numbers one looks for first, each with what it is."""
        if shown:
            cells = "".join(f"<div><b>{html.escape(a)}</b><span>{html.escape(b)}</span></div>" for a, b in shown)
            self.parts.append(f'<div class="figures">{cells}</div>')

    def provenance(self, data_sha256: str, seed: int | None) -> None:
        """What was used, so that it can be done again."""
        packages = ", ".join(f"{name} {version(name)}" for name in ("tribowatch", "numpy", "scipy", "numba", "plotly"))
        sown = "" if seed is None else f"Seed {seed} · "
        self.parts.append(
            f"<footer><p>Data SHA-256 <code>{html.escape(data_sha256)}</code></p>"
            f"<p>{sown}{html.escape(packages)} · Python {platform.python_version()}</p></footer>"
        )

    def section(self, title: str) -> None:
        """Begin a section."""
        self.parts.append(f"<h2>{html.escape(title)}</h2>")

    def heading(self, title: str) -> None:
        """A smaller heading."""
        self.parts.append(f"<h3>{html.escape(title)}</h3>")

    def text(self, text: str, kind: str = "") -> None:
        """A paragraph."""
        self.parts.append(f'<p class="{kind}">{html.escape(text)}</p>')

    def items(self, lines: Iterable[str]) -> None:
        """A list."""
        self.parts.append("<ul>" + "".join(f"<li>{html.escape(line)}</li>" for line in lines) + "</ul>")

    def table(self, header: Sequence[str], rows: Iterable[Sequence[str]], marked: Sequence[int] = ()) -> None:
        """A table; columns that begin with '>' are numbers; rows numbered in `marked` stand out."""
        kinds = [' class="n"' if name.startswith(">") else "" for name in header]
        if header[-1] == WORDY:
            kinds[-1] = ' class="text"'
        head = "".join(f"<th{k}>{html.escape(name.lstrip('>'))}</th>" for name, k in zip(header, kinds, strict=True))
        lines = []
        for index, row in enumerate(rows):
            cells = "".join(f"<td{k}>{html.escape(cell)}</td>" for cell, k in zip(row, kinds, strict=True))
            lines.append(f"<tr{' class=named' if index in marked else ''}>{cells}</tr>")
        self.parts.append(f'<div class="wide"><table><tr>{head}</tr>{"".join(lines)}</table></div>')

    def figure(self, drawn: Figure, label: str) -> None:
        """A plot; its numbers stand in the page as JSON."""
        self.plots += 1
        name = f"plot-{self.plots}"
        numbers = json.dumps(drawn, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
        self.parts.append(
            f'<div class="plot" id="{name}" role="img" aria-label="{html.escape(label)}" '
            f'style="min-height:{drawn["layout"]["height"]}px"></div>'
            f'<script type="application/json" id="{name}-figure">{numbers}</script>'
        )


def recordings_section(body: Body, recordings: Sequence[Recording]) -> None:
    """The recordings in a table and as they came."""
    rows = [
        (
            one.note or f"recording {index}",
            Path(one.source).name,
            str(len(one)),
            number(float(one.t[-1] - one.t[0])),
            number(1.0 / one.period if one.period > 0 else None),
            one.loop,
            one.hold.value,
            one.sha256()[:12],
        )
        for index, one in enumerate(recordings, 1)
    ]
    header = ("recording", "file", ">samples", ">duration [s]", ">rate [Hz]", "loop", "torque", "SHA-256, begins")
    body.table(header, rows)
    body.figure(figures.recordings_figure(recordings, body.length, body.force), "position and drive force")


def words(name: str) -> str:
    """A name as one says it."""
    return name.replace("_", " ")


def number(value: float | None, digits: int = 4) -> str:
    """A number, a dash where there is none."""
    return "–" if value is None or not math.isfinite(value) else f"{value:.{digits}g}"


def shown_quantity(quantity: Measured) -> tuple[str, str, str]:
    """Value and interval with the digits the interval allows, and the unit."""
    unit = "" if quantity.unit == "1" else show_unit(quantity.unit)
    if quantity.ci95 is None or not all(math.isfinite(end) for end in quantity.ci95):
        return number(quantity.value), "not identifiable", unit
    half = 0.5 * (quantity.ci95[1] - quantity.ci95[0])
    largest = max(abs(quantity.value), *map(abs, quantity.ci95), 1e-300)
    if half <= 0:
        return number(quantity.value), "–", unit
    digits = min(max(2 + math.floor(math.log10(largest)) - math.floor(math.log10(half)), 2), 6)
    low, high = (number(end, digits) for end in quantity.ci95)
    return number(quantity.value, digits), f"{low} to {high}", unit
