// One alarm: what was found and why we think so, what else it could be, what to do, and the buttons for it.
import { calmly, capital, cause, el, empty, figures, follow, get, linkTo, main, moment, momentOf, number, percent, problem, put, stateBadge, table, unit, words } from './common.js';
import { alarmButtons } from './commands.js';
import { COLOURS, banded, draw, place } from './charts.js';

const [axis, kind] = location.pathname.split('/').slice(2).map(decodeURIComponent);
const plot = place(340);
let bundles = []; // of evidence, kept for this alarm
const parts = { head: el('div'), figures: el('div'), chart: el('section'), evidence: el('section'), audit: el('section') };

// what is not a number worth a row of its own: drawn, or said in the text
const DRAWN = new Set(['speeds', 'baseline', 'now_low', 'remaining', 'cause', 'size', 'indicator_unit', 'indicator_baseline', 'indicator_now', 'indicator_error', 'now_high', 'rivals', 'shapes', 'relative_ci95', 'unit', 'speed_unit']);

function rivals(evidence) {
  const found = Object.entries(evidence.rivals ?? {}).sort((a, b) => b[1] - a[1]);
  if (!found.length) return null;
  return [el('h2', {}, 'What it could be'), el('ul', { class: 'bars' }, found.map(([name, score]) => el('li', {}, el('span', {}, words(name)), el('progress', { max: 1, value: score }), el('span', { class: 'num' }, `${(100 * Math.max(score, 0)).toFixed(0)} %`))))];
}

// names of the evidence that want more words than their own
const LABELS = {
  indicator: 'number that says it most clearly', level: 'evidence, of what is needed', averaged: 'windows averaged', baseline_scatter: 'scatter of a healthy window',
  baseline_error: 'how well the baseline is known', corrected_for: 'corrected for', min_change: 'smallest change that is told', hop_stretched: 'times fewer windows than usual', direction: 'its direction', height: 'how far it has come, of its threshold', score: 'weight of this class against its rivals',
  shape: 'shape of the change over speed', since_ns: 'since (UTC)', until_ns: 'until (UTC)', baseline_windows: 'windows of the baseline', baseline_days: 'days it spans', before: 'before', now: 'now',
  false_alarms_per_axis_year: 'false alarms allowed per axis and year', silent_ns: 'silent for', last_ns: 'latest sample (UTC)', reason: 'reason', deviation: 'deviation in scatters',
};
const SHARES = new Set(['height', 'score', 'relative', 'baseline_scatter', 'baseline_error', 'min_change']);

/** The number behind the alarm with where it was and is. */
function indicator(known) {
  if (known.indicator_now === undefined) return known.indicator;
  if (known.indicator.endsWith(' part')) return `${known.indicator}: ${percent(known.indicator_now - known.indicator_baseline, 1)} ± ${number(100 * known.indicator_error, 2)} %`;
  return `${known.indicator}: ${number(known.indicator_baseline, 4)} → ${number(known.indicator_now, 4)} ± ${number(known.indicator_error, 2)} ${unit(known.indicator_unit)}`;
}

/** When the limit is reached at this pace, or why nobody can tell. */
function remaining(known) {
  const left = known.remaining;
  if (!left) return null;
  if (left.refused) return el('p', { class: 'soft' }, `No projection: ${left.refused}.`);
  return el('p', {}, `At this pace friction is ${number(100 * left.limit, 2)} % above its baseline in `, el('span', { class: 'num' }, `${number(left.days, 2)} days`), el('span', { class: 'ci' }, ` 95 %: ${number(left.days_low, 2)} to ${number(left.days_high, 2)}`), '.');
}

function labelled(name, one, known) {
  const shown = SHARES.has(name) && typeof one === 'number' ? `${number(100 * one, 2)} %` : name === 'indicator' ? indicator(known) : value(name, one);
  const unitOf = ['before', 'now'].includes(name) && typeof one === 'number' ? ` ${unit(known.unit ?? '')}` : name === 'speed' ? ` ${unit(known.speed_unit ?? '')}` : '';
  return [LABELS[name] ?? words(name), `${shown}${unitOf}`];
}

function value(name, one) {
  if (name.endsWith('_ns')) return name.startsWith('silent') ? `${number(one / 1e9, 3)} s` : momentOf(one);
  if (typeof one === 'boolean') return one ? 'yes' : 'no';
  if (typeof one === 'number') return Number.isInteger(one) && Math.abs(one) < 1e6 ? String(one) : number(one, 4);
  if (Array.isArray(one)) return one.map((each) => (typeof each === 'number' ? number(each, 3) : words(each))).join(' to ');
  return one !== null && typeof one === 'object' ? Object.entries(one).map(([key, each]) => `${words(key)} ${value(key, each)}`).join(', ') : words(one);
}

