import type {
  Box3, Data3DTexture, Light as ThreeLight, Material, Mesh, Object3D, Vector3,
} from 'three';
import type { Engine, Light, LoadOptions, Sky, Timings, Transfer } from './rebounce.js';

/**
 * The three.js light as a light of Rebounce, dark if it or something that it is in is invisible;
 * null for one that is neither lamp nor sun. Throws RebounceError if its decay is not 2.
 */
export function toLight(light: ThreeLight): Light | null;

/** A sky; with `type` it looks as that of the CIE. */
export interface LightingSky extends Sky {
  /** Luminance below the horizon in parts of that above; 1. Not with `type`. */
  ground?: number;
  type?: number;
  sunDirection?: readonly number[];
}

/** Bounced light in the air, in the shape of LightProbeGrid: add it to the scene. */
export interface ProbeGrid extends ThreeLight {
  readonly isLightProbeGrid: true;
  readonly boundingBox: Box3;
  readonly resolution: Vector3;
  readonly texture: Data3DTexture;
}

/** Lights a scene of three.js from a transfer file. */
export class TransferLighting {
  static load(url: string | URL | ArrayBuffer, options?: LoadOptions): Promise<TransferLighting>;
  private constructor();
  /** The surface of the scene, to be added to a scene of three.js. */
  readonly mesh: Mesh;
  /** Lights what moves, with standard materials; null if the file has no grid of probes. */
  readonly probes: ProbeGrid | null;
  readonly transfer: Transfer;
  readonly engine: Engine;
  readonly timings: Timings;
  /** How much of direct and of bounced light the mesh shows, 0 to 1. */
  show(direct: number, bounced: number): void;
  /**
   * Lets a material show bounced light on geometry with the attribute `bouncedIrradiance`, and direct
   * light by the formulas of Rebounce.
   */
  patch<T extends Material>(material: T): T;
  /**
   * Lets the meshes in and below `object` show bounced light, with all of their attributes and
   * materials: they are cut as the file's surface is. They are those of the scene that the file was
   * made from, where they stood then; `mesh` is not needed beside them. Throws RebounceError if one
   * is not part of the surface, moves or is instanced; nothing is changed then.
   */
  attach(object: Object3D): void;
  /**
   * One frame, to be called before the scene is drawn. Direct light of points, spots and suns is that
   * of the lights of three.js that are in the scene: from other lights of these kinds only the
   * bounced light is shown.
   */
  update(lights: Iterable<ThreeLight | Light>, sky?: LightingSky): void;
  /**
   * The same surface once more, for other bounced light at the vertices of the file; it stays until
   * `dispose`.
   */
  makeTwin(): { mesh: Mesh; write: (irradiance: Float32Array) => void };
  /** Frees memory of the module and of the graphics card; `update` throws RebounceError then. */
  dispose(): void;
}
