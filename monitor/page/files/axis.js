// One axis: its numbers, its friction against speed, and everything that happened to it on one time axis.
import { alertLink, badge, calmly, count, el, empty, figures, follow, get, linkTo, main, meter, moment, number, percent, problem, put, quantity, sparkline, stateBadge, table, unit, words } from './common.js';
import { axisButtons } from './commands.js';
import { COLOURS, banded, draw, place } from './charts.js';
import { legendOf, timeFigure } from './axis_time.js';

const axis = decodeURIComponent(location.pathname.split('/')[2]);
const root = linkTo(axis);
const SPANS = [['7d', '7 days'], ['30d', '30 days'], ['90d', '90 days'], ['1y', 'a year'], ['', 'all']];
const asked = new URLSearchParams(location.search);
let since = asked.get('since') ?? '';
let parameter = asked.get('parameter') ?? '';
let summary, curves;

const parts = { head: el('div'), numbers: el('section'), watched: el('section'), curve: el('section'), time: el('section'), data: el('section'), notes: el('section') };
const curvePlot = place(340), timePlot = place(760);
const legend = el('div');
const rangeButtons = el('div', { class: 'chips', role: 'group', 'aria-label': 'Range of time' });
const choice = el('select', { 'aria-label': 'Parameter drawn' });
choice.addEventListener('change', () => { parameter = choice.value; remember(); loadTime(); });

function remember() {
  const query = new URLSearchParams();
  if (since) query.set('since', since);
  if (parameter) query.set('parameter', parameter);
  history.replaceState(null, '', query.size ? `?${query}` : location.pathname);
}

// --- numbers ---------------------------------------------------------------------------------------------------

function head() {
  const learned = summary.baseline.complete;
  const heights = (summary.latest?.indicators ?? []).map((one) => [Math.max(one.sum_up, one.sum_down), one]);
  const highest = heights.sort((a, b) => b[0] - a[0])[0] ?? [null, null];
  const [height, leading] = heights.find(([share, one]) => !one.name.endsWith(' part') && share > 0.8 * highest[0]) ?? highest; // what people can picture
  const middle = (summary.latest?.indicators ?? []).find((one) => one.name === 'friction at mid speed');
  const friction = summary.latest?.parameters?.coulomb_force;
  const standing = Object.entries(summary.alarms);
  put(parts.head,
    el('p', { class: 'crumbs' }, el('a', { href: '/' }, 'Fleet'), ' / ', summary.axis),
    el('h1', {}, summary.axis, ' ', standing.length ? standing.map(([kind, state]) => el('a', { class: 'why', href: alertLink(axis, kind) }, words(kind), ' ', stateBadge(state, kind === 'jam' ? 'high' : 'medium')))
      : badge(learned ? 8 : summary.listed ? 7 : 9, learned ? 'well' : summary.listed ? 'learning' : 'not listed')),
    summary.listed ? null : el('p', { class: 'note' }, 'This axis streams, but the configuration does not list it: its samples are counted, not identified. Write an axis file (tribowatch axes init) and name it in an [[axis]] section.'),
    figures(
      friction ? [[el('span', {}, number(friction.value, 4)), ' ', el('small', {}, unit(friction.unit))], 'Coulomb friction now'] : null,
      middle ? [percent(middle.value / middle.baseline - 1, 1), 'friction at mid speed against its baseline'] : null,
      height !== null ? [meter(height), `of the alarm threshold: ${leading.name}`] : null,
      [learned ? `${summary.baseline.windows} windows` : `${summary.baseline.windows} so far`, learned ? 'made the baseline' : 'towards a baseline'],
      [moment(summary.last_sample), 'latest sample (UTC)'],
    ),
  );
}

