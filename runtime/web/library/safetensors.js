// The container of transfer files, read in place: https://github.com/huggingface/safetensors

const arrayTypes = {
  U8: Uint8Array, I8: Int8Array, U16: Uint16Array, F16: Uint16Array,
  U32: Uint32Array, I32: Int32Array, F32: Float32Array,
};

/**
 * Reads the header of a safetensors file.
 * @param {ArrayBuffer} buffer the whole file
 * @returns {{metadata: Object<string, string>, tensor: (name: string) => (TypedArray|null)}}
 *   `tensor` gives a view of the values; null where there is none of that name
 */
export function readSafetensors(buffer) {
  const size = buffer.byteLength < 8 ? NaN : Number(new DataView(buffer).getBigUint64(0, true));
  if (!(size <= buffer.byteLength - 8)) throw new Error('the file is cut short, or is none of ours');
  let header;
  try {
    header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 8, size)));
  } catch {
    throw new Error('the file has no readable header');
  }
  return {
    metadata: header.__metadata__ ?? {},
    tensor(name) {
      const entry = header[name];
      if (!entry) return null;
      const Type = arrayTypes[entry.dtype];
      const [begin, end] = entry.data_offsets;
      const bytes = buffer.slice(8 + size + begin, 8 + size + end);  // aligned for any type
      return new Type(bytes);
    },
  };
}
