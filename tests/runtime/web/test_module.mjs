// The runtime as WebAssembly against the native one. Usage: node test_module.mjs FOLDER

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { lights, sky, skipWithout, web } from './support.mjs';

const folder = process.argv[2];
const scene = join(folder, 'cornell_box.safetensors');
skipWithout(join(folder, 'native.csv'), 'module; see the test WebBuild');

const { RebounceError, Transfer } = await import(join(web, 'library/rebounce.js'));
const { Instance } = await import(join(web, 'library/instance.js'));
const bytes = new Uint8Array(readFileSync(scene));
const ofPage = (name) => {
  const { buffer } = new Uint8Array(readFileSync(join(folder, 'page/scenes', name)));
  return buffer;
};
const load = (changed = bytes) => Transfer.load(changed.slice().buffer, { name: 'box' });

/** The columns of a table whose names begin with `name`, row by row. */
function columns(table, name) {
  const [head, ...rows] = table.trim().split('\n').map((line) => line.split(','));
  const wanted = head.flatMap((title, k) => (title.startsWith(name) ? [k] : []));
  return rows.flatMap((row) => wanted.map((k) => Number(row[k])));
}

test('its light is that of the native library', async () => {
  const transfer = await load();
  const engine = transfer.createEngine();
  engine.relight(lights, sky);
  const native = readFileSync(join(folder, 'native.csv'), 'utf8');
  for (const [name, light] of [
    ['direct_irradiance', engine.directIrradiance()],
    ['indirect_irradiance', engine.indirectIrradiance()],
    ['radiosity', engine.radiosity()],
  ]) {
    const expected = columns(native, name);
    assert.equal(light.length, expected.length);
    const mean = expected.reduce((a, b) => a + b) / expected.length;
    assert.ok(mean > 1, `${name}: the test shows something`);
    const largest = expected.reduce((most, x, k) => Math.max(most, Math.abs(x - light[k])), 0);
    assert.ok(largest < 1e-4 * mean, `${name}: ${largest} of a mean of ${mean}`);
  }
  engine.dispose();
  transfer.dispose();
});

test('the file for pages, packed and with shorter weights, gives the same light', async () => {
  const whole = await load();
  const packed = await Transfer.load(ofPage('cornell_box.safetensors'));
  const [one, other] = [whole, packed].map((transfer) => transfer.createEngine());
  one.relight(lights, sky);
  other.relight(lights, sky);
  assert.deepEqual(other.indirectIrradiance(), one.indirectIrradiance());
  const [exact, shorter] = [one, other].map((engine) => engine.vertexIrradiance().slice());
  const mean = exact.reduce((a, b) => a + b) / exact.length;
  exact.forEach((x, k) => assert.ok(Math.abs(x - shorter[k]) < 1e-2 * mean));
  for (const engine of [one, other]) engine.dispose();
  for (const transfer of [whole, packed]) transfer.dispose();
});

test('direct light can be split by lamps', async () => {
  const transfer = await load();
  const engine = transfer.createEngine();
  engine.relight(lights, sky);
  const direct = engine.vertexDirectIrradiance(), all = direct.slice();
  engine.vertexIrradiance();
  assert.deepEqual(direct, all, 'each result has a place of its own');
  for (const count of [3, 100]) {
    assert.throws(() => engine.vertexDirectIrradianceOf(Array(count).fill(1)),
                  new RegExp(`${count} numbers.* 4 lights`));
  }
  const every = engine.vertexDirectIrradianceOf(lights.map(() => 1)).slice();
  assert.deepEqual(every, all);
  const some = engine.vertexDirectIrradianceOf([0, 1, 0, 0]).slice();
  engine.relight([lights[1]], sky);
  assert.deepEqual(engine.vertexDirectIrradiance(), some);
  assert.ok(some.some((x, k) => x < all[k]));
  engine.dispose();
  transfer.dispose();
});

test('light at probes is that of the patches around', async () => {
  const transfer = await Transfer.load(ofPage('cornell_box.safetensors'));
  assert.deepEqual(transfer.probes.grid, [4, 4, 4]);
  const engine = transfer.createEngine();
  assert.equal(engine.probeCount, 64);
  engine.relight(lights, sky);
  const light = engine.probeLight();
  const { valid } = transfer.probes;
  assert.ok(valid.includes(1));
  valid.forEach((is, k) => assert.equal(light[27 * k + 1] > 0, is === 1, `probe ${k}`));
  engine.dispose();
  transfer.dispose();
});

