// The page in a browser. Usage: node test_page.mjs FOLDER

import assert from 'node:assert/strict';
import { copyFileSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, afterEach, before, test } from 'node:test';
import { chromiumPath, launchArguments, lights, roomExposure, roomLights, skipWithout, web } from './support.mjs';
import { emitted, reflectance } from './textured_scene.mjs';

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
async function open(viewport = { width: 640, height: 480 }, prepare = () => {}, name = '') {
  const page = await browser.newPage({ viewport });
  page.setDefaultTimeout(120000);  // drawing is slow without a graphics card
  opened.push(page);
  const faults = [];
  page.on('pageerror', (error) => faults.push(String(error)));
  page.on('console', (message) => {
    if (message.type() === 'error') faults.push(message.text());
  });
  await prepare(page);
  await page.goto(server.url + name);
  return { page, faults };
}

async function openReady(viewport) {
  const { page, faults } = await open(viewport);
  await page.evaluate(() => window.rebounce.ready);
  return { page, faults };
}

const sum = (page) => page.evaluate(
    () => window.rebounce.indirectIrradiance().reduce((total, value) => total + value, 0));

/**
 * Makes shadow maps small, those of lamps to come too: without a graphics card they take most of the
 * time of a frame.
 */
const makeShadowsCoarse = (page) => page.evaluate(() => {
  const { stage } = window.rebounce;
  const makeCoarse = ({ shadow }) => {
    if (!shadow) return;
    shadow.mapSize.set(16, 16);
    shadow.map?.dispose();
    shadow.map = null;
  };
  const addLamp = stage.addLamp.bind(stage);
  stage.addLamp = (description) => {
    addLamp(description);
    makeCoarse(stage.lamps.at(-1).light);
  };
  for (const { light } of stage.lamps) makeCoarse(light);
});

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

test('the first button alone takes hold of a lamp', async () => {
  const { page, faults } = await openReady();
  const lamp = await lampPlace(page);
  const place = () => page.evaluate(() => window.rebounce.stage.lamps[0].object.position.toArray());
  const before = await place();
  await page.mouse.move(lamp.x, lamp.y);
  for (const button of ['right', 'middle']) {
    await page.mouse.down({ button });
    await page.mouse.move(lamp.x - 30, lamp.y + 20);
    await page.mouse.up({ button });
    assert.deepEqual(await place(), before, button);
    await page.mouse.move(lamp.x, lamp.y);
  }
  assert.deepEqual(faults, []);
});

