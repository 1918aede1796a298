#version 430
// The radiosity of sets of patches, as if each set shone evenly: a work group for each set.
layout(local_size_x = 64) in;

layout(std140, binding = 8) uniform Stage {
  uvec4 range;           // items
  uvec4 channel_matrix;  // which matrix each channel uses
};
layout(std430, binding = 0) readonly buffer Radiosity { float radiosity[]; };
layout(std430, binding = 1) readonly buffer Places { uvec2 places[]; };  // patch, bits of its area
layout(std430, binding = 2) readonly buffer Sets { uvec2 sets[]; };      // first place, and past the last
layout(std430, binding = 3) writeonly buffer SetLight { vec4 set_light[]; };

shared vec4 part[64];  // sums of area times radiosity, and of area

void main() {
  uint index = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  uint thread = gl_LocalInvocationID.x;
  if (index >= range.x) return;
  vec4 sum = vec4(0.0);
  for (uint k = sets[index].x + thread; k < sets[index].y; k += 64u) {
    uint first = 3u * places[k].x;
    vec3 value = vec3(radiosity[first], radiosity[first + 1u], radiosity[first + 2u]);
    sum += uintBitsToFloat(places[k].y) * vec4(value, 1.0);
  }
  part[thread] = sum;
  for (uint half_size = 32u; half_size > 0u; half_size >>= 1) {
    barrier();
    if (thread < half_size) part[thread] += part[thread + half_size];
  }
  if (thread == 0u) set_light[index] = part[0].w > 0.0 ? part[0] / part[0].w : vec4(0.0);
}
