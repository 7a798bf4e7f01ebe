// Charts come after the numbers: plotly is fetched when the first one is wanted, and once for good.
//
// Our policy allows neither style elements made by scripts nor eval. plotly writes its rules into the style sheet that has
// the id it looks for (a linked one of ours), and its map library adds none when an element of its id is there.
import { about, el, onTheme } from './common.js';

let loading;
function plotly() {
  loading ??= new Promise((resolve, reject) => {
    const sheet = el('link', { rel: 'stylesheet', id: 'plotly.js-style-global', href: new URL('plotly.css', import.meta.url).pathname });
    const script = el('script', { src: about.plotly, async: true });
    script.addEventListener('load', () => resolve(window.Plotly));
    script.addEventListener('error', () => reject(new Error('the charts could not be fetched')));
    sheet.addEventListener('load', () => document.head.append(...about.guards.map((id) => el('meta', { id })), script));
    document.head.append(sheet);
  });
  return loading;
}

// Okabe and Ito's colours: told apart by people who see colours differently, on white and on black
export const COLOURS = { now: '#D55E00', normal: '#2E8BC0', third: '#009E73', fourth: '#CC79A7', fifth: '#8A8F98', sixth: '#B58900' };
export const LIST = Object.values(COLOURS);
export const shade = (colour, opacity) => `${colour}${Math.round(opacity * 255).toString(16).padStart(2, '0')}`;

const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

function themed(layout) {
  const ink = style('--ink'), grid = style('--grid'), soft = style('--soft');
  const full = {
    autosize: true, paper_bgcolor: 'rgba(0,0,0,0)', plot_bgcolor: 'rgba(0,0,0,0)', font: { family: 'system-ui, sans-serif', size: 12, color: ink },
    margin: { l: 64, r: 14, t: 30, b: 44 }, hovermode: 'x', showlegend: true, dragmode: 'zoom',
    legend: { orientation: 'h', x: 0, xanchor: 'left', y: 1.02, yanchor: 'bottom', font: { color: soft } },
    hoverlabel: { bgcolor: style('--card'), bordercolor: grid, font: { color: ink } }, ...layout,
  };
  for (const name of Object.keys(full)) {
    if (/^[xy]axis\d*$/.test(name)) full[name] = { gridcolor: grid, linecolor: grid, zerolinecolor: grid, tickfont: { color: soft }, automargin: true, ...full[name] };
  }
  return full;
}

const OPTIONS = { responsive: true, displaylogo: false, displayModeBar: 'hover', modeBarButtonsToRemove: ['select2d', 'lasso2d', 'autoScale2d'] };
const drawn = new Map();

/** Draw `figure` into `place`, again when the colours change; what it shows is said in `label` for those who cannot see it. */
export async function draw(place, figure, label) {
  place.setAttribute('role', 'img');
  place.setAttribute('aria-label', label);
  drawn.set(place, figure);
  try {
    const Plotly = await plotly();
    if (drawn.get(place) !== figure || !place.isConnected) return;
    const data = figure.data.map((one) => structuredClone(one));
    await Plotly.react(place, data, themed(structuredClone(figure.layout)), OPTIONS);
    place.dataset.drawn = 'yes';
  } catch (error) {
    place.replaceChildren(el('p', { class: 'soft' }, `No chart: ${error.message}. The numbers above are complete.`));
  }
}

onTheme(() => { for (const [place, figure] of drawn) if (place.isConnected) draw(place, figure, place.getAttribute('aria-label')); });
window.addEventListener('beforeprint', () => { for (const place of drawn.keys()) if (place.isConnected) window.Plotly?.relayout(place, { autosize: false, width: 680, 'font.color': '#000' }); });
window.addEventListener('afterprint', () => { for (const [place, figure] of drawn) if (place.isConnected) draw(place, figure, place.getAttribute('aria-label')); });

/** A short piece of line or bar, for legends in text. */
export function swatch(colour, dash) {
  const lengths = { solid: null, dash: '6 4', dot: '2 3', dashdot: '6 3 2 3', longdash: '10 4' };
  const drawnAs = dash === 'bar' ? { 'stroke-width': 9 } : { 'stroke-width': 2, 'stroke-dasharray': lengths[dash] };
  return el('svg', { class: 'swatch', viewBox: '0 0 26 10', 'aria-hidden': 'true' }, el('path', { d: 'M1 5H25', stroke: colour, fill: 'none', ...drawnAs }));
}

export const place = (height) => el('div', { class: 'plot', 'data-height': height });

/** A line with its interval as a band, in two traces. */
export function banded(x, values, low, high, name, colour, more = {}) {
  const known = low.some((one) => one !== null && one !== undefined);
  const band = known ? [{
    type: 'scatter', mode: 'lines', x: [...x, ...[...x].reverse()], y: [...high, ...[...low].reverse()], fill: 'toself', fillcolor: shade(colour, 0.22),
    line: { width: 0 }, hoverinfo: 'skip', showlegend: false, legendgroup: name, ...more,
  }] : [];
  return [...band, { type: 'scatter', mode: 'lines', x, y: values, name, line: { color: colour, width: 2 }, legendgroup: name, ...more }];
}
