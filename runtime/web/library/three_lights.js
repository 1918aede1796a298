// Lights of three.js as lights of Rebounce.

import * as THREE from 'three';

/** Whether three.js draws it: it and all that it is in are visible. */
function isShown(object) {
  for (let one = object; one; one = one.parent) {
    if (!one.visible) return false;
  }
  return true;
}

/**
 * The three.js light as a light of Rebounce, dark if it or something that it is in is invisible;
 * null for one that is neither lamp nor sun.
 */
export function toLight(light) {
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
