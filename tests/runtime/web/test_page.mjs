// The page in a browser. Usage: node test_page.mjs FOLDER

import assert from 'node:assert/strict';
import { copyFileSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, afterEach, before, test } from 'node:test';
import { chromiumPath, launchArguments, lights, skipWithout, web } from './support.mjs';

const folder = process.argv[2];
skipWithout(join(folder, 'native.csv'), 'page; see the test WebBuild');
skipWithout(chromiumPath, 'Chromium');

const { chromium } = await import(join(web, 'node_modules/playwright-core/index.mjs'));
const { serve } = await import(join(web, 'serve.mjs'));
const scenes = join(folder, 'page/scenes');
const scene = join(scenes, 'cornell_box.safetensors');

let server, browser;
before(async () => {
  server = await serve(join(folder, 'page'));
  browser = await chromium.launch({ executablePath: chromiumPath, args: launchArguments });
});
after(async () => {
  await browser?.close();
  server?.close();
});

const opened = [];
afterEach(async () => {
  for (const page of opened.splice(0)) await page.close();
});

/** Opens the page; `faults` gathers what it says on its console. */
async function open(viewport = { width: 640, height: 480 }, prepare = () => {}) {
  const page = await browser.newPage({ viewport });
  page.setDefaultTimeout(120000);  // drawing is slow without a graphics card
  opened.push(page);
  const faults = [];
  page.on('pageerror', (error) => faults.push(String(error)));
  page.on('console', (message) => {
    if (message.type() === 'error') faults.push(message.text());
  });
  await prepare(page);
  await page.goto(server.url);
  return { page, faults };
}

async function openReady(viewport) {
  const { page, faults } = await open(viewport);
  await page.evaluate(() => window.rebounce.ready);
  return { page, faults };
}

const sum = (page) => page.evaluate(
    () => window.rebounce.indirectIrradiance().reduce((total, value) => total + value, 0));

/** Waits until the page has drawn what was last asked of it. */
const frames = (page) => page.evaluate(() => new Promise((resolve) => {
  requestAnimationFrame(() => requestAnimationFrame(resolve));
}));

/** Where the first lamp is, in pixels. */
const lampPlace = (page) => page.evaluate(() => {
  const { stage } = window.rebounce;
  const at = stage.lamps[0].object.position.clone().project(stage.camera);
  return { x: (at.x + 1) / 2 * innerWidth, y: (1 - at.y) / 2 * innerHeight };
});

test('it loads without a fault, and a lamp that is dragged takes its light along', async () => {
  const { page, faults } = await openReady();
  const lamp = await lampPlace(page);
  const shown = await page.locator('#view').screenshot();
  const light = await sum(page);
  await page.mouse.move(lamp.x, lamp.y);
  await page.mouse.down();
  await page.mouse.move(lamp.x - 60, lamp.y + 50, { steps: 4 });
  const inTheSameFrame = await page.evaluate(() => new Promise((resolve) => {
    // After the page's own frame, in the same one of the browser.
    requestAnimationFrame(() => {
      const { stage } = window.rebounce;
      const moved = stage.lamps[0].object.position.toArray();
      const before = window.rebounce.indirectIrradiance();
      stage.frame();
      const after = window.rebounce.indirectIrradiance();
      resolve({ moved, same: before.every((value, k) => value === after[k]) });
    });
  }));
  await page.mouse.up();
  assert.ok(inTheSameFrame.same, 'the light was that of the lamp where it is');
  assert.notEqual(await sum(page), light);
  assert.ok(!shown.equals(await page.locator('#view').screenshot()), 'the picture has changed');
  assert.deepEqual(faults, []);
});

