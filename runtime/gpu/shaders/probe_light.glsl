#version 430
// The light at probes as spherical harmonics of degree 0 to 2: that of the sky, and what weights
// make of the radiosity of patches. One thread for each of the nine coefficients of a probe.
layout(local_size_x = 64) in;

layout(std140, binding = 8) uniform Stage {
  uvec4 range;           // items, first item, first output
  uvec4 channel_matrix;  // which matrix each channel uses
};
layout(std430, binding = 0) readonly buffer Radiosity { float radiosity[]; };
layout(std430, binding = 1) readonly buffer SkyLight { float sky_light[]; };  // [probes][9][3]
layout(std430, binding = 2) readonly buffer Begin { uint begin[]; };          // [probes + 1]
layout(std430, binding = 3) readonly buffer Patches { uint patches[]; };      // [entries]
layout(std430, binding = 4) readonly buffer Weights { float weights[]; };     // [entries][9]
layout(std430, binding = 5) writeonly buffer ProbeLight { float probe_light[]; };

void main() {
  uint index = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
  if (index >= range.x) return;
  uint probe = index / 9u, coefficient = index % 9u;
  vec3 sum = vec3(sky_light[3u * index], sky_light[3u * index + 1u], sky_light[3u * index + 2u]);
  for (uint e = begin[probe]; e < begin[probe + 1u]; ++e) {
    uint first = 3u * patches[e];
    sum += weights[9u * e + coefficient] *
           vec3(radiosity[first], radiosity[first + 1u], radiosity[first + 2u]);
  }
  for (uint c = 0u; c < 3u; ++c) probe_light[3u * index + c] = sum[c];
}
