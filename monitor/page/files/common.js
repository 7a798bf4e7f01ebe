// What every view needs: its data, elements without innerHTML, numbers with units, news from the daemon.

export const about = JSON.parse(document.getElementById('about').textContent);
export const main = document.getElementById('main');

/** An element; `attributes` may hold event handlers (onclick), texts and numbers become text nodes. */
export function el(tag, attributes = {}, ...children) {
  const made = tag === 'svg' || tag === 'path'
    ? document.createElementNS('http://www.w3.org/2000/svg', tag) : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith('on')) made.addEventListener(name.slice(2), value);
    else made.setAttribute(name, value === true ? '' : value);
  }
  made.append(...children.flat(3).filter((one) => one !== null && one !== undefined && one !== false));
  return made;
}

/** Put `children` into `parent` instead of what it holds; lists are laid flat, nothing is left out as nothing. */
export function put(parent, ...children) {
  parent.replaceChildren(...children.flat(3).filter((one) => one !== null && one !== undefined && one !== false && one !== ''));
}

export class Refused extends Error {
  constructor(message, status) { super(message); this.status = status; }
}

/** The answer of the API at `path`; the first one may have come with the page. */
export async function get(path, { fresh = false } = {}) {
  const known = about.data[path];
  if (known && !fresh) {
    delete about.data[path];
    if (known.error) throw new Refused(known.error, 0);
    return known;
  }
  return answered(await asked(`/api/v1${path}`, { headers: { accept: 'application/json' } }));
}

/** Give a command; answers what was done. */
export async function command(axis, action, values) {
  const path = `/api/v1/axes/${encodeURIComponent(axis)}/commands/${encodeURIComponent(action)}`;
  return answered(await asked(path, {
    method: 'POST', headers: { 'content-type': 'application/json' }, body: JSON.stringify(values),
  }));
}

async function asked(path, options) {
  try {
    return await fetch(path, options);
  } catch (_) {
    throw new Refused('The daemon does not answer. Does it run? On its computer: tribowatch doctor', 0);
  }
}

async function answered(response) {
  if (response.status === 401) location.assign(`/login?next=${encodeURIComponent(location.pathname + location.search)}`);
  const content = await response.json().catch(() => ({ error: `the answer (${response.status}) is not JSON` }));
  if (!response.ok) throw new Refused(content.error || `refused with ${response.status}`, response.status);
  return content;
}

// --- numbers and words ---------------------------------------------------------------------------------------

const UNITS = { 'N*m': 'N·m', 'N*s/m': 'N·s/m', 'N*s^2/m^2': 'N·s²/m²', 'kg*m^2': 'kg·m²', 'N*m*s/rad': 'N·m·s/rad', 1: '' };
export const unit = (text) => UNITS[text] ?? text;
export const words = (name) => String(name).replaceAll('_', ' ');
const EVENTS = { holds: 'its condition holds', gone: 'its condition is gone', tick: 'time', stale: 'silence' };
/** What moved an alarm, in words. */
export const cause = (event) => EVENTS[event] ?? words(event);
export const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);

/** `value` with significant digits; a dash where there is none. */
export function number(value, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return '–';
  if (value !== 0 && (Math.abs(value) < 1e-3 || Math.abs(value) >= 1e7)) {
    const [mantissa, power] = value.toExponential(digits - 1).split('e');
    return `${mantissa}·10${[...String(Number(power))].map((one) => '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'['-0123456789'.indexOf(one)]).join('')}`.replace('-', '−');
  }
  const text = value.toPrecision(digits);
  const plain = text.includes('e') ? Number(text).toLocaleString('en', { maximumSignificantDigits: digits, useGrouping: false }) : text;
  return plain.length > 12 ? value.toExponential(digits - 1) : plain.replace('-', '−');
}

/** Digits that an interval allows: two of its half width. */
export function digits(value, interval) {
  if (!interval) return 4;
  const half = Math.abs(interval[1] - interval[0]) / 2;
  const largest = Math.max(Math.abs(value), Math.abs(interval[0]), Math.abs(interval[1]));
  if (!(half > 0) || !(largest > 0)) return 4;
  return Math.min(Math.max(2 + Math.floor(Math.log10(largest)) - Math.floor(Math.log10(half)), 2), 6);
}

/** A value with its unit, and its interval small behind it. */
export function quantity(value, interval, unitText) {
  const shown = digits(value, interval);
  return [el('span', { class: 'num' }, number(value, shown)), ' ', unit(unitText),
    interval ? el('span', { class: 'ci' }, ` ${number(interval[0], shown)} to ${number(interval[1], shown)}`) : null];
}

export const percent = (share, places = 0) => (share === null || share === undefined ? '–'
  : `${share > 0 ? '+' : share < 0 ? '−' : ''}${Math.abs(100 * share).toFixed(places)} %`);
