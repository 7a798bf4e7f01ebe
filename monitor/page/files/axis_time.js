// Everything that happened to one axis on one time axis: a number, its charts, the operating point, the windows.
import { el, unit, words } from './common.js';
import { COLOURS, LIST, banded, shade, swatch } from './charts.js';

const CONDITIONS = { temperature: ['temperature', '°C'], load: ['load', ''], mean_speed: ['mean speed', '/s'], travel: ['travel', ''] };
const DASHES = ['solid', 'dash', 'dot', 'dashdot', 'longdash'];
const VERDICTS = { identified: COLOURS.normal, not_informative: COLOURS.fifth, bad_data: COLOURS.now };
const PANELS = [[0.79, 1], [0.5, 0.7], [0.25, 0.41], [0, 0.16]];
const ms = (ns) => ns / 1e6;
const across = (yref, more) => ({ xref: 'paper', x0: 0, x1: 1, yref, ...more });

function heading(panel, text) {
  return { text, xref: 'paper', x: 0, xanchor: 'left', yref: 'paper', y: PANELS[panel][1], yanchor: 'bottom', yshift: 4, showarrow: false, font: { size: 12 } };
}

/** What was drawn with which line, below the chart: it wraps on a phone, and is text for those who listen. */
export function legendOf(watch) {
  const lines = Object.keys(watch.charts).map((name, i) => [name, LIST[i % LIST.length], DASHES[i % DASHES.length]]);
  const bars = [...new Set(watch.verdicts.map((one) => one.verdict))].map((name) => [words(name), VERDICTS[name] ?? COLOURS.fifth, 'bar']);
  return el('ul', { class: 'legend' }, [...lines, ...bars].map(([name, colour, dash]) => el('li', {}, swatch(colour, dash), ` ${name}`)));
}

/** Panel 1: the chosen number with its interval, and where it falls while the axis is healthy. */
function numberPanel(parameter, curves, history, shapes) {
  const points = history.series[parameter]?.points ?? [];
  const known = curves?.baseline?.indicators?.find((one) => one.name.replaceAll(' ', '_').toLowerCase() === parameter);
  if (known) {
    shapes.push(across('y', { type: 'rect', y0: known.mean - 1.96 * known.scatter, y1: known.mean + 1.96 * known.scatter, fillcolor: shade(COLOURS.normal, 0.16), line: { width: 0 }, layer: 'below' }),
      across('y', { type: 'line', y0: known.mean, y1: known.mean, line: { color: COLOURS.normal, width: 1.5, dash: 'dash' } }));
  }
  return points.length ? banded(points.map((one) => ms(one.t_ns)), points.map((one) => one.value), points.map((one) => one.ci95?.[0] ?? null), points.map((one) => one.ci95?.[1] ?? null), words(parameter), COLOURS.now) : [];
}

/** A line through every panel with a word at its top. */
function mark(at, text, colour, dash, top) {
  return [{ type: 'line', x0: ms(at), x1: ms(at), yref: 'paper', y0: 0, y1: 1, line: { color: colour, width: 1.2, dash } },
    { x: ms(at), yref: 'paper', y: 1, yshift: top, yanchor: 'bottom', xanchor: 'left', text, showarrow: false, font: { size: 11 } }];
}

export function timeFigure({ parameter, curves, history, watch, alerts, events }) {
  const shapes = [], t = watch.t_ns.map(ms);
  const data = numberPanel(parameter, curves, history, shapes);
  Object.entries(watch.charts).forEach(([name, chart], i) => data.push({
    type: 'scatter', mode: 'lines', x: t, y: chart.up.map((up, k) => (up === null ? null : Math.max(up, chart.down[k]))), name, yaxis: 'y2',
    line: { color: LIST[i % LIST.length], width: 1.6, dash: DASHES[i % DASHES.length] },
  }));
  shapes.push(across('y2', { type: 'line', y0: 1, y1: 1, line: { color: COLOURS.now, width: 1.5, dash: 'dash' } }));
  const shown = Object.keys(CONDITIONS).find((name) => watch.conditions[name]?.some((one) => one !== null));
  if (shown) data.push({ type: 'scatter', mode: 'lines', x: t, y: watch.conditions[shown], name: CONDITIONS[shown][0], yaxis: 'y3', line: { color: COLOURS.third, width: 1.4 } });
  for (const [name, colour] of Object.entries(VERDICTS)) {
    const mine = watch.verdicts.filter((one) => one.verdict === name);
    if (mine.length) data.push({ type: 'bar', x: mine.map((one) => ms(one.t_ns)), y: mine.map((one) => one.windows), name: words(name), yaxis: 'y4', marker: { color: colour } });
  }
  const marks = [...alerts.map((one) => mark(one.at_ns, `▲ ${words(one.kind)}`, COLOURS.now, 'dot', 22)),
    ...events.map((one) => mark(one.at_ns, `⚒ ${one.text.length > 24 ? `${one.text.slice(0, 23)}…` : one.text}`, COLOURS.third, 'dash', 38))];
  const [name, suffix] = CONDITIONS[shown] ?? ['operating point', ''];
  const speed = unit(curves?.speed_unit ?? 'm/s');
  const conditionUnit = shown === 'mean_speed' ? speed : shown === 'travel' ? speed.replace('/s', '') : suffix;
  const series = history.series[parameter];
  const layout = {
    height: 760, barmode: 'stack', hovermode: 'x unified', margin: { l: 52, r: 12, t: 66, b: 36 }, showlegend: false,
    shapes: [...shapes, ...marks.map((one) => one[0])],
    annotations: [heading(0, `<b>${words(parameter)}</b> [${unit(series?.unit ?? '1')}]`), heading(1, '<b>charts</b>, share of the alarm threshold (dashed)'),
      heading(2, `<b>${name}</b>${conditionUnit ? ` [${conditionUnit}]` : ''}`), heading(3, '<b>windows</b> by verdict'), ...marks.map((one) => one[1])],
    xaxis: { type: 'date', anchor: 'y4' }, yaxis: { domain: PANELS[0] }, yaxis2: { domain: PANELS[1], tickformat: '.0%', rangemode: 'tozero' },
    yaxis3: { domain: PANELS[2] }, yaxis4: { domain: PANELS[3], rangemode: 'tozero', nticks: 3 },
  };
  return { data, layout };
}
