// Every alarm that was ever raised, the standing ones first.
import { alertLink, calmly, cause, count, el, empty, follow, get, linkTo, main, moment, problem, stateBadge, table, words } from './common.js';

const asked = new URLSearchParams(location.search);
let all = asked.get('all') === 'yes';

function row(one) {
  return { cells: [el('a', { class: 'row', href: alertLink(one.axis, one.kind) }, words(one.kind)), el('a', { href: linkTo(one.axis) }, one.axis), stateBadge(one.state, one.priority), one.priority, moment(one.since), one.text], attributes: { 'data-alert': one.id } };
}

function draw(found) {
  const order = { unacknowledged: 0, returned_unacknowledged: 1, acknowledged: 2, shelved: 3, suppressed: 4, out_of_service: 5, normal: 6 };
  const rank = { high: 0, medium: 1, low: 2 };
  const alerts = [...found.alerts].sort((a, b) => order[a.state] - order[b.state] || rank[a.priority] - rank[b.priority] || b.since_ns - a.since_ns);
  const standing = alerts.filter((one) => one.state !== 'normal');
  const shown = all ? alerts : standing;
  const columns = ['kind', 'axis', 'state', 'priority', 'since (UTC)', 'finding'];
  const changes = found.transitions.slice(-50).reverse().map((one) => [moment(one.transition.at), el('a', { href: linkTo(one.axis) }, one.axis), el('a', { href: alertLink(one.axis, one.kind) }, words(one.kind)),
    `${words(one.transition.before)} → ${words(one.transition.after)}`, cause(one.transition.event), one.transition.author]);
  document.title = `${standing.length ? `(${standing.length}) ` : ''}Alerts · tribowatch`;
  main.replaceChildren(
    el('h1', {}, 'Alerts'),
    el('div', { class: 'chips' }, [[false, `standing ${count(standing.length)}`], [true, `all ${count(alerts.length)}`]].map(([value, text]) => el('button', {
      type: 'button', class: value === all ? 'chosen' : '', 'aria-pressed': String(value === all), onclick: () => { all = value; history.replaceState(null, '', all ? '?all=yes' : location.pathname); draw(found); },
    }, text))),
    shown.length ? table(columns, shown.map(row), { class: 'cards alerts' })
      : empty(alerts.length ? 'Nothing stands' : 'No alarm was ever raised', alerts.length ? 'Every alarm is back to normal.' : 'The watch learns each axis first; what is raised later stands here, with its evidence and what to do.'),
    el('h2', {}, 'Latest changes'), changes.length ? table(['when (UTC)', 'axis', 'kind', 'change', 'by', 'who'], changes, { class: 'cards' }) : el('p', { class: 'soft' }, 'None yet.'),
  );
  main.dataset.drawn = 'yes';
}

async function load(fresh) {
  try { draw(await get('/alerts', { fresh })); } catch (error) { main.replaceChildren(problem(error)); }
}

const again = calmly(() => load(true), 1500);
await load(false);
follow((axes) => { if (axes === null || Object.values(axes).some((what) => what.includes('alerts'))) again(); }, again);