test('Gauss-Seidel converges to the light of the engine, and follows it from frame to frame', async () => {
  const transfer = await Transfer.load(ofPage('cornell_box.safetensors'));
  const engine = transfer.createEngine();
  await assert.rejects(transfer.loadSolver(ofPage('cornell_box.safetensors')), /not a file of form/);
  const solver = await transfer.loadSolver(ofPage('cornell_box.form_factors.safetensors'));
  engine.relight([lights[0]]);
  assert.ok(solver.converge(engine) < 0.01);
  assert.ok(solver.sweep(engine, 100).error < 1e-4);
  engine.relight([lights[1], lights[2]]);
  const engineError = solver.converge(engine);
  const first = solver.sweep(engine, 1), second = solver.sweep(engine, 1);
  assert.ok(first.error > 0.05 && second.error < 0.7 * first.error, `${first.error}, ${second.error}`);
  assert.ok(engineError < 0.01, `${engineError}`);
  assert.equal(solver.errorOf(engine.indirectIrradiance()), engineError);
  assert.throws(() => solver.errorOf(engine.indirectIrradiance().subarray(0, 30)), /30 numbers/);
  solver.sweep(engine, 100);
  const [swept, ours] =
      [solver.vertexIrradiance().slice(), engine.vertexIrradiance()];
  const mean = ours.reduce((a, b) => a + b) / ours.length;
  swept.forEach((x, k) => assert.ok(Math.abs(x - ours[k]) < 0.2 * mean));
  solver.dispose();
  engine.dispose();
  transfer.dispose();
});

test('what is out of range is refused, and the last frame stays', async () => {
  const transfer = await load();
  const engine = transfer.createEngine();
  engine.relight(lights);
  const before = engine.indirectIrradiance().slice();
  for (const [bad, message] of [
    [[{}, { intensity: -1 }], /light 1: .*intensity/], [[{ type: 'sphere' }], /light 0: .*radius/],
    [[{ type: 'candle' }], /candle/], [[{}, { color: [1, 0.8, 0.6, 1] }], /light 1: color .*three/],
    [[{ position: [1, 2] }], /light 0: position/], [[{ direction: 1 }], /light 0: direction/],
  ]) {
    assert.throws(() => engine.relight(bad), (error) => {
      assert.ok(error instanceof RebounceError);
      assert.match(error.message, message);
      return true;
    });
  }
  assert.throws(() => engine.relight(lights, { color: [1, 1] }), /sky: color/);
  assert.throws(() => engine.setSky(12, [0, -1]), /sunDirection/);
  assert.throws(() => engine.skyPanorama(12, [], 2, 2), /sunDirection/);
  assert.throws(() => engine.setEmissionScale(0, [1]), /scale/);
  assert.throws(() => engine.setSky(99, [0, -1, 0]), RebounceError);
  assert.throws(() => engine.setEmissionScale(1000, [1, 1, 1]), /material/);
  assert.deepEqual(engine.indirectIrradiance(), before);
  assert.throws(() => engine.vertexDirectIrradianceOf([1, 1]), /2 numbers.* 4 lights/);
  assert.deepEqual(engine.vertexDirectIrradianceOf(lights.map(() => 1)).slice(),
                   engine.vertexDirectIrradiance());
  engine.relight(lights);
  assert.deepEqual(engine.indirectIrradiance(), before);
  engine.dispose();
  transfer.dispose();
});

test('what has been disposed of is refused', async () => {
  const isRefused = (error) => error instanceof RebounceError && /disposed of/.test(error.message);
  const formFactors = () => ofPage('cornell_box.form_factors.safetensors');
  const transfer = await Transfer.load(ofPage('cornell_box.safetensors'), { name: 'box' });
  const engine = transfer.createEngine();
  const solver = await transfer.loadSolver(formFactors());
  const late = transfer.loadSolver(formFactors());
  transfer.dispose();
  await assert.rejects(late, isRefused);
  assert.throws(() => transfer.createEngine(), isRefused);
  engine.relight(lights, sky);  // goes on without the file
  const light = engine.indirectIrradiance().slice();
  engine.dispose();
  for (const call of [
    () => engine.relight(lights), () => engine.relight(Array(100).fill(lights[0])),
    () => engine.setSky(12, [0, -1, 0]), () => engine.skyPanorama(12, [0, -1, 0], 2, 2),
    () => engine.setUniformSky(), () => engine.setSkyAboveGround(0.5),
    () => engine.setEmissionScale(0, [1, 1, 1]), () => engine.directIrradiance(),
    () => engine.indirectIrradiance(), () => engine.radiosity(), () => engine.vertexIrradiance(),
    () => engine.vertexDirectIrradiance(),
    () => engine.vertexDirectIrradianceOf(lights.map(() => 1)),
    () => engine.chosenDirectIrradiance(), () => engine.probeLight(),
    () => solver.converge(engine), () => solver.sweep(engine, 1),
  ]) {
    assert.throws(call, isRefused, String(call));
  }
  solver.dispose();
  assert.throws(() => solver.errorOf(light), isRefused);
  assert.throws(() => solver.vertexIrradiance(), isRefused);
  for (const one of [solver, engine, transfer]) one.dispose();  // a second time
});

