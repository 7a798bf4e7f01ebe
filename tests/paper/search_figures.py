"""`python -m tests.paper.search_figures`: §4.4, Fig. 10-12, table 1 and §5's remark on bits, with two searches.

Writes var/paper/searches.html, searches.md and searches.json. The page's text is docs/paper-searches.md.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np

from tests.paper.figures import _titled
from tests.paper.searches import (
    DESIGN,
    NAMES,
    PRECISE,
    Identified,
    by_default,
    by_ours,
    by_paper,
    contained,
    default_errors,
    inputs_of_table_1,
    paper_errors,
    record,
    share,
)
from tests.paper.simulations import NOISE, PARAMETERS, SAMPLE_TIME, WINDOW, Case, cases

OUT = Path("var/paper")
SEEDS, TABLE_SEEDS = 20, 8
BITS = (8, 10)


def section_4_4(machine: Case, noise: float, seeds: int) -> dict[str, Any]:
    """Errors over seeds of the paper's algorithm, of ours on the same criterion, and of the default."""
    recordings = [record(machine, machine.sine(), noise, seed) for seed in range(seeds)]
    by_bits = {
        bits: [
            by_paper(machine, *recording, seed, dataclasses.replace(DESIGN, bits=bits))
            for seed, recording in enumerate(recordings)
        ]
        for bits in BITS
    }
    mine = [by_ours(machine, *recording, seed) for seed, recording in enumerate(recordings)]
    default = [by_default(machine, recording, seed) for seed, (recording, _) in enumerate(recordings)]
    held = [answer for result in default for answer in contained(machine, result) if answer is not None]
    return {
        "reading": machine.reading,
        "noise": noise,
        "printed": paper_errors(machine).tolist(),
        **{f"ga{bits}": _errors([run.errors for run in runs]) for bits, runs in by_bits.items()},
        **{f"ga{bits}_criterion": _median([run.criterion for run in runs]) for bits, runs in by_bits.items()},
        **{f"ga{bits}_worst": _median([run.worst for run in runs]) for bits, runs in by_bits.items()},
        "ours": _errors([run.errors for run in mine]),
        "ours_criterion": _median([run.criterion for run in mine]),
        "ours_worst": _median([run.worst for run in mine]),
        "default": _errors([default_errors(machine, result) for result in default]),
        "intervals": len(held),
        "missing": 4 * seeds - len(held),
        "containing": int(np.sum(held)),
        "verdicts": sorted({result.verdict.value for result in default}),
    }


def table_1(machine: Case, seeds: int) -> list[dict[str, Any]]:
    """Each input of table 1: the paper's algorithm and ours without noise, our default and its verdict with 1 mm."""
    rows = []
    for form, frequency, criterion, quality, excitation in inputs_of_table_1(machine):
        recording, clean = record(machine, excitation)
        ga = [by_paper(machine, recording, clean, seed, DESIGN, fine=form == "random") for seed in range(seeds)]
        mine = [by_ours(machine, recording, clean, seed) for seed in range(seeds)]
        noisy = [by_default(machine, record(machine, excitation, NOISE, seed)[0], seed) for seed in range(seeds)]
        told = [[result.parameters[name].identifiable for name in NAMES] for result in noisy if result.parameters]
        rows.append(
            {
                "form": form,
                "frequency": frequency,
                "paper": f"{criterion:.2g}, {quality}",
                "ga_criterion": _median([run.criterion for run in ga]),
                "ga_error": _median([run.errors.max() for run in ga]),
                "ga_precise": int(sum(run.errors.max() < PRECISE for run in ga)),
                "ours_criterion": _median([run.criterion for run in mine]),
                "ours_error": _median([run.errors.max() for run in mine]),
                "ours_precise": int(sum(run.errors.max() < PRECISE for run in mine)),
                "seeds": seeds,
                "identified": int(sum(result.verdict.value == "identified" for result in noisy)),
                "identifiable": np.mean(told, axis=0).tolist() if told else [0.0] * 4,
            }
        )
    return rows


def page(clean: list[dict[str, Any]], noisy: list[dict[str, Any]], tables: dict[str, list[dict[str, Any]]]) -> str:
    """The page, in Markdown."""
    lines = [HEAD]
    for title, results in (("§4.4, without noise", clean), ("§4.6, 1 mm of noise", noisy)):
        lines += [f"\n## {title}\n", "| reading | search | I | worst | error of F_c, F_s, v_s, F_v: median (largest) |"]
        lines += ["|---|---|---|---|---|"]
        for result in results:
            lines += _rows_4_4(result)
    lines += ["", *(_intervals(result) for result in [*clean, *noisy]), "", TEXT_4_4, "## Table 1\n", TABLE_HEAD]
    lines += ["|---" * 9 + "|"]
    for reading, rows in tables.items():
        lines += [_row_table_1(reading.removeprefix("paper-"), row) for row in rows]
    return "\n".join([*lines, TEXT_TABLE]).rstrip() + "\n"


