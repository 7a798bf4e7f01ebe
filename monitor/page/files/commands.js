// What an operator can do with an alarm or an axis: buttons, and the dialogue that asks for what is missing.
import { about, command, el, toast } from './common.js';

const STORED = 'tribowatch-author';
const author = () => { try { return about.who || localStorage.getItem(STORED) || ''; } catch (_) { return about.who; } };

/** Ask for `fields`, then give the command; resolves when it was done. */
function ask(axis, action, title, said, fields, fixed, done) {
  const inputs = fields.map((field) => el(field.choices ? 'select' : field.long ? 'textarea' : 'input', {
    id: `field-${field.name}`, name: field.name, type: field.choices || field.long ? null : field.type ?? 'text',
    required: field.required ?? true, value: field.value ?? null, maxlength: 1000,
  }, (field.choices ?? []).map(([value, text]) => el('option', { value, selected: value === field.value }, text))));
  const wrong = el('p', { class: 'problem', role: 'alert', hidden: true });
  const send = el('button', { class: 'primary', type: 'submit' }, title);
  const form = el('form', {}, el('h2', {}, title), el('p', {}, said),
    fields.map((field, i) => (field.type === 'checkbox' ? el('label', { class: 'tick' }, inputs[i], ` ${field.label}`)
      : [el('label', { for: `field-${field.name}` }, field.label), inputs[i]])),
    wrong, el('div', { class: 'buttons' }, el('button', { type: 'button', onclick: () => box.close() }, 'Cancel'), send));
  const box = el('dialog', { 'aria-label': title }, form);
  form.addEventListener('submit', async (event) => {
    event.preventDefault();
    send.disabled = true;
    const values = { ...fixed };
    fields.forEach((field, i) => { values[field.name] = field.type === 'checkbox' ? inputs[i].checked : inputs[i].value; });
    if (!about.who) try { localStorage.setItem(STORED, values.author ?? ''); } catch (_) { /* asked again next time */ }
    try {
      await command(axis, action, values);
      box.close();
      toast(`${title}: done`);
      done();
    } catch (error) {
      wrong.textContent = error.message;
      wrong.hidden = false;
      send.disabled = false;
    }
  });
  box.addEventListener('close', () => box.remove());
  document.body.append(box);
  box.showModal();
}

const who = () => (about.who ? [] : [{ name: 'author', label: 'Your name, for the audit', value: author() }]);
const FOR = [['8h', '8 hours'], ['1d', 'a day'], ['7d', 'a week'], ['30d', '30 days'], ['90d', '90 days']];

/** Buttons for the state an alarm is in. */
export function alarmButtons(alert, done) {
  if (!about.operate) return el('p', { class: 'soft' }, 'Your token lets you look. To acknowledge or shelve, ask for one with the role operate.');
  const fixed = { kind: alert.kind };
  const button = (title, action, said, fields = [], first = false) => el('button', {
    type: 'button', class: first ? 'primary' : null, 'data-action': action,
    onclick: () => ask(alert.axis, action, title, said, [...fields, ...who()], fixed, done),
  }, title);
  const found = [];
  if (['unacknowledged', 'returned_unacknowledged'].includes(alert.state)) {
    found.push(button('Acknowledge', 'acknowledge', 'Says that somebody has seen it and takes care. The alarm stays until its cause is gone.', [], true));
  }
  if (alert.state === 'shelved') found.push(button('Unshelve', 'unshelve', 'Shows the alarm again, as it is now.', [], true));
  else if (alert.state === 'out_of_service') found.push(button('Return to service', 'in-service', 'Shows the alarm again, as it is now.', [], true));
  else if (alert.state !== 'suppressed') {
    found.push(button('Shelve', 'shelve', 'Puts it aside for a time; it comes back by itself. Counted in the axis’ own time.', [{ name: 'for', label: 'For how long', choices: FOR, value: '7d' }]));
    found.push(button('Take out of service', 'out-of-service', 'Until it is returned to service this alarm is not shown; use it for maintenance.'));
  }
  return el('div', { class: 'buttons' }, found);
}

/** Makes an effect that was found part of the axis' model. */
export function promoteButton(axis, effect, done) {
  if (!about.operate) return null;
  const said = 'Makes the effect part of this axis’ model from now on; the windows that are kept are identified again, so that trends stay comparable. It can be taken back with demote.';
  return el('div', { class: 'buttons' }, el('button', { type: 'button', 'data-action': 'promote', onclick: () => ask(axis, 'promote', `Promote ${effect.replaceAll('_', ' ')}`, said, who(), { effect }, done) }, `Promote ${effect.replaceAll('_', ' ')}`));
}

/** Buttons for the axis itself. */
export function axisButtons(axis, done) {
  if (!about.operate) return null;
  return el('div', { class: 'buttons' },
    el('button', { type: 'button', 'data-action': 'event', onclick: () => ask(axis, 'event', 'Note maintenance', 'What was done to this axis? It is drawn into its trends.', [
      { name: 'text', label: 'What was done', long: true },
      { name: 'new_baseline', label: 'friction is different from now on: learn anew what is normal', type: 'checkbox', required: false }, ...who(),
    ], {}, done) }, 'Note maintenance'),
    el('button', { type: 'button', 'data-action': 'relearn', onclick: () => ask(axis, 'relearn', 'Learn anew', 'Forgets what is normal for this axis; the next informative windows teach it. Nothing of the history is lost.', [
      { name: 'text', label: 'Why' }, ...who(),
    ], {}, done) }, 'Learn anew'));
}