test('loads at once share one instance, and a failure is not kept', async (t) => {
  const { Instance: Fresh } = await import(`${join(web, 'library/instance.js')}?fresh`);
  const { mock } = t.mock.method(WebAssembly, 'validate', () => false);
  await assert.rejects(Fresh.get(), /lacks SIMD/);
  mock.restore();
  const [one, other] = await Promise.all([Fresh.get(), Fresh.get()]);
  assert.ok(one === other);
  assert.throws(() => one.call('nothing'), /has stopped/);
  assert.ok(await Fresh.get() !== one, 'a new one after that broke');
});

test('a file that is damaged is refused with a reason', async () => {
  for (const size of [0, 4, 100, bytes.length / 2 | 0, bytes.length - 1]) {
    await assert.rejects(load(bytes.subarray(0, size)), RebounceError);
  }
  const flipped = bytes.slice();
  flipped[bytes.length - 100] ^= 1;
  await assert.rejects(load(flipped), /checksum/);
  await assert.rejects(load(new TextEncoder().encode('<html>Not found</html>')), RebounceError);
});

test('what is made is freed where memory ends before it is kept', async (t) => {
  const instance = await Instance.get();
  const transfer = await Transfer.load(ofPage('cornell_box.safetensors'));
  const engine = transfer.createEngine();
  const { call } = instance;
  const frees = /^(free|.*_(destroy|release))$/, makes = /^(malloc|.*_(create|read))$/;
  let held = 0, left = Infinity;  // objects and pieces of memory, and pieces that there are yet
  const { mock } = t.mock.method(instance, 'call', (name, ...args) => {
    if (name === 'malloc' && --left < 0) return 0;
    const result = call.call(instance, name, ...args);
    if (name === 'malloc' || (makes.test(name) && result === 0)) ++held;
    if (frees.test(name) && args[0]) --held;
    return result;
  });
  for (const [make, least] of [
    [() => transfer.createEngine(), 9],
    [() => transfer.loadSolver(ofPage('cornell_box.form_factors.safetensors')), 6],
    [() => Transfer.load(ofPage('cornell_box.safetensors')), 3],
    [async () => engine.setSky(12, [0, -1, 0]), 2],
  ]) {
    held = 0;
    let failures = -1, made;
    do {
      left = ++failures;
      made = await Promise.resolve().then(make).catch((error) => {
        assert.match(error.message, /out of memory/);
        assert.equal(held, 0, `${failures} pieces`);
        return error;
      });
    } while (made instanceof Error);
    assert.ok(failures >= least, `${failures} pieces`);
    made?.dispose();
    assert.equal(held, 0);
  }
  mock.restore();
  for (const one of [engine, transfer]) one.dispose();
});

test('600 frames and 20 loads take no further memory', async () => {
  const instance = await Instance.get();
  const transfer = await load();
  const engine = transfer.createEngine();
  const moved = (k) => [{ ...lights[0], position: [0.1 + 0.0005 * k, 0.3, 0.2] }, lights[2]];
  engine.relight(moved(0));
  const before = instance.memoryBytes;
  for (let k = 0; k < 600; ++k) {
    engine.relight(moved(k), sky);
    engine.vertexIrradiance();
  }
  assert.equal(instance.memoryBytes, before);
  engine.dispose();
  transfer.dispose();
  for (let k = 0; k < 20; ++k) {
    const again = await load();
    again.createEngine().dispose();
    again.dispose();
  }
  assert.ok(instance.memoryBytes <= before + (1 << 20), 'what is disposed of is free');
});

test('addresses beyond 2 GiB give the same light', async () => {
  const instance = await Instance.get();
  const lightOf = async () => {
    const transfer = await load();
    const engine = transfer.createEngine();
    engine.relight(lights, sky);
    const light = engine.indirectIrradiance(), copy = light.slice();
    assert.throws(() => engine.relight([{ intensity: -1 }]), /intensity/);
    engine.dispose();
    transfer.dispose();
    return { copy, address: light.byteOffset };
  };
  const below = await lightOf();
  const held = Array.from({ length: 4 }, () => instance.allocate(2 ** 29));
  do held.push(instance.allocate(2 ** 10)); while (held.at(-1) < 2 ** 31);  // what is free below
  const beyond = await lightOf();
  for (const address of held) instance.release(address);
  assert.ok(below.address < 2 ** 31 && beyond.address > 2 ** 31, `${beyond.address}`);
  assert.deepEqual(beyond.copy, below.copy);
});

test('the module is small', () => {
  const text = readFileSync(join(web, 'library/wasm.js'), 'utf8');
  const packed = Buffer.from(/'([^']+)'/.exec(text)[1], 'base64');
  assert.ok(packed.length < 200e3, `${packed.length} bytes`);
});
