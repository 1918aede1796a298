// Lights in the fields of a light file, as the numbers that the module reads.

import { RebounceError } from './instance.js';

/** Numbers of a light in the module's memory. */
export const plainLightSize = 20;

const types = ['point', 'spot', 'directional', 'sphere', 'rectangle', 'disc'];

function unit(vector) {
  const length = Math.hypot(...vector);
  return length > 0 ? vector.map((x) => x / length) : vector;
}

/**
 * Writes `light` to `to`, from number `at` on.
 * @param {import('./rebounce.js').Light} light
 * @param {Float32Array} to
 * @param {number} at
 */
export function writeLight(light, to, at) {
  const type = types.indexOf(light.type ?? 'point');
  if (type < 0) throw new RebounceError(`there is no light of the type "${light.type}"`);
  const direction = unit(light.direction ?? [0, -1, 0]);
  const tangent = light.tangent ?? (Math.abs(direction[0]) > 0.9 ? [0, 0, 1] : [1, 0, 0]);
  to.set([
    type, ...(light.position ?? [0, 0, 0]), ...direction, ...(light.color ?? [1, 1, 1]),
    light.intensity ?? 1, light.range ?? 0,
    light.spot?.innerConeAngle ?? 0, light.spot?.outerConeAngle ?? Math.PI / 4,
    light.radius ?? 0, light.width ?? 0, light.height ?? 0, ...tangent,
  ], at);
}
