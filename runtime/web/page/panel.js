// The controls around the canvas.

import { lampKinds } from './lamp.js';
import { clockText } from './sun.js';
import { mostLamps } from './stage.js';

const element = (name, attributes = {}, ...children) => {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
};
const byId = (id) => document.getElementById(id);

/** A part of the light, as a percentage. */
const percent = (part) => `${(100 * part).toFixed(part < 0.1 ? 1 : 0)} %`;

/** How wrong one half of a comparison is, and for how long. */
function sideText({ error, lag }) {
  const state = lag.frames > 0 ? `${lag.frames} ${lag.frames === 1 ? 'frame' : 'frames'} behind`
      : lag.settled > 0 ? `caught up after ${lag.settled} ${lag.settled === 1 ? 'frame' : 'frames'}`
      : 'right in the same frame';
  return `error ${Number.isFinite(error) ? percent(error) : '-'} \u00B7 ${state}`;
}

function press(button, on) {
  button.setAttribute('aria-pressed', on);
}

export class Panel {
  #stage;
  #onCompare;
  #part = 'all';
  #times = new Map();
  #items = new Map();  // of lamps: the element, and what brings it up to date

  /** Calls onScene(id) and onCompare(kind) when asked for another scene, or for another half. */
  constructor(stage, scenes, onScene, onCompare) {
    this.#stage = stage;
    this.#onCompare = onCompare;
    for (const scene of scenes) {
      const button = element('button', { 'data-scene': scene.id }, scene.title);
      button.addEventListener('click', () => onScene(scene.id));
      byId('scenes').append(button);
    }
    for (const { kind, title } of lampKinds) {
      const button = element('button', { 'data-kind': kind, title: `Add a lamp: ${title}` },
                             `+ ${title}`);
      button.addEventListener('click', () => this.addLamp(kind));
      byId('add').append(button);
    }
    for (const button of byId('compare').children) {
      button.addEventListener('click', () => onCompare(button.dataset.kind));
    }
    byId('pace').addEventListener('input', () => this.#setPace());
    for (const [id, part] of [['sun-on', 'sunIsOn'], ['sky-on', 'skyIsOn']]) {
      byId(id).addEventListener('click', () => {
        stage[part] = !stage[part];
        press(byId(id), stage[part]);
        this.#setHour(stage.hour);
      });
    }
    byId('swing').addEventListener('click', () => this.toggleSwing());
    byId('hour').addEventListener('input', (event) => this.#setHour(Number(event.target.value)));
    for (const button of byId('parts').children) {
      button.addEventListener('click', () => this.show(button.dataset.part));
    }
    addEventListener('keydown', (event) => this.#onKey(event));
    this.#makeTimes();
  }

  #onKey(event) {
    if (event.target.matches('input, button') && event.key === ' ') return;
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (!this.#stage.lighting) return;  // no scene is there
    const beside = (kind) => this.#onCompare(this.#stage.comparison?.kind === kind ? '' : kind);
    const actions = {
      1: () => this.show('all'), 2: () => this.show('bounced'), 3: () => this.show('direct'),
      ' ': () => this.toggleSwing(), a: () => this.addLamp('point'), n: () => this.#chooseNext(),
      o: () => this.#switchChosen(),
      c: () => beside('gauss-seidel'), g: () => beside('probes'),
    };
    const act = actions[event.key.toLowerCase()];
    if (!act) return;
    event.preventDefault();
    if (!event.repeat) act();
  }

  #chooseNext() {
    const { movable, chosen } = this.#stage;
    this.#stage.chosen = movable[(movable.indexOf(chosen) + 1) % movable.length] ?? null;
    this.showLamps();
  }

  #switchChosen() {
    const { chosen, lamps } = this.#stage;
    if (!lamps.includes(chosen)) return;
    chosen.on = !chosen.on;
    chosen.refresh();
    this.showLamps();
  }

  addLamp(kind) {
    const { bounds, description } = this.#stage;
    // High in the middle, where furniture stands below, and beside those that were added before.
    const { x, z } = bounds.min.clone().lerp(bounds.max, 0.4 + 0.1 * this.#stage.lamps.length);
    const middle = [x, bounds.min.y + 0.72 * (bounds.max.y - bounds.min.y), z];
    const colors = ['#ffd2a1', '#9cc4ff', '#ff9c8f', '#b8ffb0'];
    this.#stage.addLamp({
      kind, position: middle, color: colors[this.#stage.lamps.length % colors.length],
      intensity: 0.6 * description.lamps[0].intensity,
    });
    this.showLamps();
  }

  toggleSwing() {
    this.#stage.toggleSwing();
    press(byId('swing'), this.#stage.swinging);
  }

  show(part) {
    this.#part = part;
    this.#stage.show(part);
    for (const button of byId('parts').children) press(button, button.dataset.part === part);
  }

  #setHour(hour) {
    this.#stage.setHour(hour);
    this.#stage.relight();
    this.#stage.expose();
    this.#showHour(hour);
  }

  #showHour(hour) {
    byId('clock').textContent = clockText(hour);
    byId('hour').setAttribute('aria-valuetext', clockText(hour));
  }