test('its controls do what they say', async () => {
  const { page, faults } = await openReady();
  await makeShadowsCoarse(page);
  const changes = async (act) => {
    const light = await sum(page);
    await act();
    await frames(page);
    return (await sum(page)) !== light;
  };
  for (const kind of ['spot', 'area', 'point']) {
    assert.ok(await changes(() => page.click(`#add [data-kind=${kind}]`)), kind);
  }
  assert.equal(await page.locator('#lamps li').count(), 4);
  assert.ok(await page.locator('#add button').first().isDisabled(), 'there is room for four');
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

test('bounced light looks as `rebounce render` draws it', async () => {
  const { page } = await openReady({ width: 320, height: 240 });
  await page.click('#scenes [data-scene=furnished_room]');
  await page.waitForFunction(() => window.rebounce.stage.description.id === 'furnished_room');
  const { compared, off } = await page.evaluate(async ({ given, exposure }) => {
    const { stage, setLights } = window.rebounce;
    while (stage.lamps.length > 0) stage.removeLamp(stage.lamps[0]);
    stage.covered = { above: 0, below: 0 };
    stage.resize();
    stage.renderer.toneMapping = 1;  // linear
    stage.renderer.toneMappingExposure = 2 ** exposure;
    for (const material of stage.lighting.mesh.material) material.needsUpdate = true;
    stage.show('bounced');
    setLights(given);
    const drawn = new Uint8Array(4 * 320 * 240);
    const gl = stage.renderer.getContext();
    gl.readPixels(0, 0, 320, 240, gl.RGBA, gl.UNSIGNED_BYTE, drawn);

    const image = await createImageBitmap(await (await fetch('indirect.png')).blob());
    const canvas = new OffscreenCanvas(320, 240).getContext('2d');
    canvas.drawImage(image, 0, 0);
    const native = canvas.getImageData(0, 0, 320, 240).data;
    const theirs = (x, y, c) => native[4 * (320 * y + x) + c];
    const ours = (x, y, c) => drawn[4 * (320 * (239 - y) + x) + c];
    let compared = 0, off = 0;
    for (let y = 2; y < 238; ++y) {
      for (let x = 2; x < 318; ++x) {
        let edge = 0, most = 0;
        for (let c = 0; c < 3; ++c) {
          for (const [i, j] of [[2, 0], [0, 2], [1, 1], [1, -1], [1, 0], [0, 1]]) {
            for (const at of [theirs, ours]) {
              edge = Math.max(edge, Math.abs(at(x + i, y + j, c) - at(x - i, y - j, c)));
            }
          }
          most = Math.max(most, Math.abs(theirs(x, y, c) - ours(x, y, c)));
        }
        if (edge > 4) continue;
        ++compared;
        if (most > 2) ++off;
      }
    }
    return { compared, off };
  }, { given: roomLights, exposure: roomExposure });
  assert.ok(compared > 0.6 * 320 * 240, `${compared} pixels lie within surfaces`);
  // Silhouettes before what is nearly as bright are taken for surfaces: one in a few thousand.
  assert.ok(off < compared / 2000, `of ${compared} pixels ${off} are off by more than 2 of 255`);
});

test('a surface is drawn with its textures, by the formulas of the light that it bounces', async () => {
  const { page, faults } = await open(undefined, undefined, 'drawing.html');
  const { file, own, casts } = await page.evaluate(() => window.drawn);
  const count = file.dark.length / 3;
  const squaredFrom = (k, z) => ((k + 0.5) / count - 0.5) ** 2 + (0.5 / count) ** 2 + z * z;
  // The lamps of drawing.js on the wall, in lx.
  const spot = (k) => {
    const squared = squaredFrom(k, 0.9), cosine = 0.9 / Math.sqrt(squared);
    const [outer, inner] = [Math.cos(0.5), Math.cos(0.5 * (1 - 0.6))];
    const inside = Math.min(Math.max((cosine - outer) / (inner - outer), 0), 1) ** 2;
    return 2 * cosine / squared * inside * Math.max(0, 1 - (squared / 1.1 ** 2) ** 2);
  };
  const near = (k) => 0.01 * 0.05 / squaredFrom(k, 0.05) ** 1.5;
  for (const [name, light] of Object.entries({ spot, near })) {
    const expected = file.dark.map((dark, k) =>
        dark + reflectance / Math.PI * light(Math.floor(k / 3)));
    const most = Math.max(...expected.map((value, k) => value - file.dark[k]));
    const off = (drawn) => Math.max(...drawn.map((value, k) => Math.abs(value - expected[k]))) / most;
    assert.ok(off(file[name]) < 0.01, `${name}: off by ${off(file[name])}`);
    // A standard material is a little glossy.
    assert.ok(off(own[name]) < 0.1, `${name}, on a mesh of its own: off by ${off(own[name])}`);
  }
  [count / 4, 3 * count / 4].forEach((pixel, half) => {
    const drawn = file.dark.slice(3 * pixel, 3 * pixel + 3);
    assert.ok(drawn.every((value, c) => Math.abs(value - emitted[half][c]) < 0.05), `${drawn}`);
  });
  assert.deepEqual(casts, [true, false]);
  assert.deepEqual(faults, []);
});

test('Gauss-Seidel beside falls behind a switched lamp, and catches up', async () => {
  const { page, faults } = await openReady();
  await makeShadowsCoarse(page);
  await page.click('#compare [data-kind=gauss-seidel]');
  await page.waitForSelector('#halves .half');
  const errors = () => page.evaluate(() => {
    const { stage } = window.rebounce;
    stage.frame();
    const { ours, theirs } = stage.comparison;
    return { ours: ours.error, theirs: theirs.error, behind: theirs.lag.frames };
  });
  const settle = () => page.waitForFunction(() => {
    const { theirs } = window.rebounce.stage.comparison;
    return theirs.lag.frames === 0 && theirs.error < 0.01;
  });
  await settle();
  await page.evaluate(() => window.rebounce.stage.move(
      window.rebounce.stage.lamps[0], window.rebounce.stage.bounds.max));
  const { ours, theirs, behind } = await errors();
  assert.ok(theirs > 0.03 && behind > 0, `theirs: ${theirs}`);
  assert.ok(ours < 0.02, `ours: ${ours}`);
  await settle();
  assert.match(await page.textContent('#halves .half:last-child'), /after \d+ frames/);
  await page.locator('#pace').fill('4');
  assert.match(await page.textContent('#pace-text'), /4 sweeps/);
  await page.click('#compare [data-kind=""]');
  assert.ok(await page.locator('#halves .half').first().isHidden());
  assert.deepEqual(faults, []);
});

test("three.js's grid of probes beside is baked anew when a lamp is switched, and shows its error", async () => {
  const { page, faults } = await openReady();
  await makeShadowsCoarse(page);
  // Fewer probes than the page has: their drawing is slow without a graphics card.
  await page.evaluate(() => window.rebounce.compare('probes', { probeCount: 60 }));
  assert.equal(await page.locator('#compare [aria-pressed=true]').textContent(), 'Probes');
  await page.locator('#pace').fill('32');
  assert.match(await page.textContent('#pace-text'), /32 probes/);
  const settle = () => page.waitForFunction(() => {
    const { theirs } = window.rebounce.stage.comparison;
    return theirs.lag.frames === 0 && theirs.lag.settled > 0;
  });
  await settle();
  const { frames: lag, theirs, ours } = await page.evaluate(() => {
    const { comparison, lamps } = window.rebounce.stage;
    const errors = { theirs: comparison.theirs.error, ours: comparison.ours.error };
    lamps[0].color = '#ff0000';
    window.rebounce.stage.frame();
    return { ...errors, frames: comparison.theirs.lag.frames };
  });
  assert.ok(ours < 0.02, `ours: ${ours}`);
  // Few bounces and probes half a cell off the surface: wrong, but not by all of it.
  assert.ok(theirs > 0.05 && theirs < 0.8, `theirs: ${theirs}`);
  assert.equal(lag, 1);
  assert.match(await page.textContent('#halves .half:last-child'), /LightProbeGrid.*probes/);
  await settle();
  await page.click('#compare [data-kind=gauss-seidel]');
  await page.waitForFunction(() => window.rebounce.stage.comparison.kind === 'gauss-seidel');
  await page.click('#compare [data-kind=""]');
  assert.ok(await page.locator('#halves .half').first().isHidden());
  assert.deepEqual(faults, []);
});

test('it works by keyboard', async () => {
  const { page, faults } = await openReady();
  await makeShadowsCoarse(page);
  const state = () => page.evaluate(() => {
    const { lamps, ball, chosen, camera, comparison } = window.rebounce.stage;
    return {
      lamps: lamps.length, on: lamps[0].on, chosen: chosen === ball ? 'ball' : lamps.indexOf(chosen),
      ball: ball.object.position.x, camera: camera.position.x, comparison: comparison?.kind,
    };
  });
  const press = async (key) => {
    await page.keyboard.press(key);
    await frames(page);
    return state();
  };
  await page.focus('#view');
  const before = await state();
  assert.deepEqual([before.lamps, before.chosen, before.on], [1, 0, true]);
  assert.equal((await press('o')).on, false);
  assert.equal((await press('o')).on, true);
  assert.equal((await press('a')).lamps, 2);
  assert.equal(await page.locator('#lamps [aria-current=true]').count(), 1);
  assert.equal((await press('n')).chosen, 'ball');
  assert.equal(await page.locator('#lamps [aria-current=true]').count(), 0);
  assert.equal(await page.textContent('#chosen'), 'The ball is chosen');
  assert.notEqual((await press('ArrowRight')).ball, before.ball);
  assert.notEqual((await press('Shift+ArrowRight')).camera, before.camera);
  await page.focus('#lamps li:first-child input[type=range]');
  assert.equal((await state()).chosen, 0, 'the lamp whose slider has the focus');
  const focused = () => page.evaluate(() => document.activeElement.getAttribute('aria-label'));
  for (const on of [false, true]) assert.equal((await press('o')).on, on);
  assert.equal(await focused(), 'Point 1: brightness');
  await page.focus('#lamps li:last-child .remove');
  assert.equal((await press('Enter')).lamps, 1);
  assert.equal(await focused(), 'Point 1: remove');
  await page.keyboard.press('c');
  await page.waitForFunction(() => window.rebounce.stage.comparison?.kind === 'gauss-seidel');
  assert.equal((await press('c')).comparison, undefined);
  assert.deepEqual(faults, []);
});

test('the ball is lit by probes, and can be dragged', async () => {
  const { page, faults } = await openReady();
  await page.click('#parts [data-part=bounced]');
  const pixel = () => page.evaluate(() => {
    const { stage } = window.rebounce;
    for (const lamp of stage.lamps) lamp.object.children[0].intensity = 0;  // for three.js alone
    stage.draw();
    const at = stage.ball.object.position.clone().project(stage.camera);
    const gl = stage.renderer.getContext();
    const value = new Uint8Array(4);
    gl.readPixels((at.x + 1) / 2 * gl.drawingBufferWidth, (at.y + 1) / 2 * gl.drawingBufferHeight,
                  1, 1, gl.RGBA, gl.UNSIGNED_BYTE, value);
    return [...value];
  });
  const [red, green] = await pixel();
  assert.ok(red > 20 && green > 10, `${red}, ${green}`);
  const to = await page.evaluate(() => {
    const { stage } = window.rebounce;
    stage.move(stage.ball, stage.bounds.min.clone().setY(stage.ball.home.y));
    return stage.ball.object.position.x - stage.bounds.min.x;
  });
  assert.ok(to > 0 && to < 0.1, 'within the scene');
  assert.deepEqual(faults, []);
});

test('keys wait for the scene, and do not repeat', async () => {
  let answer;
  const isPressed = new Promise((resolve) => { answer = resolve; });
  const wait = async (route) => {
    await isPressed;
    await route.continue();
  };
  const { page, faults } = await open(undefined, (made) => made.route('**/*.safetensors', wait));
  for (const key of ['1', 'a', 'n', 'o', 'c', 'g', ' ', 'ArrowLeft']) await page.keyboard.press(key);
  assert.ok(await page.locator('#message').isHidden());
  assert.ok(await page.locator('#loading').isVisible());
  answer();
  await page.evaluate(() => window.rebounce.ready);
  await page.waitForSelector('#loading', { state: 'hidden' });
  assert.equal(await page.locator('#lamps li').count(), 1);
  for (let k = 0; k < 3; ++k) await page.keyboard.down('a');
  await page.keyboard.up('a');
  assert.equal(await page.locator('#lamps li').count(), 2);
  assert.deepEqual(faults, []);
});

test('a lamp follows the pointer that holds it alone, and swings within the scene', async () => {
  const { page, faults } = await openReady();
  const home = () => page.evaluate(() => window.rebounce.stage.lamps[0].home.toArray());
  const apart = (a, b) => Math.hypot(...a.map((x, k) => x - b[k]));
  const lamp = await lampPlace(page);
  await page.mouse.move(lamp.x, lamp.y);
  await page.mouse.down();
  const first = await home();
  await page.evaluate(({ x, y }) => {
    for (const type of ['pointerdown', 'pointermove', 'pointerup']) {
      document.getElementById('view').dispatchEvent(
          new PointerEvent(type, { pointerId: 77, clientX: x - 80, clientY: y, bubbles: true }));
    }
  }, lamp);
  assert.deepEqual(await home(), first, 'by another finger');
  await page.mouse.move(lamp.x - 30, lamp.y);
  await frames(page);
  assert.ok(apart(await home(), first) > 0.01, 'by the first one');
  await page.mouse.up();

  const second = await home();
  const swung = await page.evaluate(() => {
    const { stage, setLights } = window.rebounce;
    stage.toggleSwing();
    stage.begun = performance.now() - 924;  // a quarter of its way from side to side
    stage.frame();
    setLights([]);  // no more frames
    return stage.lamps[0].object.position.toArray();
  });
  assert.ok(apart(swung, second) > 0.05);
  const place = await lampPlace(page);
  await page.mouse.move(place.x, place.y);
  await page.mouse.down();
  await page.mouse.move(place.x + 2, place.y);
  await frames(page);
  const moved = apart(await home(), second);
  assert.ok(moved > 0 && moved < 0.03, `moved by ${moved}`);
  await page.mouse.up();

  const isInside = await page.evaluate(() => {
    const { stage } = window.rebounce;
    stage.move(stage.lamps[0], stage.bounds.max);
    return [0, 1, 2, 3].map((k) => {
      stage.begun = performance.now() - 924 * k;
      stage.frame();
      return stage.things.every(({ object }) => stage.bounds.containsPoint(object.position));
    });
  });
  assert.deepEqual(isInside, [true, true, true, true]);
  assert.deepEqual(faults, []);
});

test('frames that were stopped go on once', async () => {
  const { page, faults } = await openReady();
  const count = await page.evaluate(async () => {
    const { stage, setLights, resume } = window.rebounce;
    for (let k = 0; k < 3; ++k) {
      setLights([]);
      resume();
    }
    let drawn = 0;
    const frame = stage.frame.bind(stage);
    stage.frame = () => {
      ++drawn;
      return frame();
    };
    for (let k = 0; k < 5; ++k) await new Promise((resolve) => { requestAnimationFrame(resolve); });
    return drawn;
  });
  assert.equal(count, 5);
  assert.deepEqual(faults, []);
});

test('the comparison that was asked for last is shown, whichever file comes first', async () => {
  const { page, faults } = await openReady();
  await makeShadowsCoarse(page);
  const found = await page.evaluate(async () => {
    const { stage, compare } = window.rebounce;
    const kind = () => stage.comparison?.kind ?? 'none';
    stage.chosen = stage.ball;
    await compare('gauss-seidel');
    const [twin] = stage.comparison.objects;
    const isHeld = stage.movable.includes(stage.ball) || stage.chosen === stage.ball;
    await compare('');
    await compare('gauss-seidel');
    const isSame = stage.comparison.objects[0] === twin;
    await compare('');

    const { transfer } = stage.lighting;
    const load = transfer.loadSolver.bind(transfer);
    const waiting = window.waiting = [];
    transfer.loadSolver = async (...given) => {
      await new Promise((resolve) => { waiting.push(resolve); });
      return load(...given);
    };
    const cancelled = compare('gauss-seidel');
    await compare('');
    waiting[0]();
    await cancelled;
    const none = kind();
    const [first, last] = [compare('gauss-seidel'), compare('probes', { probeCount: 60 })];
    waiting[2]();
    await last;
    waiting[1]();
    await first;
    const probes = kind();
    await compare('');
    window.late = compare('gauss-seidel');
    return { isHeld, isSame, none, probes };
  });
  assert.deepEqual(found, { isHeld: false, isSame: true, none: 'none', probes: 'probes' });
  // Its scene is gone when the file comes.
  await page.click('#scenes [data-scene=furnished_room]');
  await page.waitForFunction(() => window.rebounce.stage.description.id === 'furnished_room');
  await page.evaluate(() => {
    window.waiting[3]();
    return window.late;
  });
  assert.ok(await page.locator('#message').isHidden());
  assert.equal(await page.evaluate(() => window.rebounce.stage.comparison), null);
  await page.waitForSelector('#loading', { state: 'hidden' });
  assert.deepEqual(faults, []);
});

test('a scene that fails after another was asked for says nothing', async () => {
  const { page } = await openReady();
  let fail;
  const failure = new Promise((resolve) => { fail = resolve; });
  await page.route('**/pavilion.safetensors', async (route) => {
    await failure;
    await route.fulfill({ status: 404 });
  });
  await page.click('#scenes [data-scene=pavilion]');
  await page.click('#scenes [data-scene=furnished_room]');
  await page.waitForFunction(() => window.rebounce.stage.description.id === 'furnished_room');
  const answer = page.waitForResponse('**/pavilion.safetensors');
  fail();
  await answer;
  await frames(page);
  assert.ok(await page.locator('#message').isHidden());
  assert.equal(await page.evaluate(() => window.rebounce.stage.description.id), 'furnished_room');
});

test('the server refuses what it cannot read, and answers on', async () => {
  for (const [path, status] of [['%', 400], ['/', 400], ['nothing', 404], ['', 200]]) {
    const response = await fetch(server.url + path);
    await response.text();
    assert.equal(response.status, status, `/${path}`);
  }
});

test('600 frames take no further memory', async () => {
  const { page, faults } = await openReady({ width: 160, height: 120 });
  await makeShadowsCoarse(page);
  const memoryAfter = (count) => page.evaluate((most) => {
    const { stage } = window.rebounce;
    stage.swinging = true;
    for (let k = 0; k < most; ++k) stage.frame();
    // Pages share what draws: the next one would wait until these frames are drawn.
    const gl = stage.renderer.getContext();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
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
  rmSync(bad);
  await page.click('#scenes [data-scene=pavilion]');
  await page.click('#message button:text("Close")');
  assert.ok(await page.locator('#message').isHidden(), 'what was shown goes on');
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
  // A scene that comes late says and draws nothing.
  await page.evaluate(() => {
    window.drawn = 0;
    window.rebounce.stage.frame = () => ++window.drawn;
    document.querySelector('#scenes [data-scene=furnished_room]').click();
  });
  await page.waitForFunction(() => location.hash === '#furnished_room');
  await frames(page);
  assert.match(await page.textContent('#message'), /graphics card/);
  assert.ok(await page.locator('#message').isVisible());
  assert.equal(await page.evaluate(() => window.drawn), 0);
});
