// How the daemon itself is doing: lag, gaps, workers, database.
import { bytes, calmly, count, el, figures, follow, get, linkTo, main, moment, number, problem, span, table, words } from './common.js';

function verdict(state) {
  const behind = state.inbox_blocks > 0.5 * state.inbox_limit;
  const full = state.disk && state.disk.free < 1e9;
  if (state.silence_seconds > 10) return ['problem', `The supervising thread has not come round for ${span(state.silence_seconds)}: the log says why.`];
  if (full) return ['problem', `Only ${bytes(state.disk.free)} are left where the history is kept.`];
  if (behind) return ['problem', 'Samples arrive faster than they are taken in: the inbox is more than half full.'];
  if (state.backlog_windows > 20 * state.workers.processes) return ['watch', 'Windows arrive faster than they are identified; they wait, none is lost. More workers or a longer hop help.'];
  return ['good', 'All parts of the daemon are at work.'];
}

function draw(state) {
  const [kind, text] = verdict(state);
  const streams = state.streams.map((one) => [
    el('a', { class: 'row', href: linkTo(one.axis) }, one.axis), one.state, one.silent_seconds === null ? 'nothing since the start' : `${span(one.silent_seconds)} ago`,
    moment(one.last_sample), count(one.samples), count(one.missing),
    Object.entries(one.rejected).map(([why, n]) => `${count(n)} ${words(why)}`).join(', ') || '0', count(one.pending_windows),
  ]);
  main.replaceChildren(
    el('h1', {}, 'System ', el('small', {}, `tribowatch ${state.version}`)),
    el('p', { class: `verdict ${kind}`, role: 'status' }, text),
    figures(
      [`${number(state.silence_seconds, 2)} s`, 'since the last turn of the supervising thread'],
      [count(state.backlog_windows), 'windows wait for an answer'],
      [count(state.inbox_blocks), `blocks in the inbox, which holds ${count(state.inbox_limit)}`],
      [`${state.workers.windows_in_work} / ${state.workers.processes}`, 'windows in work / worker processes'],
      [state.identification_seconds_mean === null ? '–' : `${number(state.identification_seconds_mean, 2)} s`, 'to identify a window, mean since the start'],
      [bytes(state.database.bytes), `history (${state.database.kind})`],
      [state.disk ? bytes(state.disk.free) : '–', 'free on its disk'],
      [span(state.uptime_seconds), 'since the start'],
    ),
    el('h2', {}, 'Intake'),
    figures(
      [`${state.axes.streaming} of ${state.axes.listed}`, 'listed axes sent something in the last minute'],
      [count(state.samples), 'samples'], [count(state.missing), 'samples missing'], [count(state.gaps), 'gaps'],
      [count(state.rejected), 'refused'], [count(state.axes.unlisted), 'axes that stream without being listed'],
      [count(state.axes.learning), 'axes still learning'], [count(state.viewers), 'pages open'],
    ),
    streams.length ? table(['axis', 'state', 'heard', 'latest sample (UTC)', '>samples', '>missing', 'refused', '>waiting'], streams, { class: 'cards' })
      : el('p', { class: 'empty' }, 'No axis is listed and none has sent anything since the start.'),
    el('h2', {}, 'Answers since the start'),
    Object.keys(state.answers).length ? table(['verdict', '>windows'], Object.entries(state.answers).map(([name, n]) => [words(name), count(n)]))
      : el('p', { class: 'soft' }, 'None yet.'),
    el('p', { class: 'soft' }, 'The same for machines: ', el('a', { href: '/api/v1/status' }, '/api/v1/status'), ', ', el('a', { href: '/metrics' }, '/metrics'), ', ', el('a', { href: '/healthz' }, '/healthz'), '.'),
  );
  main.dataset.drawn = 'yes';
}

async function load(fresh) {
  try { draw(await get('/status', { fresh })); } catch (error) { main.replaceChildren(problem(error)); }
}

await load(false);
const again = calmly(() => load(true), 2000);
follow(again, again);
setInterval(again, 5000);
