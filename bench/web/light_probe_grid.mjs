// Rebounce beside three.js's LightProbeGridWebGL, in Chromium: frames until a switched lamp is
// right, error against the path tracer, light that leaks through a wall. Usage:
//   node light_probe_grid.mjs TRANSFER LIGHTS POINTS.csv OUT_FOLDER
// TRANSFER is that of `precompute tests/scenes/two_rooms.gltf --for web`, POINTS the table of
// `bench_truth --point-csv` under the same LIGHTS.

import { copyFileSync, mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { chromiumPath, launchArguments } from '../../tests/runtime/web/support.mjs';

const [, , transfer, lightFile, pointFile, out] = process.argv;
const web = fileURLToPath(new URL('../../runtime/web', import.meta.url));
const { chromium } = await import(join(web, 'node_modules/playwright-core/index.mjs'));
const { build } = await import(join(web, 'node_modules/esbuild/lib/main.js'));
const { serve } = await import(join(web, 'serve.mjs'));

mkdirSync(out, { recursive: true });
copyFileSync(transfer, join(out, 'scene.safetensors'));
await build({
  entryPoints: [fileURLToPath(new URL('light_probe_grid_page.js', import.meta.url))],
  outfile: join(out, 'page.js'), bundle: true, format: 'esm', target: 'es2022', logLevel: 'error',
  nodePaths: [join(web, 'node_modules')],
});
writeFileSync(join(out, 'index.html'), '<!doctype html><script type="module" src="page.js"></script>');

/** The rows of a table, as objects. */
function readTable(file) {
  const [head, ...rows] = readFileSync(file, 'utf8').trim().split('\n').map((line) => line.split(','));
  return rows.map((row) => Object.fromEntries(head.map((name, k) => [name, Number(row[k])])));
}
const vector = (row, name) => [0, 1, 2].map((k) => row[`${name}_${k}`]);
const points = readTable(pointFile).map((row) => ({
  position: vector(row, 'position'), normal: vector(row, 'normal'), shown: vector(row, 'shown'),
  truth: vector(row, 'truth'), noise: vector(row, 'noise'),
}));

const server = await serve(out);
const browser = await chromium.launch({ executablePath: chromiumPath, args: launchArguments });
const page = await browser.newPage({ viewport: { width: 960, height: 400 } });
page.on('pageerror', (error) => console.error(String(error)));
await page.goto(server.url);
await page.waitForFunction(() => window.bench !== undefined, null, { timeout: 120000 });

const square = (a) => a.reduce((sum, x) => sum + x * x, 0);

/** Relative L2 against the truth, less its noise. */
function errorOf(values, chosen = points.map(() => true)) {
  let off = 0, all = 0;
  points.forEach(({ truth, noise }, k) => {
    if (!chosen[k]) return;
    off += square(values[k].map((x, c) => x - truth[c])) - square(noise);
    all += square(truth) - square(noise);
  });
  return Math.sqrt(Math.max(0, off) / all);
}
const meanOf = (values, chosen) => {
  const some = values.filter((value, k) => chosen[k]);
  return some.reduce((sum, value) => sum + (value[0] + value[1] + value[2]) / 3, 0) / some.length;
};

// Behind the partition of two_rooms.gltf, away from the door, on the floor, the walls and itself.
const behind = points.map(({ position: [x, , z] }) =>
    x > 4.19 && x < 4.8 && (z < 1.2 || z > 2.8));
const lights = JSON.parse(readFileSync(lightFile, 'utf8')).lights;
const rows = [];
function add(name, frames, values) {
  rows.push({
    name, frames, error: errorOf(values),
    behindError: errorOf(values, behind),
    behind: meanOf(values, behind) / meanOf(points.map(({ truth }) => truth), behind),
  });
  console.log(JSON.stringify(rows.at(-1)));
}

await page.evaluate((given) => window.bench.start(given), lights);
await page.screenshot({ path: join(out, 'rebounce.png') });
// One frame by construction, as `update` is complete; the light is that of the program.
add('Rebounce', 1, points.map(({ shown }) => shown));
for (const [grid, bounces] of [[[10, 7, 7], 1], [[10, 7, 7], 2], [[20, 7, 10], 2]]) {
  const { frames, values } = await page.evaluate(
      (given) => window.bench.bake(given),
      { grid, bounces, points: points.map(({ position, normal }) => ({ position, normal })) });
  await page.screenshot({ path: join(out, `grid_${grid.join('x')}_${bounces}.png`) });
  add(`${grid.join(' x ')} probes, ${bounces} further bounces`, frames, values);
}
await browser.close();
server.close();
