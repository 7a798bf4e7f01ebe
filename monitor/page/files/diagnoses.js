// The diagnoses of one axis: what the daemon found in its windows when its model no longer held.
import { calmly, el, empty, follow, get, linkTo, main, moment, problem, span, table, words } from './common.js';

const axis = decodeURIComponent(location.pathname.split('/')[2]);

function draw({ diagnoses }) {
  const rows = [...diagnoses].reverse().map((one) => [
    el('a', { class: 'row', href: `/diagnoses/${encodeURIComponent(axis)}/${one.number}` }, moment(one.at)), words(one.verdict),
    (one.result.effects ?? []).map((effect) => words(effect.name)).join(' and ') || '–', one.result.explanation ?? '', span(one.seconds),
  ]);
  main.replaceChildren(
    el('p', { class: 'crumbs' }, el('a', { href: '/' }, 'Fleet'), ' / ', el('a', { href: linkTo(axis) }, axis), ' / diagnoses'),
    el('h1', {}, `Diagnoses of ${axis}`),
    rows.length ? table(['when (UTC)', 'verdict', 'left out', 'in words', '>took'], rows, { class: 'cards' })
      : empty('None yet', 'The daemon diagnoses an axis when its model leaves more force unexplained than it used to.', ['Of recordings, at any time: ', el('code', {}, 'tribowatch diagnose --axis AXIS.toml --report report.html')]),
  );
  main.dataset.drawn = 'yes';
}

async function load(fresh) {
  try { draw(await get(`${linkTo(axis)}/diagnoses`, { fresh })); } catch (error) { main.replaceChildren(problem(error)); }
}

const again = calmly(() => load(true), 3000);
await load(false);
follow((axes) => { if (axes === null || axes[axis]) again(); });
