// Lights of three.js as lights of Rebounce.

import * as THREE from 'three';
import { RebounceError } from './instance.js';

// Range and cone as in KHR_lights_punctual; those of three.js differ.
const formulas = `
float getDistanceAttenuation(float metres, float range, float decay) {
  float window = range > 0.0 ? saturate(1.0 - pow4(metres / range)) : 1.0;
  return window / max(pow2(metres), 1e-12);
}
float getSpotAttenuation(float outer, float inner, float cosine) {
  return pow2(saturate((cosine - outer) / max(0.001, inner - outer)));
}
`;
const lightFunctions = formulas + THREE.ShaderChunk.lights_pars_begin.replace(
    /float get(Distance|Spot)Attenuation/g, 'float unused$1Attenuation');

/** Lets a shader of three.js light by the formulas of Rebounce. */
export function replaceLightFormulas(shader) {
  shader.fragmentShader =
      shader.fragmentShader.replace('#include <lights_pars_begin>', lightFunctions);
}

/** Whether three.js draws it: it and all that it is in are visible. */
function isShown(object) {
  for (let one = object; one; one = one.parent) {
    if (!one.visible) return false;
  }
  return true;
}

/**
 * The three.js light as a light of Rebounce, dark if it or something that it is in is invisible;
 * null for one that is neither lamp nor sun. Throws RebounceError if its decay is not 2.
 */
export function toLight(light) {
  if ((light.decay ?? 2) !== 2) {
    throw new RebounceError(
        `the light "${light.name}" has a decay of ${light.decay}; set it to 2, the inverse square`);
  }
  const position = light.getWorldPosition(new THREE.Vector3()).toArray();
  const intensity = isShown(light) ? light.intensity : 0;
  const plain = { position, color: light.color.toArray(), intensity };
  const alongTarget = () => light.target.getWorldPosition(new THREE.Vector3())
                                .sub(light.getWorldPosition(new THREE.Vector3())).toArray();
  if (light.isPointLight) return { ...plain, type: 'point', range: light.distance };
  if (light.isSpotLight) {
    const outerConeAngle = light.angle;
    const spot = { outerConeAngle, innerConeAngle: outerConeAngle * (1 - light.penumbra) };
    return { ...plain, type: 'spot', range: light.distance, direction: alongTarget(), spot };
  }
  if (light.isDirectionalLight) return { ...plain, type: 'directional', direction: alongTarget() };
  if (light.isRectAreaLight) {
    const turned = light.getWorldQuaternion(new THREE.Quaternion());
    return {
      ...plain, type: 'rectangle', width: light.width, height: light.height,
      direction: new THREE.Vector3(0, 0, -1).applyQuaternion(turned).toArray(),
      tangent: new THREE.Vector3(1, 0, 0).applyQuaternion(turned).toArray(),
    };
  }
  return null;
}

const brightness = ({ r, g, b }) => 0.2126 * r + 0.7152 * g + 0.0722 * b;

/**
 * The hemisphere light as a sky: uniform above the horizon, and below it in the same colour as
 * bright as the light's ground; dark as a lamp is.
 */
export function toSky(light) {
  const { color, groundColor, intensity } = light;
  const above = brightness(color);
  return {
    color: color.toArray(), luminance: isShown(light) ? intensity / Math.PI : 0,
    ground: above > 0 ? brightness(groundColor) / above : 0,
  };
}
