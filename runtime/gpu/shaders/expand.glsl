#version 430
// Coefficients of all bases over a strip of 16 positions, and dense blocks, to the light that
// arrives there: one work group for each strip. Threads are 16 positions by 8 groups of vectors;
// their sums are added in a fixed order.
layout(local_size_x = 128) in;

layout(std140, binding = 8) uniform Stage {
  uvec4 range;           // items, first item, first output
  uvec4 channel_matrix;  // which matrix each channel uses
};
// [strip][group of 4 vectors][16 positions][4 vectors], as integers of 16 bits (two words) or 8.
layout(std430, binding = 0) readonly buffer Bases { uint bases[]; };
layout(std430, binding = 1) readonly buffer Scales { float scales[]; };
// First and last entry of bases, first and last entry of dense blocks.
layout(std430, binding = 2) readonly buffer Strips { uvec4 strips[]; };
// Bases: first word, first slot, groups of 16 bits, groups of 8 bits. Dense blocks have two: first
// value, first input, inputs, values of one matrix; values from output to output, values from input
// to input, bits of the block's scale, format.
layout(std430, binding = 3) readonly buffer Entries { uvec4 entries[]; };
layout(std430, binding = 4) readonly buffer Couplings { uint couplings[]; };  // floats, or pairs of 16 bits
layout(std430, binding = 5) readonly buffer Light { vec4 light[]; };
layout(std430, binding = 6) buffer Arriving { vec4 arriving[]; };

const uint kLanes = 8u, kAtOnce = 2u;
shared vec3 parts[16u * kLanes];

vec4 narrow(uint word) {
  return vec4(bitfieldExtract(int(word), 0, 8), bitfieldExtract(int(word), 8, 8),
              bitfieldExtract(int(word), 16, 8), bitfieldExtract(int(word), 24, 8));
}

vec4 wide(uint low, uint high) {
  return vec4(bitfieldExtract(int(low), 0, 16), bitfieldExtract(int(low), 16, 16),
              bitfieldExtract(int(high), 0, 16), bitfieldExtract(int(high), 16, 16));
}

// An entry in a format of GpuOperator: half, float or integer.
float coupling(uint index, uint format) {
  if (format == 1u) return uintBitsToFloat(couplings[index]);
  uint pair = couplings[index >> 1];
  if (format == 2u) return float(bitfieldExtract(int(pair), 16 * int(index & 1u), 16));
  return unpackHalf2x16(pair)[index & 1u];
}

// The product of four vectors at one position with their coefficients.
vec3 product(vec4 factors, uint slot) {
  return factors.x * arriving[slot].xyz + factors.y * arriving[slot + 1u].xyz +
         factors.z * arriving[slot + 2u].xyz + factors.w * arriving[slot + 3u].xyz;
}

// The product of groups of vectors at one position: those of a lane.
vec3 of_groups(uint first_word, uint first_slot, uint count, bool is_wide, uint position, uint lane) {
  vec3 sum = vec3(0.0);
  for (uint first = lane; first < count; first += kLanes * kAtOnce) {
    uvec2 words[kAtOnce];
    for (uint k = 0u; k < kAtOnce; ++k) {
      uint group = min(first + k * kLanes, count - 1u);
      uint word = first_word + (16u * group + position) * (is_wide ? 2u : 1u);
      words[k] = uvec2(bases[word], is_wide ? bases[word + 1u] : 0u);
      if (first + k * kLanes >= count) words[k] = uvec2(0u);
    }
    for (uint k = 0u; k < kAtOnce; ++k) {
      uint group = min(first + k * kLanes, count - 1u);
      sum += product(is_wide ? wide(words[k].x, words[k].y) : narrow(words[k].x), first_slot + 4u * group);
    }
  }
  return sum;
}

vec3 of_basis(uvec4 entry, uint position, uint lane) {
  return of_groups(entry.x, entry.y, entry.z, true, position, lane) +
         of_groups(entry.x + 32u * entry.z, entry.y + 4u * entry.z, entry.w, false, position, lane);
}

vec3 of_dense_block(uvec4 block, uvec4 strides, uint position, uint lane) {
  vec3 sum = vec3(0.0);
  for (uint k = lane; k < block.z; k += kLanes) {
    uvec3 value = block.x + channel_matrix.xyz * block.w + position * strides.x + k * strides.y;
    sum += vec3(coupling(value.x, strides.w), coupling(value.y, strides.w),
                     coupling(value.z, strides.w)) * light[block.y + k].xyz;
  }
  return uintBitsToFloat(strides.z) * sum;
}

void main() {
  uint item = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  if (item >= range.x) return;
  uvec4 strip = strips[range.y + item];
  uint thread = gl_LocalInvocationID.x, position = thread % 16u, lane = thread / 16u;
  vec3 sum = vec3(0.0);
  for (uint e = strip.x; e < strip.y; ++e) sum += of_basis(entries[e], position, lane);
  for (uint e = strip.z; e < strip.w; e += 2u) {
    sum += of_dense_block(entries[e], entries[e + 1u], position, lane);
  }
  parts[thread] = sum;
  barrier();
  if (lane != 0u) return;
  for (uint k = 1u; k < kLanes; ++k) sum += parts[16u * k + position];
  uint slot = range.z + 16u * item + position;
  arriving[slot] = vec4(scales[slot] * sum, 0.0);
}