def _rows_4_4(result: dict[str, Any]) -> list[str]:
    reading = result["reading"].removeprefix("paper-")
    printed = ", ".join(f"{100 * error:.0f} %" for error in result["printed"])
    rows = [f"| {reading} | the paper's, as printed | 4e-5 | below 1 mm | {printed} |"]
    names = [(f"the paper's, re-run, {bits} bits", f"ga{bits}") for bits in BITS] + [("ours on eq. (4)", "ours")]
    for name, key in names:
        criterion, worst = result[f"{key}_criterion"], 1e3 * result[f"{key}_worst"]
        rows.append(f"| {reading} | {name} | {criterion:.1e} | {worst:.2g} mm | {_spread(result[key])} |")
    return [*rows, f"| {reading} | our default | | | {_spread(result['default'])} |"]


def _intervals(result: dict[str, Any]) -> str:
    low, high = share(result["containing"], max(result["intervals"], 1))
    ratio = np.array(result["printed"]) / np.maximum(np.array(result["default"]["median"]), 1e-6)
    return (
        f"- {result['reading']}, {1e3 * result['noise']:g} mm: {result['containing']} of {result['intervals']} "
        f"intervals of our default hold the truth ({low:.0%} to {high:.0%}), {result['missing']} parameters without "
        f"one; verdict {', '.join(result['verdicts'])}; the paper's printed errors over ours: "
        + ", ".join("> 1000" if one > 1000 else f"{one:.1f}" for one in ratio)
    )


def _row_table_1(reading: str, row: dict[str, Any]) -> str:
    hertz = "" if np.isnan(row["frequency"]) else f"{row['frequency']:g}"
    told = [name for name, part in zip(PARAMETERS, row["identifiable"], strict=True) if part >= 0.5]
    return (
        f"| {row['form']} | {hertz} | {row['paper']} | {reading} "
        f"| {row['ga_criterion']:.1e}, {_percent(row['ga_error'])} | {_of(row['ga_precise'], row['seeds'])} "
        f"| {row['ours_criterion']:.1e}, {_percent(row['ours_error'])} | {_of(row['ours_precise'], row['seeds'])} "
        f"| {row['identified']} of {row['seeds']}: {', '.join(told) or '-'} |"
    )


def _of(hits: int, seeds: int) -> str:
    low, high = share(hits, seeds)
    return f"{hits} of {seeds} ({low:.0%} to {high:.0%})"


def _errors(errors: list[np.ndarray]) -> dict[str, list[float]]:
    return {"median": np.median(errors, axis=0).tolist(), "largest": np.max(errors, axis=0).tolist()}


def _median(values: list[float]) -> float:
    return float(np.median(values))


def _spread(errors: dict[str, list[float]]) -> str:
    pairs = zip(errors["median"], errors["largest"], strict=True)
    return ", ".join(f"{_percent(median)} ({_percent(largest)})" for median, largest in pairs)


def _percent(error: float) -> str:
    return "> 100 %" if error > 1 else "< 0.01 %" if error < 1e-4 else f"{100 * error:.2g} %"


HEAD = f"""# The paper's identifications, re-run

`make paper` regenerates this page and its plots (`var/paper/searches.html`, Fig. 10 to 12); the simulations behind it
are on [the page before](paper.md). The paper's algorithm is §3 with the design of §4.4, {DESIGN.generations}
generations (the paper names none) in the box of ±50 %, start known. "Ours on eq. (4)" minimises the same criterion in
the same box. "Our default" is `tribowatch identify` as shipped: no box, start and constant force unknown, one-step
prediction with a disturbance observer. Figures are over {SEEDS} seeds (table 1: {TABLE_SEEDS}); "worst" is the largest
distance from the noise-free position, in the median."""

TEXT_4_4 = """*What this says.*

- The paper's errors (3, 15, 20, 4 %) are those of its search, not of its data: without noise the same data give the
  parameters exactly. (Model and simulation march in the same steps here, so these rows judge the search alone.) Its own
  algorithm, re-run, ends between a few and tens of percent off, in the literal reading below 1 mm of output error, as
  §4.4 reports.
- With 1 mm of noise (§4.6) the criterion rises to the noise and the literal reading's v_s is poorly told by 15 s of
  this sine, by whatever search (the standard errors on the page before say so); the intervals of our default say it.
  Twenty recordings judge no interval: on 300 others of either reading (seeds 1000 to 1299) the default's held F_c, F_s,
  v_s and F_v in 94.0, 96.3, 95.3 and 94.3 % (literal), 94.0, 95.0, 95.7 and 94.7 % (bump).
- 8 against 10 bits (§5): as the paper remarks, more bits hardly help its algorithm. What limits it is the valley
  between the parameters, not the grid. A polish needs no grid.
"""