  #setPace() {
    const { comparison } = this.#stage;
    if (!comparison) return;
    comparison.pace = Number(byId('pace').value);
    byId('pace-text').textContent = comparison.paceText;
    byId('pace').setAttribute('aria-valuetext', comparison.paceText);
  }

  /** To be called when the other half was opened or closed. */
  showComparison() {
    const { comparison } = this.#stage;
    for (const button of byId('compare').children) {
      press(button, button.dataset.kind === (comparison?.kind ?? ''));
    }
    for (const id of ['pace', 'pace-text', 'halves']) byId(id).hidden = !comparison;
    document.body.classList.toggle('split', Boolean(comparison));
    if (comparison) {
      byId('pace').max = comparison.mostPace;
      byId('pace').value = comparison.pace;
      byId('halves').children[1].firstElementChild.textContent = comparison.title;
      this.#setPace();
    }
    this.showLamps();
  }

  /** To be called when the page has another size, or the controls have. */
  place() {
    const { top, left, width } = document.querySelector('aside').getBoundingClientRect();
    const isNarrow = width >= innerWidth;  // the controls cover both ends, not the right
    this.#stage.covered = {
      above: isNarrow ? byId('scenes').getBoundingClientRect().bottom : 0,
      below: isNarrow ? innerHeight - top : 0,
      right: isNarrow ? 0 : innerWidth - left,
    };
    this.#stage.resize();
    const views = this.#stage.views();
    byId('halves').style.setProperty('--divide', `${views.at(-1).left}px`);
    views.forEach(({ left: x, top: y, height }, k) => {
      const half = byId('halves').children[k];
      half.style.setProperty('--left', `${x}px`);
      half.style.setProperty('--top', `${y}px`);
      half.style.setProperty('--height', `${height}px`);
    });
  }

  #showErrors() {
    const { comparison } = this.#stage;
    if (!comparison) return;
    const { ours, theirs, note } = comparison;
    [[sideText(ours), ''], [sideText(theirs), ` \u00B7 ${note}`]].forEach((texts, k) => {
      byId('halves').children[k].querySelectorAll('span').forEach((shown, part) => {
        if (shown.textContent !== texts[part]) shown.textContent = texts[part];
      });
    });
  }

  /** To be called when another scene is there. */
  showScene() {
    const { description, hour } = this.#stage;
    for (const button of byId('scenes').children) {
      button.setAttribute('aria-current', button.dataset.scene === description.id);
    }
    byId('sun').hidden = hour === null;
    if (hour !== null) {
      byId('hour').value = hour;
      this.#showHour(hour);
    }
    this.show(this.#part);
    this.showComparison();
  }

  /** To be called when lamps were added, taken away or chosen. */
  showLamps() {
    const { lamps } = this.#stage;
    for (const [lamp, { item }] of this.#items) {
      if (lamps.includes(lamp)) continue;
      item.remove();
      this.#items.delete(lamp);
    }
    for (const lamp of lamps) {
      if (!this.#items.has(lamp)) {
        this.#items.set(lamp, this.#lampItem(lamp));
        byId('lamps').append(this.#items.get(lamp).item);
      }
      this.#items.get(lamp).refresh();
    }
    for (const button of byId('add').children) button.disabled = lamps.length >= mostLamps;
    this.#showChosen();
    this.place();
  }

  #titleOf(lamp) {
    const { title } = lampKinds.find(({ kind }) => kind === lamp.kind);
    return `${title} ${this.#stage.lamps.indexOf(lamp) + 1}`;
  }

  #showChosen() {
    const { chosen, ball } = this.#stage;
    for (const [lamp, { item }] of this.#items) item.setAttribute('aria-current', lamp === chosen);
    const text = chosen ? `${chosen === ball ? 'The ball' : this.#titleOf(chosen)} is chosen` : '';
    if (byId('chosen').textContent !== text) byId('chosen').textContent = text;
  }

  #lampItem(lamp) {
    const color = element('input', { type: 'color' });
    color.addEventListener('input', () => { lamp.color = color.value; });
    const power = element('input', { type: 'range', min: -2, max: 2, step: 0.01 });
    power.addEventListener('input', () => {
      lamp.part = 2 ** Number(power.value);
      lamp.refresh();
      refresh();
    });
    const toggle = element('button', { class: 'power', title: 'Switch on or off (key: O)' });
    toggle.addEventListener('click', () => {
      lamp.on = !lamp.on;
      lamp.refresh();
      refresh();
    });
    const remove = element('button', { class: 'remove', title: 'Remove' }, '\u00D7');
    remove.addEventListener('click', () => {
      this.#stage.removeLamp(lamp);
      this.showLamps();
      // Keys go on from a control that is there.
      const last = byId('lamps').lastElementChild;
      (last?.querySelector('.remove') ?? byId('add').firstElementChild).focus();
    });
    const controls = { colour: color, brightness: power, on: toggle, remove };
    const item = element('li', {}, ...Object.values(controls));
    for (const type of ['pointerdown', 'focusin']) {
      item.addEventListener(type, () => {
        this.#stage.chosen = lamp;
        this.#showChosen();
      });
    }
    const refresh = () => {
      for (const [name, control] of Object.entries(controls)) {
        control.setAttribute('aria-label', `${this.#titleOf(lamp)}: ${name}`);
      }
      color.value = lamp.color;
      power.value = Math.log2(lamp.part);
      power.setAttribute('aria-valuetext', percent(lamp.part));
      press(toggle, lamp.on);
    };
    return { item, refresh };
  }

  #makeTimes() {
    const stages = [
      ['direct', 'Direct light'], ['product', 'All bounces'], ['vertices', 'Vertices, probes'],
      ['draw', 'Drawing'],
    ];
    for (const [name, title] of stages) {
      const value = document.createTextNode('');
      const optional = name === 'vertices' || name === 'draw' ? ' optional' : '';
      byId('times').firstElementChild.append(element(
          'div', { class: name + optional }, element('dt', {}, title),
          element('dd', {}, value, ' ', element('small', {}, 'ms'))));
      this.#times.set(name, { value, mean: 0 });
    }
    const patches = document.createTextNode('');
    byId('times').firstElementChild.append(
        element('div', { class: 'optional' }, element('dt', {}, 'Patches'), element('dd', {}, patches)));
    this.#times.set('patches', { value: patches });
  }

  /** Shows the milliseconds of the stages, smoothed. */
  showTimes(timings, patchCount) {
    this.#showErrors();
    for (const [name, { value, mean }] of this.#times) {
      if (name === 'patches') continue;
      const smooth = mean + 0.1 * (timings[name] - mean);
      this.#times.get(name).mean = smooth;
      const text = smooth.toFixed(1);
      if (value.data !== text) value.data = text;
    }
    const text = patchCount.toLocaleString('en');
    const { value } = this.#times.get('patches');
    if (value.data !== text) value.data = text;
  }
}
