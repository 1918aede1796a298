// Milliseconds of a frame in the module, on one thread: node frame.mjs FILE.safetensors ...
// A lamp moves by a hundredth of the scene each frame; node has the engine of Chromium.

import { readFileSync } from 'node:fs';
import { Transfer } from '../../runtime/web/library/rebounce.js';

const frames = 200;

const median = (values) => values.toSorted((a, b) => a - b)[values.length >> 1];

console.log('file, patches, direct ms, product ms, vertices ms, frame ms, product alone ms');
for (const file of process.argv.slice(2)) {
  const transfer = await Transfer.load(new Uint8Array(readFileSync(file)).buffer, { name: file });
  const engine = transfer.createEngine();
  const { position } = transfer.mesh;
  const [low, high] = [Math.min, Math.max].map((pick) => [0, 1, 2].map(
      (c) => position.reduce((best, x, k) => (k % 3 === c ? pick(best, x) : best), position[c])));
  const lamp = (part) => ({
    type: 'point', intensity: 100,
    position: [0.3 + 0.4 * part, 0.8, 0.5].map((at, c) => low[c] + at * (high[c] - low[c])),
  });
  const still = lamp(0.5);
  const times = { direct: [], product: [], vertices: [], total: [], still: [] };
  for (let k = 0; k < frames; ++k) {
    engine.relight([lamp((k % 40) / 40)]);
    engine.vertexIrradiance();
    const { direct, product, vertices, total } = engine.timings;
    times.direct.push(direct);
    times.product.push(product);
    times.vertices.push(vertices);
    times.total.push(total + vertices);
  }
  for (let k = 0; k < frames; ++k) times.still.push(engine.relight([still]).product);
  const shown = ['direct', 'product', 'vertices', 'total', 'still']
      .map((name) => median(times[name]).toFixed(3));
  console.log([file.split('/').at(-1), transfer.patchCount, ...shown].join(', '));
  engine.dispose();
  transfer.dispose();
}