function numbers(trends) {
  if (!summary.latest) {
    const answers = Object.entries(summary.verdicts).map(([name, n]) => `${count(n)} ${words(name)}`).join(', ');
    put(parts.watched);
    put(parts.numbers, empty('Nothing identified yet', summary.windows ? `Windows so far: ${answers || `${summary.pending} waiting`}. A window teaches something when the axis moves far and changes its speed.`
      : summary.samples ? 'Samples arrive; the first window is not complete yet.' : 'No sample has arrived. Does the machine run, and its gateway? tribowatch doctor shows the links.'));
    return;
  }
  const rows = Object.entries(summary.latest.parameters).map(([name, one]) => [
    words(name), [el('span', { class: 'num' }, quantity(one.value, one.ci95, one.unit)[0]), ' ', unit(one.unit)],
    one.ci95 ? quantity(one.value, one.ci95, '')[3].textContent.trim() : one.identifiable === false ? 'not identifiable here' : '–',
    sparkline((trends?.[name]?.points ?? []).map((point) => point.value)) ?? '', one.at_bound ? 'at its bound' : '',
  ]);
  const watched = (summary.latest.indicators ?? []).map((one) => [
    one.name, ...(one.unit === '1' ? [percent(one.value, 1), percent(one.baseline, 1), percent(one.value - one.baseline, 1)] // a share already
      : [[el('span', { class: 'num' }, number(one.value, 4)), ' ', unit(one.unit)], number(one.baseline, 4), one.baseline ? percent(one.value / one.baseline - 1, 1) : '–']),
    `${number(one.deviation, 2)} σ`, meter(Math.max(one.sum_up, one.sum_down)), sparkline((trends?.[one.name.replaceAll(' ', '_').toLowerCase()]?.points ?? []).map((point) => point.value)) ?? '',
  ]);
  put(parts.numbers,
    el('h2', {}, 'Friction now'), table(['parameter', '>value', '95 % interval', '~trend', '~'], rows),
    el('p', { class: 'soft' }, `From the window that ended ${moment(summary.latest.window_end)} UTC.`),
  );
  put(parts.watched, watched.length ? [el('h2', {}, 'What is watched'), table(['number', '>now', '>~baseline', '>change', '>~deviation', 'towards an alarm', '~trend'], watched),
      el('p', { class: 'soft' }, 'σ: scatter of this number from window to window while the axis was healthy. Towards an alarm: how much of the evidence that it takes has come together. An alarm that stands lasts while the change is above 60 % of the smallest one worth telling, so it may stand beside a share below 100 %.')] : '');
}

function dataQuality(history) {
  const verdicts = Object.entries(summary.verdicts).map(([name, n]) => [words(name), count(n)]);
  const gaps = (history?.gaps ?? []).slice(-8).reverse().map((one) => [words(one.kind), moment(one.from), moment(one.to), count(one.missing)]);
  const refused = Object.entries(summary.rejected).map(([why, n]) => [words(why), count(n)]);
  put(parts.data,
    el('h2', {}, 'Data quality'),
    figures([count(summary.samples), 'samples received'], [count(summary.missing), 'missing', summary.missing ? 'watch' : ''], [count(summary.gaps), 'gaps'], [count(summary.windows), 'windows'], [count(summary.pending), 'waiting for an answer']),
    el('div', { class: 'columns' }, verdicts.length ? table(['windows by verdict', '>number'], verdicts) : '', refused.length ? table(['refused, by reason', '>number'], refused) : '',
      gaps.length ? table(['latest gaps', 'from', 'to', '>missing'], gaps) : ''),
  );
}

// --- charts ------------------------------------------------------------------------------------------------------

function drawCurve() {
  const { now, baseline, force_unit: force, speed_unit: speed } = curves;
  if (!now) { put(parts.curve,); return; }
  const data = [];
  if (baseline) data.push(...banded(baseline.speeds, baseline.values, baseline.low, baseline.high, `healthy (${baseline.windows} windows, 95 % of them in the band)`, COLOURS.normal));
  const seen = now.speeds.filter((v) => v <= now.fastest * 1.0001).length || now.speeds.length;
  const cut = (list) => list.slice(0, seen);
  data.push(...banded(cut(now.speeds), cut(now.values), cut(now.low), cut(now.high), 'now, with 95 % interval', COLOURS.now));
  if (!curvePlot.isConnected) put(parts.curve,el('h2', {}, 'Friction against speed'), curvePlot);
  draw(curvePlot, { data, layout: { height: 340, xaxis: { title: { text: `speed [${unit(speed)}]` }, rangemode: 'tozero' }, yaxis: { title: { text: `friction [${unit(force)}]` }, rangemode: 'tozero' } } },
    `friction of ${axis} against speed, now and when it was healthy`);
}

