// Nothing is at this address.
import { el, main } from './common.js';

main.replaceChildren(el('div', { class: 'empty' }, el('h1', {}, 'Nothing is here'), el('p', {}, `There is no page at ${location.pathname}. `,
  'An axis is at /axes/ with its name; it may have been renamed or deleted.'), el('p', {}, el('a', { href: '/' }, 'To the fleet'))));
main.dataset.drawn = 'yes';
