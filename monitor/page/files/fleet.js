// The fleet, the most urgent axis first.
import { about, alertLink, badge, calmly, count, el, empty, follow, get, linkTo, main, meter, moment, percent, problem, quantity, sparkline, words } from './common.js';

// views have addresses of their own, not fragments: who types one is led there, or told that nothing is there
if (location.hash.startsWith('#/')) location.replace(location.hash.slice(1));

const COLUMNS = ['axis', 'how it is', 'Coulomb friction', '>change', '30 days', 'towards an alarm', 'latest sample (UTC)', '>missing'];
const asked = new URLSearchParams(location.search);
let fleet = [];
let wanted = asked.get('show') ?? '';
let sought = asked.get('q') ?? '';

const chips = el('div', { class: 'chips', role: 'group', 'aria-label': 'Show only' });
const search = el('input', { id: 'search', type: 'search', placeholder: 'Search axes  /', 'aria-label': 'Search axes', value: sought });
const body = el('tbody');
const total = el('p', { class: 'soft', role: 'status' });
const list = el('div', { class: 'wide' }, el('table', { class: 'fleet cards' },
  el('thead', {}, el('tr', {}, COLUMNS.map((one) => el('th', { scope: 'col', class: one.startsWith('>') ? 'n' : null }, one.replace('>', ''))))), body));

search.addEventListener('input', () => { sought = search.value; remember(); draw(); });

function remember() {
  const query = new URLSearchParams();
  if (wanted) query.set('show', wanted);
  if (sought) query.set('q', sought);
  history.replaceState(null, '', query.size ? `?${query}` : location.pathname);
}

function row(one) {
  const alarms = one.alarms.map((alarm) => el('a', { class: 'why', href: alertLink(one.axis, alarm.kind), title: alarm.text ?? '' }, words(alarm.kind)));
  const cells = [
    el('a', { class: 'row', href: linkTo(one.axis) }, one.axis),
    [badge(one.urgency.level, one.urgency.word), alarms.length ? [' ', alarms] : null],
    one.friction ? quantity(one.friction.value, one.friction.ci95, one.friction.unit) : el('span', { class: 'soft' }, 'nothing identified yet'),
    one.change === null ? '–' : percent(one.change, 1),
    sparkline(one.trend) ?? '',
    one.height === null ? el('span', { class: 'soft' }, one.listed ? `learning: ${one.baseline.windows} windows` : 'not listed') : meter(one.height),
    moment(one.last_sample),
    one.missing ? count(one.missing) : '0',
  ];
  return el('tr', { class: `u${one.urgency.level}`, 'data-axis': one.axis }, cells.map((cell, i) => el('td', {
    class: COLUMNS[i].startsWith('>') ? 'n' : null, 'data-label': COLUMNS[i].replace('>', ''),
  }, el('div', {}, cell))));
}

function draw() {
  const groups = new Map();
  for (const one of fleet) groups.set(one.urgency.word, { level: one.urgency.level, n: (groups.get(one.urgency.word)?.n ?? 0) + 1 });
  const buttons = [['', { n: fleet.length }], ...groups].map(([word, group]) => el('button', {
    type: 'button', class: word === wanted ? 'chosen' : '', 'aria-pressed': String(word === wanted),
    onclick: () => { wanted = word; remember(); draw(); },
  }, word ? badge(group.level, word) : 'all', ` ${count(group.n)}`));
  chips.replaceChildren(...buttons);
  const focused = document.activeElement?.closest?.('tr')?.dataset.axis;
  const text = sought.trim().toLowerCase();
  const shown = fleet.filter((one) => (!wanted || one.urgency.word === wanted) && (!text || one.axis.toLowerCase().includes(text)));
  body.replaceChildren(...shown.map(row));
  if (focused) body.querySelector(`tr[data-axis="${CSS.escape(focused)}"] a.row`)?.focus({ preventScroll: true });
  total.textContent = shown.length === fleet.length ? '' : `${count(shown.length)} of ${count(fleet.length)} axes`;
  list.hidden = !shown.length;
  if (!shown.length && fleet.length) total.textContent = 'No axis matches. Clear the search, or show all.';
}

async function load(fresh) {
  try {
    fleet = (await get('/fleet', { fresh })).axes;
  } catch (error) {
    main.replaceChildren(problem(error));
    return;
  }
  const standing = fleet.filter((one) => one.urgency.level <= 1).length;
  document.title = `${standing ? `(${standing}) ` : ''}Fleet · tribowatch`;
  if (!fleet.length) {
    main.replaceChildren(el('h1', {}, 'Fleet'), empty('No axis yet', 'The daemon runs, but no axis is listed in its configuration and none has sent a sample.',
      ['List one: write an axis file with ', el('code', {}, 'tribowatch axes init'), ', name it in an ', el('code', {}, '[[axis]]'), ' section, start the daemon again.'],
      ['Or let a simulated one stream: ', el('code', {}, 'tribowatch simulate --publish --connect ENDPOINT')]));
    return;
  }
  if (!list.isConnected) main.replaceChildren(el('h1', {}, 'Fleet ', el('small', {}, about.site)), el('div', { class: 'tools' }, chips, search), total, list);
  draw();
  main.dataset.drawn = 'yes';
}

await load(false);
const again = calmly(() => load(true), 1500);
follow(again, again);
