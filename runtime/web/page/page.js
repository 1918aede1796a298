// The page: loads a scene, and draws a frame whenever the browser shows one.

import { isSupported } from '../library/rebounce.js';
import { GaussSeidel } from './comparison.js';
import { Hand } from './hand.js';
import { Panel } from './panel.js';
import { ProbeBaking } from './probe_baking.js';
import { scenes } from './scenes.js';
import { Stage } from './stage.js';

const loading = document.getElementById('loading');
const message = document.getElementById('message');
let running = false;  // whether frames are drawn
let lost = false;     // whether the graphics card was taken away
let request = 0;      // of the next one

function say(title, text, action) {
  if (lost) return;
  message.replaceChildren();
  const strong = document.createElement('strong');
  strong.textContent = title;
  message.append(strong, text);
  const actions = action ? [action] : [];
  if (running) actions.push({ title: 'Close', run: () => {} });  // what was shown goes on
  if (actions.length > 0) message.append(document.createElement('br'));
  for (const { title: name, run } of actions) {
    const button = document.createElement('button');
    button.textContent = name;
    button.addEventListener('click', () => {
      message.hidden = true;
      run();
    });
    message.append(button);
  }
  message.hidden = false;
}

/** Hides what was said, unless it is that the graphics card is lost. */
function unsay() {
  message.hidden = !lost;
}

function progress(part, title) {
  loading.classList.toggle('on', part < 1);
  loading.setAttribute('aria-valuenow', Math.round(100 * part));
  loading.style.setProperty('--part', part);
  if (title) loading.querySelector('p').textContent = title;
}

let shown = 0;  // number of the progress that is shown

/** Shows how much of something has come, until it ends or something else begins. */
function beginProgress(title) {
  const own = ++shown;
  const onProgress = (part) => {
    if (own === shown) progress(Math.min(0.99, part), title);
  };
  const end = () => {
    if (own !== shown) return;
    ++shown;
    progress(1);
  };
  onProgress(0);
  return { onProgress, end };
}

function makeStage() {
  if (!isSupported()) {
    say('This browser cannot run the page',
        'It lacks SIMD or exceptions of WebAssembly. Browsers of 2023 and later have both.');
    return null;
  }
  try {
    return new Stage(document.getElementById('view'));
  } catch {
    say('There is no WebGL 2 here', 'Switch hardware acceleration on, or use another browser.');
    return null;
  }
}

const stage = makeStage();
let panel = null, lastTimings = {};

/** Draws frames from now on. */
function drawFrames() {
  if (lost) return;
  running = true;
  cancelAnimationFrame(request);
  request = requestAnimationFrame(frame);
}

function frame() {
  if (!running) return;
  try {
    const draw = stage.frame();
    lastTimings = { ...stage.lighting.timings, draw };
    panel.showTimes(lastTimings, stage.lighting.transfer.patchCount);
  } catch (error) {
    running = false;
    say('The light has stopped', error.message, { title: 'Load the page again', run: reload });
  }
  if (running) request = requestAnimationFrame(frame);
}

function reload() {
  location.reload();
}

async function open(id) {
  const description = scenes.find((scene) => scene.id === id) ?? scenes[0];
  const { onProgress, end } = beginProgress(`Loading the ${description.title.toLowerCase()}`);
  try {
    const file = `scenes/${description.id}.safetensors`;
    if (!await stage.load(description, file, onProgress)) return;
    comparing?.end();
    unsay();
    document.body.classList.add('begun');
    history.replaceState(null, '', `#${description.id}`);
    panel.showScene();
    drawFrames();
  } catch (error) {
    say('This scene cannot be shown', error.message, { title: 'Try again', run: () => open(id) });
    throw error;
  } finally {
    end();
  }
}

const comparisons = { 'gauss-seidel': GaussSeidel, probes: ProbeBaking };
let comparing = null;  // the progress of the one that was asked for last

/** Shows Gauss-Seidel or a grid of probes beside, with form factors that are fetched now; or none. */
async function compare(kind, settings = {}) {
  comparing?.end();
  if (!comparisons[kind]) {
    stage.closeComparison();
    unsay();
    panel.showComparison();
    return;
  }
  const { onProgress, end } = comparing = beginProgress('Loading the form factors');
  try {
    const file = `scenes/${stage.description.id}.form_factors.safetensors`;
    if (!await stage.openComparison(comparisons[kind], settings, file, onProgress)) return;
    unsay();
    panel.showComparison();
  } catch (error) {
    say('The comparison cannot be shown', error.message,
        { title: 'Try again', run: () => compare(kind, settings).catch(() => {}) });
    throw error;
  } finally {
    end();
  }
}

function start() {
  panel = new Panel(stage, scenes, (id) => open(id).catch(() => {}),
                    (kind) => compare(kind).catch(() => {}));
  new Hand(stage, () => panel.showLamps());
  addEventListener('resize', () => panel.place());
  stage.canvas.addEventListener('webglcontextlost', (event) => {
    event.preventDefault();
    running = false;
    say('The graphics card was taken away', 'The picture comes back when the browser gives it back.',
        { title: 'Load the page again', run: reload });
    lost = true;
  });
  stage.canvas.addEventListener('webglcontextrestored', reload);
  return open(location.hash.slice(1));
}

/** For tests, and for the curious. */
window.rebounce = {
  ready: stage ? start() : Promise.reject(new Error(message.textContent)),
  stage,
  get patchCount() {
    return stage.lighting.transfer.patchCount;
  },
  /** Relights by lights in the fields of a light file alone, until `resume()`. */
  setLights(lights, sky = {}) {
    running = false;
    stage.lighting.update(lights, sky);
    lastTimings = { ...stage.lighting.timings };
    stage.draw();
  },
  resume: drawFrames,
  compare,
  indirectIrradiance: () => stage.lighting.engine.indirectIrradiance().slice(),
  get timings() {
    return lastTimings;
  },
};
window.rebounce.ready.catch(() => {});
