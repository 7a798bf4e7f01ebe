"""Style and script of a report page: light and dark, phone and paper, no foreign request."""

POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"

STYLE = """
:root { color-scheme: light dark; --ink: #1b2026; --soft: #59626d; --page: #ffffff; --card: #f5f6f8; --line: #d8dce2;
  --good: #00704d; --bad: #b34700; --doubt: #6b4fa0; --none: #59626d; --grid: #e3e6ea; --bar: #2e8bc0; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e9ed; --soft: #a3acb7; --page: #14171b; --card: #1d2126;
  --line: #363d46; --good: #4cc79a; --bad: #f5914a; --doubt: #b9a2ea; --none: #a3acb7; --grid: #2b3138; } }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 62rem; padding: 1.5rem 1.25rem 3rem; background: var(--page); color: var(--ink);
  font: 1rem/1.5 system-ui, -apple-system, "Segoe UI", "Liberation Sans", sans-serif; }
header { border-bottom: 1px solid var(--line); margin-bottom: 1.25rem; }
h1 { font-size: 1.55rem; line-height: 1.25; margin: .35rem 0 .5rem; }
h2 { font-size: 1.15rem; margin: 2.2rem 0 .5rem; padding-top: .8rem; border-top: 1px solid var(--line); }
header + h2 { border-top: 0; margin-top: 0; padding-top: 0; }
h3 { font-size: 1rem; margin: 1.3rem 0 .2rem; }
p { margin: .4rem 0; max-width: 48rem; }
.eyebrow, .note, footer { color: var(--soft); font-size: .875rem; }
.verdict { display: inline-block; padding: .1rem .6rem; border: 1.5px solid; border-radius: 1rem; font-weight: 600; }
.explained { color: var(--bad); } .no_mismatch { color: var(--good); } .unexplained { color: var(--doubt); }
.insufficient_data { color: var(--none); }
.lead { font-size: 1.05rem; }
.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(10.5rem, 1fr)); gap: .7rem; margin: 1rem 0; }
.figures div { background: var(--card); border-radius: .4rem; padding: .6rem .8rem; }
.figures b { display: block; font-size: 1.3rem; line-height: 1.3; }
.figures span { color: var(--soft); font-size: .8rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; margin: .5rem 0; font-size: .9rem; font-variant-numeric: tabular-nums; }
th { text-align: left; color: var(--soft); font-weight: 600; border-bottom: 1.5px solid var(--line); }
th, td { padding: .25rem .8rem .25rem 0; vertical-align: top; } td { border-bottom: 1px solid var(--line); }
th.n, td.n { text-align: right; white-space: nowrap; }
th, td { white-space: nowrap; } td:last-child:not(.n):not(:empty) { white-space: normal; }
td.text { min-width: 17rem; }
tr.named td { font-weight: 600; }
ul { padding-left: 1.2rem; max-width: 48rem; } li { margin: .15rem 0; }
code { font-size: .85em; overflow-wrap: anywhere; }
.plot { margin: .3rem 0 .6rem; }
.plot text { fill: var(--ink) !important; }
.plot .gridlayer path { stroke: var(--grid) !important; } .plot .zerolinelayer path { stroke: var(--line) !important; }
.plot .hovertext text { fill: #ffffff !important; }
@page { margin: 14mm; }
@media print { :root { color-scheme: light; --ink: #000; --soft: #444; --page: #fff; --card: #f3f3f3; --line: #bbb;
  --good: #00563b; --bad: #8a3600; --doubt: #4b3480; --none: #444; --grid: #ddd; }
  body { padding: 0; max-width: none; font-size: 10pt; } h2 { break-after: avoid; } .plot, tr { break-inside: avoid; }

  th, td { white-space: normal; } td.text { min-width: 0; } h3 { break-after: avoid; } .wide { overflow: visible; } }
"""

SCRIPT = """
const plots = [...document.querySelectorAll('.plot')];
for (const plot of plots) {
  const figure = JSON.parse(document.getElementById(plot.id + '-figure').textContent);
  Plotly.newPlot(plot, figure.data, figure.layout,
    { responsive: true, displaylogo: false, displayModeBar: false })
    .then(() => { plot.dataset.drawn = 'yes'; });
}
window.addEventListener('beforeprint', () => plots.forEach(p => Plotly.relayout(p, { autosize: false, width: 680 })));
window.addEventListener('afterprint', () => plots.forEach(p => Plotly.relayout(p, { autosize: true, width: null })));
"""
