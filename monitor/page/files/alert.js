// One alarm: what was found and why we think so, what else it could be, what to do, and the buttons for it.
import { calmly, el, empty, figures, follow, get, linkTo, main, moment, momentOf, number, percent, problem, stateBadge, table, unit, words } from './common.js';
import { alarmButtons } from './commands.js';
import { COLOURS, banded, draw, place } from './charts.js';

const [axis, kind] = location.pathname.split('/').slice(2).map(decodeURIComponent);
const plot = place(340);
const parts = { head: el('div'), chart: el('section'), evidence: el('section'), audit: el('section') };

// what is not a number worth a row of its own: drawn, or said in the text
const DRAWN = new Set(['speeds', 'baseline', 'now', 'now_low', 'now_high', 'rivals', 'shapes', 'relative_ci95', 'unit', 'speed_unit']);

function rivals(evidence) {
  const found = Object.entries(evidence.rivals ?? {}).sort((a, b) => b[1] - a[1]);
  if (!found.length) return null;
  return [el('h2', {}, 'What it could be'), el('ul', { class: 'bars' }, found.map(([name, score]) => el('li', {}, el('span', {}, words(name)), el('progress', { max: 1, value: score }), el('span', { class: 'num' }, `${(100 * score).toFixed(0)} %`))))];
}

function value(name, one) {
  if (name.endsWith('_ns')) return name.startsWith('silent') ? `${number(one / 1e9, 3)} s` : momentOf(one);
  if (typeof one === 'number') return number(one, 4);
  if (Array.isArray(one)) return one.map((each) => (typeof each === 'number' ? number(each, 3) : words(each))).join(' to ');
  return one !== null && typeof one === 'object' ? Object.entries(one).map(([key, each]) => `${words(key)} ${value(key, each)}`).join(', ') : words(one);
}

function evidence(alert) {
  const known = alert.evidence ?? {};
  const rows = Object.entries(known).filter(([name, one]) => !DRAWN.has(name) && one !== null).map(([name, one]) => [words(name.replace(/_ns$/, '')), value(name, one)]);
  const middle = known.speeds ? Math.floor(known.speeds.length / 2) : null;
  parts.evidence.replaceChildren(...[
    known.relative !== undefined && known.relative !== null ? figures(
      [percent(known.relative, 1), known.relative_ci95 ? `95 % interval ${percent(known.relative_ci95[0], 1)} to ${percent(known.relative_ci95[1], 1)}` : 'change'],
      middle !== null ? [`${number(known.baseline[middle], 4)} ${unit(known.unit)}`, `friction at ${number(known.speeds[middle], 3)} ${unit(known.speed_unit)} when healthy`] : null,
      middle !== null ? [`${number(known.now[middle], 4)} ${unit(known.unit)}`, 'friction there now'] : null,
      known.windows !== undefined ? [String(known.windows), 'windows say so'] : null,
    ) : null,
    rivals(known), rows.length ? [el('h2', {}, 'Evidence in numbers'), table(['what', 'value'], rows)] : null,
  ].flat(2).filter(Boolean));
  if (known.speeds && known.now) {
    if (!plot.isConnected) parts.chart.replaceChildren(el('h2', {}, 'Friction against speed'), plot);
    draw(plot, { data: [
      { type: 'scatter', mode: 'lines+markers', x: known.speeds, y: known.baseline, name: 'when healthy', line: { color: COLOURS.normal, width: 2 } },
      ...banded(known.speeds, known.now, known.now_low ?? [], known.now_high ?? [], 'when this alarm was last judged, with 95 % interval', COLOURS.now),
    ], layout: { height: 340, xaxis: { title: { text: `speed [${unit(known.speed_unit)}]` } }, yaxis: { title: { text: `friction [${unit(known.unit)}]` } } } }, 'friction against speed, when healthy and at this alarm');
  } else parts.chart.replaceChildren();
}

function render(found) {
  const alert = found.alerts.find((one) => one.kind === kind);
  if (!alert) {
    main.replaceChildren(el('p', { class: 'crumbs' }, el('a', { href: '/alerts' }, 'Alerts'), ' / ', axis), empty(`No ${words(kind)} alarm of ${axis}`, 'It was never raised.', el('a', { href: linkTo(axis) }, `To ${axis}`)));
    main.dataset.drawn = 'yes';
    return;
  }
  parts.head.replaceChildren(
    el('p', { class: 'crumbs' }, el('a', { href: '/alerts' }, 'Alerts'), ' / ', el('a', { href: linkTo(axis) }, axis), ' / ', words(kind)),
    el('h1', {}, `${words(kind)} `, el('span', { id: 'state' }, stateBadge(alert.state, alert.priority))),
    el('p', { class: 'lead' }, alert.text),
    el('dl', { class: 'advice' },
      el('dt', {}, 'Do'), el('dd', { class: 'do' }, alert.recommended_action), el('dt', {}, 'Likely cause'), el('dd', {}, alert.likely_cause),
      el('dt', {}, 'Otherwise'), el('dd', {}, alert.consequence), ...(alert.time_to_act ? [el('dt', {}, 'Time to act'), el('dd', {}, value('', alert.time_to_act))] : []),
      el('dt', {}, 'Since'), el('dd', {}, `${moment(alert.since)} UTC, priority ${alert.priority}`)),
    alarmButtons(alert, again),
  );
  const changes = found.transitions.filter((one) => one.kind === kind).reverse().map((one) => [moment(one.transition.at), `${words(one.transition.before)} → ${words(one.transition.after)}`, words(one.transition.event), one.transition.author]);
  parts.audit.replaceChildren(el('h2', {}, 'Audit'), table(['when (UTC)', 'change', 'by', 'who'], changes, { class: 'cards' }), el('p', {}, el('a', { href: `/api/v1${linkTo(axis)}/alerts` }, 'The same as JSON')));
  if (!parts.head.isConnected) main.replaceChildren(...Object.values(parts));
  evidence(alert);
  main.dataset.drawn = 'yes';
}

async function load(fresh) {
  try { render(await get(`${linkTo(axis)}/alerts`, { fresh })); } catch (error) { main.replaceChildren(problem(error)); }
}

const again = calmly(() => load(true), 1000);
await load(false);
follow((axes) => { if (axes === null || axes[axis]?.includes('alerts')) again(); }, (change) => { if (change.axis === axis) again(); });