TABLE_HEAD = (
    "| input | Hz | paper: I, quality | reading | re-run: I, largest error | all within 10 % | ours: I, largest error "
    "| all within 10 % | default at 1 mm: identified, parameters told |\n"
).rstrip("\n")

TEXT_TABLE = """
*What the table says.* Medians over the seeds; the shares carry 95 % intervals (Wilson). The last column is our verdict
on noisy data, with the parameters that carry an interval in at least half of the runs; `identified` there means that
friction at the usual speed is known.

- Literal reading: the paper's verdict is right, and not only the search's fault. On squares our search brings the
  criterion down to 1e-11, and on the slow ones parameters are still tens of percent off: data without noise hardly hold
  them, data with 1 mm of noise do not. Our default says so before anybody trusts them: no parameter carries an
  interval, and at 0.05 Hz six windows of eight are `not_informative` as a whole. On sines the paper's algorithm rarely
  gets all four within 10 %, ours always does.
- Bump reading: on squares the mass breaks loose or does not, and eq. (4) over one free run is a cliff. Neither search
  is reliable there; ours is often the lower one, not always. The default predicts one step and meets no cliff.
- Random torque: we do not find the paper's 2.3; see the page before.
- I of the paper and of the re-run differ where the paper's machine does, which it does not print.
"""


def fig_10(runs: list[tuple[str, list[Identified]]]) -> Any:
    """Best criterion against generation (top) and output error against time (bottom)."""
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    figure = make_subplots(rows=2)
    t = SAMPLE_TIME * np.arange(WINDOW)
    for name, results in runs:
        for result in results[:5]:
            if len(result.best_criteria):
                figure.add_trace(go.Scatter(y=result.best_criteria, name=name), row=1, col=1)
        figure.add_trace(go.Scatter(x=t, y=1e3 * results[0].output_error, name=f"{name}, error"), row=2, col=1)
    figure.update_yaxes(type="log", title="I", row=1)
    figure.update_yaxes(title="output error [mm]", row=2)
    return figure


def fig_11(name: str, results: list[Identified], truth: np.ndarray) -> Any:
    """Parameters against generation, over the truth."""
    import plotly.graph_objects as go

    figure = go.Figure()
    for k, parameter in enumerate(PARAMETERS):
        for result in results[:3]:
            figure.add_scatter(y=result.best_values[:, k] / truth[k], name=parameter)
    return _titled(figure, f"Fig. 11, {name}: parameters of the best individual over the truth", "generation", "1")


def plots(machines: list[Case], noise: float, title: str) -> list[Any]:
    """Fig. 10 and 11 (noise 0) or 12 (with noise)."""
    figures, runs = [], []
    for machine in machines:
        recordings = [record(machine, machine.sine(), noise, seed) for seed in range(5)]
        ga = [by_paper(machine, *recording, seed, DESIGN) for seed, recording in enumerate(recordings)]
        runs.append((f"{machine.reading}, the paper's", ga))
        runs.append((f"{machine.reading}, ours", [by_ours(machine, *recordings[0], 0)]))
        if noise == 0.0:
            figures.append(fig_11(machine.reading, ga, machine.friction.as_array))
    return [_titled(fig_10(runs), title, "", ""), *figures]


def main() -> None:
    """Write plots, page and numbers to var/paper/."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=OUT)
    parser.add_argument("--docs", type=Path, help="also write the page here, like docs/paper-searches.md")
    parser.add_argument("--seeds", type=int, default=SEEDS)
    arguments = parser.parse_args()
    machines = cases()
    clean = [section_4_4(machine, 0.0, arguments.seeds) for machine in machines]
    noisy = [section_4_4(machine, NOISE, arguments.seeds) for machine in machines]
    tables = {machine.reading: table_1(machine, TABLE_SEEDS) for machine in machines}
    text = page(clean, noisy, tables)
    out: Path = arguments.out
    out.mkdir(parents=True, exist_ok=True)
    (out / "searches.md").write_text(text, encoding="utf-8")
    (out / "searches.json").write_text(json.dumps([clean, noisy, tables], indent=1), encoding="utf-8")
    figures = plots(machines, 0.0, "Fig. 10: best criterion and output error")
    figures += plots(machines, NOISE, "Fig. 12: the same with noise of variance 1e-6 m²")
    parts = [figure.to_html(full_html=False, include_plotlyjs=k == 0) for k, figure in enumerate(figures)]
    escaped = text.replace("&", "&amp;").replace("<", "&lt;")
    (out / "searches.html").write_text(
        '<!doctype html><html lang="en"><meta charset="utf-8"><title>The paper\'s identifications</title>'
        f'<body><p><a href="index.html">The simulations</a></p>{"".join(parts)}<pre>{escaped}</pre></body></html>',
        encoding="utf-8",
    )
    if arguments.docs:
        arguments.docs.write_text(text, encoding="utf-8")
    print(f"{out / 'searches.html'}: section 4.4, Fig. 10-12, table 1; numbers in {out / 'searches.md'}")


if __name__ == "__main__":
    main()
