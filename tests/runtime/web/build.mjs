// Builds the module and the page, with a small scene. Usage: node build.mjs PROGRAM FOLDER

import { execFileSync } from 'node:child_process';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { lights, roomExposure, roomLights, root, sky, skipWithout, web } from './support.mjs';
import { texturedScene } from './textured_scene.mjs';

const [, , program, folder] = process.argv;
skipWithout('/usr/bin/clang++-19', 'clang++-19');
skipWithout('/usr/include/wasm32-wasi/c++/v1/vector', 'libc++-19-dev-wasm32');
skipWithout(join(web, 'node_modules/three/package.json'), 'node_modules; run ./dev web');

const run = (...command) =>
    execFileSync(command[0], command.slice(1), { stdio: 'inherit', cwd: root });
const module = join(folder, 'module');
run('cmake', '-S', web, '-B', module, '-G', 'Ninja',
    `-DCMAKE_TOOLCHAIN_FILE=${join(web, 'wasi.cmake')}`);
run('cmake', '--build', module);
run('node', join(web, 'pack_module.mjs'), join(module, 'rebounce.wasm'));

const page = join(folder, 'page');
run('node', join(web, 'build_page.mjs'), page);
const { build } = await import(join(web, 'node_modules/esbuild/lib/main.js'));
await build({
  entryPoints: [join(root, 'tests/runtime/web/drawing.js')], outfile: join(page, 'drawing.js'),
  bundle: true, format: 'esm', target: 'es2022', nodePaths: [join(web, 'node_modules')],
  logLevel: 'error',
});
writeFileSync(join(page, 'drawing.html'), `<!doctype html><link rel="icon" href="data:,">
<script type="module" src="drawing.js"></script>`);
const scene = join(folder, 'cornell_box.safetensors');
const precomputeFile = (path, file, ...options) => run(
    program, 'precompute', path, '--patches', '500', '--quality', 'low', '--quiet', '-o', file,
    ...options);
const precompute = (name, ...rest) => precomputeFile(`tests/scenes/${name}.gltf`, ...rest);
precompute('cornell_box', scene);
precompute('cornell_box', join(page, 'scenes/cornell_box.safetensors'), '--for', 'web',
           '--compress-form-factors', '0.001', '--probes', '4,4,4', '--probe-rays', '96');
// Pages show no rows of vertices.
precompute('furnished_room', join(folder, 'room.safetensors'), '--receivers-at', 'patches');
precompute('furnished_room', join(page, 'scenes/furnished_room.safetensors'), '--for', 'web');
precompute('pavilion', join(folder, 'pavilion.safetensors'));
const textured = join(page, 'scenes/textured.gltf');
writeFileSync(textured, texturedScene);
precomputeFile(textured, join(page, 'scenes/textured.safetensors'), '--for', 'web');
writeFileSync(join(folder, 'room_lights.json'), JSON.stringify({ lights: roomLights }));
run(program, 'render', join(folder, 'room.safetensors'), '--lights', join(folder, 'room_lights.json'),
    '--show', 'indirect', '--exposure', String(roomExposure), '--size', '320x240', '--quiet', '-o',
    join(page, 'indirect.png'));
writeFileSync(join(folder, 'lights.json'), JSON.stringify({ lights, sky }));
run(program, 'solve', scene, '--lights', join(folder, 'lights.json'), '--quiet', '-o',
    join(folder, 'native.csv'));
