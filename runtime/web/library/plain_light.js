// Lights in the fields of a light file, as the numbers that the module reads.

import { RebounceError } from './instance.js';

/** Numbers of a light in the module's memory. */
export const plainLightSize = 20;

const types = ['point', 'spot', 'directional', 'sphere', 'rectangle', 'disc'];

/** The vector, if it is three numbers; `name` is what messages call it. */
export function triple(vector, name) {
  if (vector?.length === 3) return vector;
  throw new RebounceError(`${name} is not three numbers; give it as an array of three`);
}

function unit(vector) {
  const length = Math.hypot(...vector);
  return length > 0 ? vector.map((x) => x / length) : vector;
}

/**
 * Writes `light` as light `k` of `to`.
 * @param {import('./rebounce.js').Light} light
 * @param {Float32Array} to
 * @param {number} k
 */
export function writeLight(light, to, k) {
  const vector = (name, standard) => triple(light[name] ?? standard, `light ${k}: ${name}`);
  const type = types.indexOf(light.type ?? 'point');
  if (type < 0) throw new RebounceError(`there is no light of the type "${light.type}"`);
  const direction = unit(vector('direction', [0, -1, 0]));
  const tangent = vector('tangent', Math.abs(direction[0]) > 0.9 ? [0, 0, 1] : [1, 0, 0]);
  to.set([
    type, ...vector('position', [0, 0, 0]), ...direction, ...vector('color', [1, 1, 1]),
    light.intensity ?? 1, light.range ?? 0,
    light.spot?.innerConeAngle ?? 0, light.spot?.outerConeAngle ?? Math.PI / 4,
    light.radius ?? 0, light.width ?? 0, light.height ?? 0, ...tangent,
  ], k * plainLightSize);
}
