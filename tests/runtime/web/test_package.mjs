// The package in a fresh project, with a bundler and without. Usage: node test_package.mjs FOLDER

import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { copyFileSync, mkdirSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { chromiumPath, launchArguments, root, skipWithout, web } from './support.mjs';

const folder = process.argv[2];
const project = join(folder, 'project');
skipWithout(join(folder, 'native.csv'), 'module; see the test WebBuild');
skipWithout(chromiumPath, 'Chromium');

const { chromium } = await import(join(web, 'node_modules/playwright-core/index.mjs'));
const { build } = await import(join(web, 'node_modules/esbuild/lib/main.js'));
const { serve } = await import(join(web, 'serve.mjs'));
const versions = JSON.parse(readFileSync(join(web, 'package.json'), 'utf8')).devDependencies;

const app = `
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { TransferLighting } from 'rebounce/three';

const lighting = await TransferLighting.load('cornell_box.safetensors');
const renderer = new THREE.WebGLRenderer({ preserveDrawingBuffer: true });
renderer.setSize(64, 64);
renderer.toneMappingExposure = 0.01;
const scene = new THREE.Scene();
scene.add(lighting.mesh);
const camera = new THREE.PerspectiveCamera(40, 1, 0.01, 10);
camera.position.set(0.278, 0.273, -0.8);
camera.lookAt(0.278, 0.273, 0);
const lamp = new THREE.PointLight('white', 20);
lamp.position.set(0.2, 0.4, 0.2);
scene.add(lamp);

function brightness() {
  scene.updateMatrixWorld();
  lighting.update([lamp]);
  renderer.render(scene, camera);
  const gl = renderer.getContext();
  const pixels = new Uint8Array(4 * 64 * 64);
  gl.readPixels(0, 0, 64, 64, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  return pixels.reduce((sum, value, k) => sum + (k % 4 < 3 ? value : 0), 0) / (3 * 64 * 64);
}
lighting.show(1, 1);
const all = brightness();
lighting.show(1, 0);
const direct = brightness();

// The same with the meshes and materials of the glTF file.
const { scene: own } = await new GLTFLoader().loadAsync('cornell_box.gltf');
lighting.attach(own);
scene.remove(lighting.mesh);
scene.add(own);
const ownDirect = brightness();
lighting.show(1, 1);
window.result = { all, direct, ownDirect, own: brightness() };
`;

const typed = `
import { PointLight, Scene } from 'three';
import { Transfer, type Engine, type Light } from 'rebounce';
import { TransferLighting } from 'rebounce/three';

const lamp: Light = { type: 'spot', position: [0, 1, 0], spot: { outerConeAngle: 0.4 } };
const transfer = await Transfer.load('room.safetensors', { onProgress: (part) => part.toFixed(1) });
const engine: Engine = transfer.createEngine({ pointsPerPatch: 4 });
const product: number = engine.relight([lamp], { luminance: 100 }).product;
const light: Float32Array = engine.indirectIrradiance();
const lighting = await TransferLighting.load(new URL('https://example.org/room.safetensors'));
new Scene().add(lighting.mesh);
lighting.attach(new Scene());
lighting.update([new PointLight(), lamp], { luminance: product * light.length, ground: 0.5 });
// @ts-expect-error: there is no such lamp
engine.relight([{ type: 'candle' }]);
`;

const npm = (...words) => execFileSync('npm', [...words, '--no-audit', '--no-fund', '--silent'], {
  cwd: project, encoding: 'utf8',
});

let server, browser;
before(async () => {
  rmSync(project, { recursive: true, force: true });
  mkdirSync(project, { recursive: true });
  npm('pack', web);
  const [packed] = readdirSync(project).filter((name) => name.endsWith('.tgz'));
  writeFileSync(join(project, 'package.json'), '{ "type": "module", "private": true }');
  npm('install', `./${packed}`, `three@${versions.three}`, 'typescript@5.9.3', '@types/three@0.187.0');
  copyFileSync(join(folder, 'cornell_box.safetensors'), join(project, 'cornell_box.safetensors'));
  copyFileSync(join(root, 'tests/scenes/cornell_box.gltf'), join(project, 'cornell_box.gltf'));
  writeFileSync(join(project, 'app.js'), app);
  writeFileSync(join(project, 'typed.ts'), typed);
  server = await serve(project);
  browser = await chromium.launch({ executablePath: chromiumPath, args: launchArguments });
});
after(async () => {
  await browser?.close();
  server?.close();
});

async function draws(name, html) {
  writeFileSync(join(project, name), `<!doctype html>${html}`);
  const page = await browser.newPage();
  const faults = [];
  page.on('pageerror', (error) => faults.push(String(error)));
  await page.goto(server.url + name);
  await page.waitForFunction(() => window.result !== undefined, null, { timeout: 60000 });
  const { all, direct, ownDirect, own } = await page.evaluate(() => window.result);
  assert.ok(direct > 1 && all > 1.1 * direct, `all light ${all}, direct light ${direct}`);
  // Standard materials are a little glossy where those of the transfer file are not.
  assert.ok(Math.abs(own - all) < 0.1 * all, `all light on meshes of its own ${own}, not ${all}`);
  assert.ok(Math.abs(ownDirect - direct) < 0.1 * direct, `direct light ${ownDirect}, not ${direct}`);
  assert.deepEqual(faults, []);
}

test('it draws without a bundler', async () => {
  const imports = {
    three: './node_modules/three/build/three.module.js',
    'three/addons/': './node_modules/three/examples/jsm/',
    'rebounce/three': './node_modules/rebounce/library/transfer_lighting.js',
  };
  await draws('plain.html', `<script type="importmap">${JSON.stringify({ imports })}</script>
<script type="module" src="app.js"></script>`);
});

test('it draws with a bundler', async () => {
  await build({
    entryPoints: [join(project, 'app.js')], outfile: join(project, 'bundle.js'), bundle: true,
    format: 'esm', target: 'es2022', logLevel: 'error',
  });
  await draws('bundled.html', '<script type="module" src="bundle.js"></script>');
});

test('its declarations are those of what it does', () => {
  execFileSync('node', [
    'node_modules/typescript/bin/tsc', '--noEmit', '--strict', '--target', 'es2022', '--module',
    'nodenext', '--lib', 'es2022,dom', '--skipLibCheck', 'typed.ts',
  ], { cwd: project, stdio: 'inherit' });
});
