// The WebAssembly instance: memory, strings and calls that fail.

import { wasm } from './wasm.js';

/** Thrown for what Rebounce refuses: one line that says what is wrong, and what to do. */
export class RebounceError extends Error {
  constructor(message) {
    super(message);
    this.name = 'RebounceError';
  }
}

let compiled = null;  // promise of a module
let shared = null;    // promise of the instance that all files live in; null while there is none

/** Whether this browser can run the module: SIMD and exceptions of WebAssembly. */
export function isSupported() {
  // A module with a function that has a v128 constant, and a tag of an exception.
  const probe = new Uint8Array([
    0, 97, 115, 109, 1, 0, 0, 0, 1, 8, 2, 96, 0, 1, 123, 96, 0, 0, 3, 2, 1, 0, 13, 3, 1, 0, 1,
    10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11,
  ]);
  return typeof WebAssembly === 'object' && typeof DecompressionStream === 'function' &&
      WebAssembly.validate(probe);
}

async function compile() {
  if (!isSupported()) {
    throw new RebounceError(
        'this browser lacks SIMD or exceptions of WebAssembly; use one of 2023 or later');
  }
  const packed = Uint8Array.from(atob(wasm), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'));
  return WebAssembly.compile(await new Response(stream).arrayBuffer());
}

/** A running module. All transfer files share one; its memory grows only when one is loaded. */
export class Instance {
  #exports;
  #encoder = new TextEncoder();
  #decoder = new TextDecoder();
  broken = false;

  /** @returns {Promise<Instance>} the shared one, or a new one after that broke or did not start */
  static get() {
    shared ??= Instance.#make().catch((error) => {
      compiled = shared = null;
      throw error;
    });
    return shared;
  }

  static async #make() {
    compiled ??= compile();
    const instance = new Instance();
    await instance.#start(await compiled);
    return instance;
  }

  async #start(module) {
    const failed = () => 52;  // nothing can be written: there are no files
    const time = (clock, precision, address) => {
      const nanoseconds = BigInt(Math.round(1e6 * performance.now()));
      new DataView(this.#exports.memory.buffer).setBigUint64(address, nanoseconds, true);
      return 0;
    };
    const { exports } = await WebAssembly.instantiate(module, {
      rebounce: { now: () => performance.now() },
      wasi_snapshot_preview1: {
        fd_close: failed, fd_seek: failed, fd_write: failed, clock_time_get: time,
      },
    });
    this.#exports = exports;
    exports._initialize();
  }

  /** Calls a function, for a status or an address; a trap makes the instance useless, and says so. */
  call(name, ...args) {
    if (this.broken) throw new RebounceError('the module has stopped; load the file again');
    try {
      return this.#exports[name](...args) >>> 0;  // addresses reach beyond 2 GiB
    } catch (error) {
      this.broken = true;
      shared = null;
      throw new RebounceError(`the module has stopped (${error.message}); load the file again`);
    }
  }

  /** Calls a function that returns a status, and throws what the library says of a failure. */
  check(name, ...args) {
    if (this.call(name, ...args) !== 0) {
      throw new RebounceError(this.text(this.call('rebounce_last_error')));
    }
  }

  allocate(size) {
    const address = this.call('malloc', size);
    if (address === 0) throw new RebounceError('out of memory; close something');
    return address;
  }
  release(address) {
    if (!this.broken) this.call('free', address);
  }

  /** Copies `bytes` to new memory. */
  #put(bytes) {
    const address = this.allocate(bytes.byteLength);
    new Uint8Array(this.#exports.memory.buffer, address, bytes.byteLength).set(bytes);
    return address;
  }
  /**
   * Calls `use` with the address of memory for each of `parts`, bytes to copy or a size, which is
   * freed when it returns or throws.
   */
  lend(parts, use) {
    const addresses = [];
    try {
      for (const part of parts) {
        addresses.push(typeof part === 'number' ? this.allocate(part) : this.#put(part));
      }
      return use(...addresses);
    } finally {
      for (const address of addresses) this.release(address);
    }
  }

  // Bytes to lend.
  bytesOfFloats(numbers) {
    return new Uint8Array(new Float32Array(numbers).buffer);
  }
  bytesOfText(text) {
    return this.#encoder.encode(`${text}\0`);
  }

  text(address) {
    const bytes = new Uint8Array(this.#exports.memory.buffer);
    return this.#decoder.decode(bytes.slice(address, bytes.indexOf(0, address)));
  }

  // Views of memory: valid until a file is loaded.
  floats(address, count) {
    return new Float32Array(this.#exports.memory.buffer, address, count);
  }
  doubles(address, count) {
    return new Float64Array(this.#exports.memory.buffer, address, count);
  }
  bytes(address, count) {
    return new Uint8Array(this.#exports.memory.buffer, address, count);
  }
  words(address, count) {
    return new Uint32Array(this.#exports.memory.buffer, address, count);
  }

  get memoryBytes() {
    return this.#exports.memory.buffer.byteLength;
  }
}