function evidence(alert) {
  const known = alert.evidence ?? {};
  const rows = Object.entries(known).filter(([name, one]) => !DRAWN.has(name) && one !== null && !(Array.isArray(one) && one.length > 3) && !(known.speeds && ['relative', 'windows'].includes(name))).map(([name, one]) => labelled(name, one, known));
  const middle = known.speeds ? Math.floor(known.speeds.length / 2) : null;
  const changed = known.relative !== undefined && known.relative !== null;
  put(parts.figures, changed ? figures(
    [percent(known.relative, 1), known.relative_ci95 ? `95 % interval ${percent(known.relative_ci95[0], 1)} to ${percent(known.relative_ci95[1], 1)}` : 'change'],
    middle !== null ? [`${number(known.baseline[middle], 4)} ${unit(known.unit)}`, `friction at ${number(known.speeds[middle], 2)} ${unit(known.speed_unit)} when healthy`] : null,
    middle !== null ? [`${number(known.now[middle], 4)} ${unit(known.unit)}`, 'friction there when last judged'] : null,
    known.windows !== undefined ? [String(known.windows), 'windows say so'] : null,
  ) : null);
  put(parts.evidence, remaining(known), rivals(known), rows.length ? [el('h2', {}, 'Evidence in numbers'), table(['what', 'value'], rows)] : null);
  if (known.speeds && known.now) {
    if (!plot.isConnected) put(parts.chart,el('h2', {}, 'Friction against speed'), plot);
    draw(plot, { data: [
      { type: 'scatter', mode: 'lines+markers', x: known.speeds, y: known.baseline, name: 'when healthy', line: { color: COLOURS.normal, width: 2 } },
      ...banded(known.speeds, known.now, known.now_low ?? [], known.now_high ?? [], 'when this alarm was last judged, with 95 % interval', COLOURS.now),
    ], layout: { height: 340, xaxis: { title: { text: `speed [${unit(known.speed_unit)}]` } }, yaxis: { title: { text: `friction [${unit(known.unit)}]` } } } }, 'friction against speed, when healthy and at this alarm');
  } else put(parts.chart,);
}

function render(found) {
  const alert = found.alerts.find((one) => one.kind === kind);
  if (!alert) {
    main.replaceChildren(el('p', { class: 'crumbs' }, el('a', { href: '/alerts' }, 'Alerts'), ' / ', axis), empty(`No ${words(kind)} alarm of ${axis}`, 'It was never raised.', el('a', { href: linkTo(axis) }, `To ${axis}`)));
    main.dataset.drawn = 'yes';
    return;
  }
  put(parts.head,
    el('p', { class: 'crumbs' }, el('a', { href: '/alerts' }, 'Alerts'), ' / ', el('a', { href: linkTo(axis) }, axis), ' / ', words(kind)),
    el('h1', {}, `${capital(words(kind))} `, el('span', { id: 'state' }, stateBadge(alert.state, alert.priority))),
    el('p', { class: 'lead' }, alert.text),
    el('dl', { class: 'advice' },
      el('dt', {}, 'Do'), el('dd', { class: 'do' }, alert.recommended_action), el('dt', {}, 'Likely cause'), el('dd', {}, alert.likely_cause),
      el('dt', {}, 'Otherwise'), el('dd', {}, alert.consequence), ...(alert.time_to_act ? [el('dt', {}, 'Time to act'), el('dd', {}, value('', alert.time_to_act))] : []),
      el('dt', {}, 'Since'), el('dd', {}, `${moment(alert.since)} UTC, priority ${alert.priority}`)),
    alarmButtons(alert, again),
  );
  const changes = found.transitions.filter((one) => one.kind === kind).reverse().map((one) => [moment(one.transition.at), `${words(one.transition.before)} → ${words(one.transition.after)}`, cause(one.transition.event), one.transition.author]);
  put(parts.audit,el('h2', {}, 'Audit'), table(['when (UTC)', 'change', 'by', 'who'], changes, { class: 'cards' }), el('p', {}, el('a', { href: `/api/v1${linkTo(axis)}/alerts` }, 'The same as JSON'), bundles.length ? [' · Evidence to send: ', bundles.slice(0, 3).map((one) => [el('a', { href: `/api/v1/evidence/${one.number}` }, `${moment(one.at)}, number ${one.number}`), ' '])] : null));
  if (!parts.head.isConnected) main.replaceChildren(...Object.values(parts));
  evidence(alert);
  main.dataset.drawn = 'yes';
}

async function load(fresh) {
  try {
    const found = await get(`${linkTo(axis)}/alerts`, { fresh });
    render(found);
    bundles = (await get(`${linkTo(axis)}/evidence`)).evidence.filter((one) => one.kind === kind);
    if (bundles.length) render(found);
  } catch (error) { main.replaceChildren(problem(error)); }
}

const again = calmly(() => load(true), 1000);
await load(false);
follow((axes) => { if (axes === null || axes[axis]?.includes('alerts')) again(); }, (change) => { if (change.axis === axis) again(); });