test('its controls do what they say', async () => {
  const { page, faults } = await openReady();
  const changes = async (act) => {
    const light = await sum(page);
    await act();
    await frames(page);
    return (await sum(page)) !== light;
  };
  assert.ok(await changes(() => page.click('#add')), 'another lamp');
  assert.equal(await page.locator('#lamps li').count(), 2);
  assert.ok(await changes(() => page.locator('#lamps .power').first().click()), 'off');
  assert.ok(await changes(() => page.locator('#lamps .power').first().click()), 'on');
  assert.ok(await changes(() => page.locator('#lamps input[type=range]').first().fill('1')), 'more');
  assert.ok(await changes(() => page.locator('#lamps input[type=color]').first().fill('#ff0000')),
            'another colour');
  assert.ok(await changes(() => page.locator('#lamps .remove').last().click()), 'taken away');
  assert.ok(await changes(async () => {
    await page.focus('#view');
    await page.keyboard.press('ArrowLeft');
  }), 'by a key');
  assert.ok(await changes(() => page.click('#swing')), 'swings');
  await page.click('#swing');
  const all = await page.locator('#view').screenshot();
  for (const part of ['bounced', 'direct']) {
    await page.click(`#parts [data-part=${part}]`);
    await frames(page);
    assert.ok(!all.equals(await page.locator('#view').screenshot()), part);
  }
  assert.deepEqual(faults, []);
});

test('its light is that of the native library', async () => {
  const { page } = await openReady();
  const { light, timings, patchCount } = await page.evaluate((given) => {
    window.rebounce.setLights(given);
    return {
      light: [...window.rebounce.indirectIrradiance()], timings: window.rebounce.timings,
      patchCount: window.rebounce.patchCount,
    };
  }, lights);
  assert.equal(light.length, 3 * patchCount);
  assert.ok(timings.direct > 0 && timings.total >= timings.product);
  const { Transfer } = await import(join(web, 'library/rebounce.js'));
  const transfer = await Transfer.load(new Uint8Array(readFileSync(scene)).buffer);
  const engine = transfer.createEngine();
  transfer.materials.forEach((material, k) => engine.setEmissionScale(k, [0, 0, 0]));
  engine.relight(lights);
  assert.deepEqual(light, [...engine.indirectIrradiance()]);
});

test('600 frames take no further memory', async () => {
  const { page, faults } = await openReady({ width: 160, height: 120 });
  const memoryAfter = (count) => page.evaluate((most) => {
    const { stage } = window.rebounce;
    stage.swinging = true;
    for (let k = 0; k < most; ++k) stage.frame();
    stage.renderer.shadowMap.autoUpdate = false;  // their drawing is slow without a graphics card
    const { memory, programs } = stage.renderer.info;
    return { geometries: memory.geometries, textures: memory.textures, programs: programs.length };
  }, count);
  const before = await memoryAfter(5);
  assert.deepEqual(await memoryAfter(600), before);
  assert.deepEqual(faults, []);
});

test('what is missing or damaged has a message, and the next scene can be shown', async () => {
  const good = readFileSync(scene);
  const bad = join(scenes, 'pavilion.safetensors');
  const { page } = await openReady();
  const messageOf = async (bytes) => {
    rmSync(bad, { force: true });
    if (bytes) writeFileSync(bad, bytes);
    await page.click('#scenes [data-scene=pavilion]');
    await page.waitForSelector('#message:not([hidden])');
    const text = await page.textContent('#message');
    await page.click('#scenes [data-scene=cornell_box]');
    await page.waitForSelector('#message', { state: 'hidden' });
    return text;
  };
  assert.match(await messageOf(null), /404/);
  assert.match(await messageOf(good.subarray(0, good.length / 2)), /truncated/);
  assert.match(await messageOf(Buffer.from('<html></html>')), /safetensors|header|short/);
  copyFileSync(scene, bad);
  assert.ok(await sum(page) > 0);
});

test('a browser that lacks what it needs, and a lost context, have a message', async () => {
  const lacking = [
    ['WebGL', () => {
      HTMLCanvasElement.prototype.getContext = () => null;
    }],
    ['WebAssembly', () => {
      WebAssembly.validate = () => false;
    }],
  ];
  for (const [name, take] of lacking) {
    const { page } = await open(undefined, (made) => made.addInitScript(take));
    await page.waitForSelector('#message:not([hidden])');
    assert.match(await page.textContent('#message'), new RegExp(name));
  }
  const { page } = await openReady();
  await page.evaluate(() => window.rebounce.stage.renderer.forceContextLoss());
  await page.waitForSelector('#message:not([hidden])');
  assert.match(await page.textContent('#message'), /graphics card/);
});
