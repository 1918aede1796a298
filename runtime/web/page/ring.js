// The ring around what is chosen.

import * as THREE from 'three';

export function makeRing(radius) {
  return new THREE.Mesh(
      new THREE.RingGeometry(radius, 1.15 * radius, 48),
      new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.8, toneMapped: false }));
}