const query = (more = {}) => {
  const words_ = new URLSearchParams({ ...(since ? { since } : {}), ...more });
  return words_.size ? `?${words_}` : '';
};

async function loadTime() {
  rangeButtons.replaceChildren(...SPANS.map(([value, text]) => el('button', { type: 'button', class: value === since ? 'chosen' : '', 'aria-pressed': String(value === since), onclick: () => { since = value; remember(); loadTime(); } }, text)));
  if (!summary.latest) { put(parts.time,); return; }
  try {
    const small = await get(`${root}/history${query({ points: 40 })}`);
    const names = Object.keys(small.series);
    if (!names.includes(parameter)) parameter = names.includes('friction_at_mid_speed') ? 'friction_at_mid_speed' : names.includes('coulomb_force') ? 'coulomb_force' : names[0];
    choice.replaceChildren(...names.map((name) => el('option', { value: name, selected: name === parameter }, words(name))));
    numbers(small.series);
    dataQuality(small);
    const [history, watch, told, events] = await Promise.all([get(`${root}/history${query({ parameter })}`), get(`${root}/watch${query()}`), get(`${root}/alerts`), get(`${root}/events`).catch(() => ({ events: [] }))]);
    const raised = told.transitions.filter((one) => one.transition.after === 'unacknowledged').map((one) => ({ kind: one.kind, at_ns: one.transition.at_ns }));
    const first = watch.t_ns[0] ?? 0, last = watch.t_ns.at(-1) ?? 0;
    const inside = (one) => one.at_ns >= first && one.at_ns <= last;
    if (!timePlot.isConnected) {
      put(parts.time,el('h2', {}, 'What happened'), el('div', { class: 'tools' }, rangeButtons, choice), timePlot, legend,
        el('p', { class: 'soft' }, 'From above: the chosen number with its 95 % interval (dashed: baseline, band: where a healthy window falls); the charts towards their alarm threshold; the operating point; windows by verdict. ▲ an alarm was raised, ⚒ maintenance.'));
    }
    put(legend, legendOf(watch));
    await draw(timePlot, timeFigure({ parameter, curves, history, watch, alerts: raised.filter(inside), events: events.events.filter(inside) }), `${words(parameter)} of ${axis} over time, with charts, operating point and windows`);
    notes(told, events.events);
  } catch (error) { put(parts.time,problem(error)); }
}

function notes(told, events) {
  const alerts = told.alerts.map((one) => [el('a', { class: 'row', href: alertLink(axis, one.kind) }, words(one.kind)), stateBadge(one.state, one.priority), moment(one.since), one.text]);
  const did = events.slice().reverse().map((one) => [moment(one.at), words(one.kind), one.text, one.author, one.new_baseline ? 'learned anew' : '']);
  put(parts.notes,
    el('h2', {}, 'Alerts'), alerts.length ? table(['kind', 'state', 'since (UTC)', 'finding'], alerts, { class: 'cards' }) : el('p', { class: 'soft' }, 'None was ever raised for this axis.'),
    el('p', {}, el('a', { href: `/diagnoses/${encodeURIComponent(axis)}` }, 'Diagnoses of this axis')),
    el('h2', {}, 'Maintenance'), did.length ? table(['when (UTC)', 'kind', 'what', 'who', ''], did, { class: 'cards' }) : el('p', { class: 'soft' }, 'Nothing is noted.'),
    axisButtons(axis, again) ?? '',
  );
}

async function load(fresh) {
  try {
    summary = await get(root, { fresh });
    head();
    if (!fresh) { numbers(null); dataQuality(null); put(main, parts.head, el('div', { class: 'pair' }, parts.numbers, parts.curve), parts.time, parts.watched, parts.data, parts.notes); }
    main.dataset.drawn = 'yes';
    curves = await get(`${root}/curves`);
    drawCurve();
    await loadTime();
    main.dataset.complete = 'yes';
  } catch (error) { main.replaceChildren(problem(error)); }
}

const again = calmly(() => load(true), 2500);
await load(false);
follow((axes) => { if (axes === null || axes[axis]) again(); }, (change) => { if (change.axis === axis) again(); });