export const count = (value) => Number(value).toLocaleString('en').replaceAll(',', ' ');

/** Event time, UTC, to the minute. */
export const moment = (text) => (text ? `${text.slice(0, 10)} ${text.slice(11, 16)}` : '–');
export const momentOf = (ns) => (ns === null || ns === undefined ? '–' : moment(new Date(ns / 1e6).toISOString()));

export function bytes(value) {
  if (value === null || value === undefined) return '–';
  const steps = ['B', 'kB', 'MB', 'GB', 'TB'];
  const step = value > 0 ? Math.min(Math.floor(Math.log10(value) / 3), 4) : 0;
  return `${number(value / 1000 ** step, 3)} ${steps[step]}`;
}

export function span(seconds) {
  if (seconds === null || seconds === undefined) return '–';
  for (const [name, length] of [['d', 86400], ['h', 3600], ['min', 60]]) {
    if (seconds >= 2 * length) return `${number(seconds / length, 3)} ${name}`;
  }
  return `${number(seconds, 2)} s`;
}

// --- badges: a shape, a word and a colour, so that none is needed alone ---------------------------------------------

const SHAPES = { 0: '▲', 1: '◆', 2: '▽', 3: '◇', 4: '✓', 5: '‖', 6: '↗', 7: '…', 8: '●', 9: '?' };
export const badge = (level, word) => el('span', { class: `badge u${level}` }, el('span', { 'aria-hidden': 'true' }, SHAPES[level] ?? '•'), ` ${word}`);
const LEVELS = { high: 0, medium: 1, low: 2 };
export function stateBadge(state, priority) {
  const level = state === 'unacknowledged' ? LEVELS[priority] ?? 1
    : { acknowledged: 4, returned_unacknowledged: 3, normal: 8 }[state] ?? 5;
  return badge(level, words(state));
}

/** How far a chart has come towards its alarm threshold. */
export function meter(height) {
  if (height === null || height === undefined) return el('span', { class: 'soft' }, '–');
  const shown = Math.min(height, 1);
  const level = height >= 1 ? 'over' : height >= 0.5 ? 'near' : 'calm';
  const drawn = el('svg', { class: `meter ${level}`, viewBox: '0 0 60 10', 'aria-hidden': 'true' },
    el('path', { class: 'rail', d: 'M1 5H59' }), shown > 0.005 ? el('path', { class: 'level', d: `M1 5H${1 + 58 * shown}` }) : null);
  return el('span', { class: 'metered' }, drawn, ` ${(100 * height).toFixed(0)} %`);
}

/** Values as a small line. */
export function sparkline(values) {
  const known = values.filter((one) => one !== null && Number.isFinite(one));
  if (known.length < 2) return null;
  const low = Math.min(...known), high = Math.max(...known), scale = high > low ? 18 / (high - low) : 0;
  const points = values.map((one, i) => (one === null ? null : `${(1 + (i * 78) / (values.length - 1)).toFixed(1)} ${(19 - (one - low) * scale).toFixed(1)}`));
  const line = points.map((one, i) => (one === null ? '' : `${i && points[i - 1] !== null ? 'L' : 'M'}${one}`)).join('');
  return el('svg', { class: 'spark', viewBox: '0 0 80 20', 'aria-hidden': 'true' }, el('path', { d: line }));
}

/** A table; columns that begin with '>' are numbers, those with '~' are left out on a phone. */
export function table(columns, rows, options = {}) {
  const kinds = columns.map((one) => [one.includes('>') ? 'n' : '', one.includes('~') ? 'roomy' : ''].join(' ').trim() || null);
  const names = columns.map((one) => one.replace(/[>~]/g, ''));
  const head = names.map((one, i) => el('th', { scope: 'col', class: kinds[i] }, one));
  const body = rows.map((row) => el('tr', row.attributes ?? {}, (row.cells ?? row).map((cell, i) => el('td', {
    class: kinds[i], 'data-label': names[i],
  }, el('div', {}, cell)))));
  return el('div', { class: 'wide' }, el('table', { class: options.class ?? '' },
    options.caption ? el('caption', {}, options.caption) : null, el('thead', {}, el('tr', {}, head)), el('tbody', {}, body)));
}

export const figures = (...pairs) => el('dl', { class: 'figures' }, pairs.filter(Boolean).map(([value, label, kind]) => el('div', { class: kind ?? null }, el('dd', {}, value), el('dt', {}, label))));

export const empty = (title, ...more) => el('div', { class: 'empty' }, el('h2', {}, title), more.map((one) => el('p', {}, one)));

