import type { Light as ThreeLight, Material, Mesh } from 'three';
import type { Engine, Light, LoadOptions, Sky, Timings, Transfer } from './rebounce.js';

/** The three.js light as a light of Rebounce; null for one that is neither lamp nor sun. */
export function toLight(light: ThreeLight): Light | null;

/** A sky; with `type` it looks as that of the CIE. */
export interface LightingSky extends Sky {
  type?: number;
  sunDirection?: readonly number[];
}

/** Lights a scene of three.js from a transfer file. */
export class TransferLighting {
  static load(url: string | URL | ArrayBuffer, options?: LoadOptions): Promise<TransferLighting>;
  private constructor();
  /** The surface of the scene, to be added to a scene of three.js. */
  readonly mesh: Mesh;
  readonly transfer: Transfer;
  readonly engine: Engine;
  readonly timings: Timings;
  /** How much of direct and of bounced light the mesh shows, 0 to 1. */
  show(direct: number, bounced: number): void;
  /** Lets a material show bounced light on geometry with the attribute `bouncedIrradiance`. */
  patch<T extends Material>(material: T): T;
  /** One frame, to be called before the scene is drawn. */
  update(lights: Iterable<ThreeLight | Light>, sky?: LightingSky): void;
  dispose(): void;
}
