#version 430
// Light to its coefficients in bases: one work group for up to 16 vectors of one basis. Threads are
// 16 positions by 4 groups of vectors; their sums are added in a fixed order.
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

shared vec3 parts[16][16];     // [vector][position]
shared vec3 quarters[16][4];

// Strips whose words are read before the first is used.
const uint kAtOnce = 8u;

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
  uvec4 from = items[2u * item], target = items[2u * item + 1u];
  uint thread = gl_LocalInvocationID.x, position = thread % 16u, group = thread / 16u;
  bool is_wide = target.z != 0u;
  uint first_word = from.x + (16u * group + position) * (is_wide ? 2u : 1u);
  uint strips = 4u * group < target.y ? from.z : 0u;
  vec3 sums[4] = vec3[4](vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
  for (uint first = 0u; first < strips; first += kAtOnce) {
    vec3 values[kAtOnce];
    uvec2 words[kAtOnce];
    for (uint k = 0u; k < kAtOnce; ++k) {
      uint strip = min(first + k, strips - 1u), word = first_word + strip * from.w;
      values[k] = first + k < strips ? light[from.y + 16u * strip + position].xyz : vec3(0.0);
      words[k] = uvec2(bases[word], is_wide ? bases[word + 1u] : 0u);
    }
    for (uint k = 0u; k < kAtOnce; ++k) {
      vec4 factors = is_wide ? wide(words[k].x, words[k].y) : narrow(words[k].x);
      for (int v = 0; v < 4; ++v) sums[v] += factors[v] * values[k];
    }
  }
  for (int v = 0; v < 4; ++v) parts[4u * group + uint(v)][position] = sums[v];
  barrier();
  uint vector = thread / 4u, quarter = thread % 4u;
  vec3 sum = vec3(0.0);
  for (uint k = 0u; k < 4u; ++k) sum += parts[vector][4u * quarter + k];
  quarters[vector][quarter] = sum;
  barrier();
  if (quarter != 0u || vector >= target.y) return;
  sum = (quarters[vector][0] + quarters[vector][1]) + (quarters[vector][2] + quarters[vector][3]);
  uint slot = target.x + vector;
  light[slot] = vec4(scales[slot] * sum, 0.0);
}
