// One diagnosis: the verdict, what is left out and how big it is, where it shows, the proof on unseen data, what else fits.
import { capital, el, figures, follow, get, linkTo, main, moment, number, problem, put, quantity, table, unit, words } from './common.js';
import { promoteButton } from './commands.js';
import { draw, place } from './charts.js';

const [axis, numberText] = location.pathname.split('/').slice(2).map(decodeURIComponent);
const HEADLINES = {
  no_mismatch: 'Nothing is missing from the model that these windows could show', unexplained: 'Something is left that no effect of the catalogue explains',
  insufficient_data: 'These windows cannot tell',
};

function headline(found) {
  const names = (found.effects ?? []).map((one) => words(one.name)).join(' and ');
  return names ? `The model leaves out: ${names}` : HEADLINES[found.verdict] ?? words(found.verdict);
}

const COORDINATES = { position: 'm', velocity: 'm/s', time: 's', acceleration: 'm/s²', torque: 'N·m', frequency: 'Hz', motor_angle: 'rad', pulley_angle: 'rad' };

function facts(found) {
  const { fit, location: where, remaining_force: rest, alternatives = [] } = found;
  const before = fit?.baseline?.held_out, after = fit?.extended?.held_out;
  return figures(
    before && after ? [`${number((100 * after) / before, 2)} %`, 'of the squared one-second error on unseen data remains'] : null,
    rest ? [`${number(rest.value, 2)} ${unit(rest.unit)}`, 'force that stays unexplained'] : null,
    where ? [where.coordinate === 'direction' ? 'both directions' : `${number(where.interval[0], 3)} to ${number(where.interval[1], 3)} ${COORDINATES[where.coordinate] ?? ''}`, `where it shows: ${words(where.coordinate)}`] : null,
    found.effects?.length ? [String(Math.max(alternatives.length - 1, 0)), 'other explanations these windows cannot rule out'] : null,
  );
}

function effects(found) {
  const rows = (found.effects ?? []).flatMap((effect) => Object.entries(effect.parameters).map(([name, one], i) => [
    i ? '' : words(effect.name), i ? '' : `${(100 * effect.share).toFixed(0)} %`, words(name), ...quantityCells(one),
  ]));
  return rows.length ? [el('h2', {}, 'What is left out, and how big it is'), table(['effect', '>share of the residual', 'parameter', '>value', '95 % interval'], rows)] : null;
}

function quantityCells(one) {
  const [value, space, unitText, interval] = quantity(one.value, one.ci95, one.unit);
  return [[value, space, unitText], interval ? interval.textContent.trim() : 'not identifiable'];
}

function proof(found) {
  if (!found.fit?.baseline) return null;
  const error = (model, part) => (found.force_error?.[model]?.[part] === undefined ? '–' : `${number(found.force_error[model][part], 3)} %`);
  const rows = Object.entries(found.fit).filter(([, one]) => one).map(([model, one]) => [words(model), number(one.train, 3), number(one.held_out, 3), error(model, 'train'), error(model, 'held_out')]);
  return [el('h2', {}, 'Proof: data the fit has not seen'),
    el('p', {}, `Free runs of ${found.run_length ?? 1} s from the measured state; criterion: squared error over the variance of the position. Force error: residual over drive force.`),
    table(['model', '>fitted [1]', '>unseen [1]', '>force error, fitted', '>unseen'], rows)];
}

function rivals(found) {
  const others = (found.alternatives ?? []).slice(1);
  const changes = (found.changes ?? []).map((one) => [words(one.parameter), number(one.before, 4), number(one.after, 4), `${number(one.ci95[0], 3)} to ${number(one.ci95[1], 3)}`, unit(one.unit)]);
  const hidden = Object.entries(found.detectable ?? {}).map(([name, one]) => [words(name), number(one.value, 3), unit(one.unit), number(one.force_rms, 2)]);
  return [
    others.length ? [el('h2', {}, 'What these windows cannot tell it from'), el('ul', {}, others.map((names) => el('li', {}, names.map(words).join(' with '))))] : null,
    found.next_experiment ? [el('h2', {}, 'Next experiment'), el('p', {}, `To settle the rest: ${found.next_experiment}.`)] : null,
    changes.length ? [el('h2', {}, 'Changed'), table(['parameter', '>before', '>now', 'difference, 95 %', 'unit'], changes)] : null,
    hidden.length ? [el('h2', {}, 'What could still hide'), table(['effect', '>seen from', 'unit', '>force, rms [N]'], hidden)] : null,
  ];
}

function charts(found) {
  const drawn = (found.figures ?? []).map((one) => ({ ...one, place: place(one.figure.layout.height) }));
  if (!drawn.length) return { section: null, start: () => {} };
  const section = [el('h2', {}, 'Evidence: the force the model does not explain'), drawn.map((one) => [el('h3', {}, one.title), one.note ? el('p', { class: 'soft' }, one.note) : null, one.place])];
  return { section, start: () => drawn.forEach((one) => draw(one.place, one.figure, one.title)) };
}

async function load() {
  try {
    const one = await get(`${linkTo(axis)}/diagnoses/${encodeURIComponent(numberText)}`);
    const found = { ...one.result, figures: one.figures };
    const evidence = charts(found);
    put(main,
      el('p', { class: 'crumbs' }, el('a', { href: '/' }, 'Fleet'), ' / ', el('a', { href: linkTo(axis) }, axis), ' / ', el('a', { href: `/diagnoses/${encodeURIComponent(axis)}` }, 'diagnoses'), ` / ${numberText}`),
      el('h1', {}, headline(found)), el('p', { class: 'lead' }, capital(words(found.explanation ?? ''))), facts(found), effects(found), evidence.section, proof(found), rivals(found),
      el('p', { class: 'soft' }, `Windows from ${moment(one.from)} to ${moment(one.to)} UTC, ${one.windows.length} of them; seed ${one.seed}, tribowatch ${one.software}, ${number(one.seconds, 2)} s.`),
      found.effects?.length ? el('p', {}, 'To make it part of this axis’ model: ', el('code', {}, `tribowatch axes promote ${axis} ${found.effects[0].name}`)) : null,
      (found.effects ?? []).map((effect) => promoteButton(axis, effect.name, () => {})),
    );
    main.dataset.drawn = 'yes';
    evidence.start();
  } catch (error) { main.replaceChildren(problem(error)); }
}

await load();
follow(() => {});
