// Lights of three.js as lights of Rebounce.

import * as THREE from 'three';

/** The three.js light as a light of Rebounce; null for one that is neither lamp nor sun. */
export function toLight(light) {
  const position = light.getWorldPosition(new THREE.Vector3()).toArray();
  const intensity = light.visible ? light.intensity : 0;
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
 * bright as the light's ground.
 */
export function toSky({ color, groundColor, intensity, visible }) {
  const above = brightness(color);
  return {
    color: color.toArray(), luminance: visible ? intensity / Math.PI : 0,
    ground: above > 0 ? brightness(groundColor) / above : 0,
  };
}
