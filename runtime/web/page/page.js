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

function say(title, text, action) {
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

function progress(part, title) {
  loading.classList.toggle('on', part < 1);
  loading.setAttribute('aria-valuenow', Math.round(100 * part));
  loading.style.setProperty('--part', part);
  if (title) loading.querySelector('p').textContent = title;
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
  requestAnimationFrame(frame);
}

function reload() {
  location.reload();
}

async function open(id) {
  const description = scenes.find((scene) => scene.id === id) ?? scenes[0];
  const wasRunning = running;
  const title = `Loading the ${description.title.toLowerCase()}`;
  const onProgress = (part) => progress(Math.min(0.99, part), title);
  onProgress(0);
  try {
    const shown = await stage.load(description, `scenes/${description.id}.safetensors`, onProgress);
    if (!shown) return;
    message.hidden = true;
    document.body.classList.add('begun');
    history.replaceState(null, '', `#${description.id}`);
    panel.showScene();
    running = true;
    if (!wasRunning) requestAnimationFrame(frame);
  } catch (error) {
    say('This scene cannot be shown', error.message, { title: 'Try again', run: () => open(id) });
    throw error;
  } finally {
    progress(1);
  }
}

const comparisons = { 'gauss-seidel': GaussSeidel, probes: ProbeBaking };

/** Shows Gauss-Seidel or a grid of probes beside, with form factors that are fetched now; or none. */
async function compare(kind, settings = {}) {
  const onProgress = (part) => progress(Math.min(0.99, part), 'Loading the form factors');
  try {
    if (comparisons[kind]) {
      onProgress(0);
      const name = stage.description.id;
      await stage.openComparison(
          comparisons[kind], settings, `scenes/${name}.form_factors.safetensors`, onProgress);
    } else {
      stage.closeComparison();
    }
    message.hidden = true;
    panel.showComparison();
  } catch (error) {
    say('The comparison cannot be shown', error.message,
        { title: 'Try again', run: () => compare(kind, settings).catch(() => {}) });
    throw error;
  } finally {
    progress(1);
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
  resume() {
    if (running) return;
    running = true;
    requestAnimationFrame(frame);
  },
  compare,
  indirectIrradiance: () => stage.lighting.engine.indirectIrradiance().slice(),
  get timings() {
    return lastTimings;
  },
};
window.rebounce.ready.catch(() => {});