export function problem(error) {
  return el('div', { class: 'problem', role: 'alert' }, el('h2', {}, 'This could not be shown'), el('p', {}, error.message),
    el('p', {}, el('button', { type: 'button', onclick: () => location.reload() }, 'Try again')));
}

export const linkTo = (axis) => `/axes/${encodeURIComponent(axis)}`;
export const alertLink = (axis, kind) => `/alerts/${encodeURIComponent(axis)}/${encodeURIComponent(kind)}`;

let said;
export function toast(text, kind = 'good') {
  said?.remove();
  said = el('div', { class: `toast ${kind}`, role: 'status' }, text);
  document.body.append(said);
  setTimeout(() => said?.remove(), 6000);
}

// --- news ------------------------------------------------------------------------------------------------------

/** Call `work` when something happens, never twice at once, at most every `pause` milliseconds. */
export function calmly(work, pause) {
  let running = false, again = false, last = 0, timer = null;
  return async function due() {
    if (running || timer) { again = running || again; return; }
    const wait = last + pause - Date.now();
    if (wait > 0) { timer = setTimeout(() => { timer = null; due(); }, wait); return; }
    running = true;
    try { await work(); } finally {
      running = false; last = Date.now();
      if (again) { again = false; due(); }
    }
  };
}

const light = document.getElementById('live');
function show(state, text) {
  light.className = `state ${state}`;
  light.textContent = text;
}

/** Follow the daemon; `onChange(axes)` after news, `onAlert(change)` for each change of an alarm. */
export function follow(onChange, onAlert = () => {}) {
  show('waiting', 'connecting');
  const source = new EventSource('/api/v1/events');
  let lost = false;
  source.addEventListener('hello', (message) => {
    const { assets } = JSON.parse(message.data);
    const own = document.querySelector('link[rel="icon"]').getAttribute('href').split('/')[2];
    show('live', 'live');
    if (assets !== own) show('waiting', 'new version: reload this page');
    if (lost) onChange(null);
    lost = false;
  });
  source.addEventListener('change', (message) => onChange(JSON.parse(message.data).axes));
  source.addEventListener('alert', (message) => onAlert(JSON.parse(message.data)));
  source.addEventListener('lost', () => onChange(null));
  source.addEventListener('error', () => {
    lost = true;
    show('away', source.readyState === EventSource.CLOSED ? 'not connected: reload this page' : 'daemon away, trying again');
  });
  window.addEventListener('pagehide', () => source.close());
  window.addEventListener('pageshow', (shown) => { if (shown.persisted) location.reload(); });
}

// --- the frame: colours and keys -----------------------------------------------------------------------------------

const watchers = [];
export const onTheme = (work) => watchers.push(work);
const dark = matchMedia('(prefers-color-scheme: dark)');
export const isDark = () => (document.documentElement.dataset.theme ?? (dark.matches ? 'dark' : 'light')) === 'dark';
document.getElementById('theme').addEventListener('click', () => {
  const next = isDark() ? 'light' : 'dark';
  document.documentElement.dataset.theme = next;
  try { localStorage.setItem('tribowatch-theme', next); } catch (_) { /* for this page only, then */ }
  watchers.forEach((work) => work());
});
dark.addEventListener('change', () => watchers.forEach((work) => work()));

const HELP = [['f', 'fleet'], ['a', 'alerts'], ['s', 'system'], ['/', 'search the fleet'], ['j k', 'next, previous row'], ['?', 'this list']];
document.addEventListener('keydown', (pressed) => {
  if (pressed.ctrlKey || pressed.metaKey || pressed.altKey || document.querySelector('dialog[open]')) return;
  if (pressed.target.closest('input, textarea, select')) {
    if (pressed.key === 'Escape') pressed.target.blur();
    return;
  }
  const link = document.querySelector(`nav a[data-key="${CSS.escape(pressed.key)}"]`);
  const search = document.getElementById('search');
  if (link) link.click();
  else if (pressed.key === '/' && search) { pressed.preventDefault(); search.focus(); }
  else if (pressed.key === 'j' || pressed.key === 'k') step(pressed.key === 'j' ? 1 : -1);
  else if (pressed.key === '?') help();
});

function step(by) {
  const links = [...document.querySelectorAll('tbody tr:not([hidden]) a.row')];
  const next = links[Math.min(Math.max(links.indexOf(document.activeElement) + by, 0), links.length - 1)];
  next?.focus();
}

function help() {
  const box = el('dialog', { class: 'help' }, el('h2', {}, 'Keys'), el('dl', {}, HELP.map(([key, what]) => [el('dt', {}, el('kbd', {}, key)), el('dd', {}, what)])),
    el('form', { method: 'dialog' }, el('button', {}, 'Close')));
  box.addEventListener('close', () => box.remove());
  document.body.append(box);
  box.showModal();
}
