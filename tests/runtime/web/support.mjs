// What the tests of the page share: where things are, and what is left out without them.

import { existsSync } from 'node:fs';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';

export const root = fileURLToPath(new URL('../../..', import.meta.url));
export const web = join(root, 'runtime/web');

export const chromiumPath = '/usr/bin/chromium';

/** Of Chromium, to draw in software and ask nothing of the net. */
export const launchArguments = [
  '--headless', '--no-sandbox', '--disable-quic', '--no-first-run',
  '--disable-background-networking', '--disable-component-update', '--disable-sync',
  '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
];

/** Ends the program as CTest's SKIP_RETURN_CODE says if something that it needs is missing. */
export function skipWithout(path, what) {
  if (existsSync(path)) return;
  console.log(`skipped: there is no ${what} (${path})`);
  process.exit(77);
}

/** The lamps that tests light the Cornell box with, and a sky. */
export const lights = [
  { type: 'point', position: [0.2, 0.42, 0.2], color: [1, 0.8, 0.6], intensity: 4 },
  {
    type: 'spot', position: [0.3, 0.5, 0.1], direction: [0.3, -1, 0.2], intensity: 10,
    spot: { innerConeAngle: 0.3, outerConeAngle: 0.6 },
  },
  {
    type: 'rectangle', position: [0.28, 0.5, 0.28], width: 0.1, height: 0.2, intensity: 100,
  },
  { type: 'directional', direction: [0.2, -0.4, 1], intensity: 30 },
];
export const sky = { color: [0.6, 0.8, 1], luminance: 20 };

/** A lamp in the furnished room, and the stops at which what it bounces is well seen. */
export const roomLights = [
  { type: 'point', position: [1.2, 1.9, 1.2], color: [1, 0.8, 0.6], intensity: 160 },
];
export const roomExposure = -5.5;
