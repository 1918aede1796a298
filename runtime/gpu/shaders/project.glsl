#version 430
// Light to its coefficients in bases: one work group for up to 16 vectors of one basis. Threads are
// 16 positions by 4 strips; their sums are added in a fixed order.
layout(local_size_x = 64) in;

layout(std140, binding = 8) uniform Stage {
  uvec4 range;           // items, first item, first output
  uvec4 channel_matrix;  // which matrix each channel uses
};
// [strip][group of 4 vectors][16 positions][4 vectors], as integers of 16 bits (two words) or 8.
layout(std430, binding = 0) readonly buffer Bases { uint bases[]; };
layout(std430, binding = 1) readonly buffer Scales { float scales[]; };
// Two entries for each item: first word, first input, strips, words between strips; first output,
// vectors, whether they have 16 bits.
layout(std430, binding = 2) readonly buffer Items { uvec4 items[]; };
layout(std430, binding = 5) buffer Light { vec4 light[]; };

shared vec4 parts[16][64];

vec4 narrow(uint word) {
  return vec4(bitfieldExtract(int(word), 0, 8), bitfieldExtract(int(word), 8, 8),
              bitfieldExtract(int(word), 16, 8), bitfieldExtract(int(word), 24, 8));
}

vec4 wide(uint low, uint high) {
  return vec4(bitfieldExtract(int(low), 0, 16), bitfieldExtract(int(low), 16, 16),
              bitfieldExtract(int(high), 0, 16), bitfieldExtract(int(high), 16, 16));
}

void main() {
  uint item = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  if (item >= range.x) return;
  item += range.y;
  uvec4 input_range = items[2u * item], target = items[2u * item + 1u];
  uint thread = gl_LocalInvocationID.x, position = thread % 16u;
  uint groups = (target.y + 3u) / 4u;
  vec3 sums[16];
  for (int v = 0; v < 16; ++v) sums[v] = vec3(0.0);
  for (uint strip = thread / 16u; strip < input_range.z; strip += 4u) {
    vec3 value = light[input_range.y + 16u * strip + position].xyz;
    uint word = input_range.x + strip * input_range.w;
    for (int g = 0; g < 4; ++g) {
      if (uint(g) >= groups) continue;
      uint at = 16u * uint(g) + position;
      vec4 factors = target.z != 0u ? wide(bases[word + 2u * at], bases[word + 2u * at + 1u])
                                    : narrow(bases[word + at]);
      for (int k = 0; k < 4; ++k) sums[4 * g + k] += factors[k] * value;
    }
  }
  for (int v = 0; v < 16; ++v) parts[v][thread] = vec4(sums[v], 0.0);
  barrier();
  uint vector = thread / 4u, quarter = thread % 4u;
  vec4 sum = vec4(0.0);
  for (uint k = 0u; k < 16u; ++k) sum += parts[vector][16u * quarter + k];
  barrier();
  parts[vector][quarter] = sum;
  barrier();
  if (quarter != 0u || vector >= target.y) return;
  uint slot = target.x + vector;
  light[slot] = scales[slot] * (((parts[vector][0] + parts[vector][1]) + parts[vector][2]) + parts[vector][3]);
}
