#version 430
// Products with coupling matrices: one work group for 8 coefficients of the arriving light. Threads
// are 8 inputs by 8 coefficients; their sums are added in a fixed order.
layout(local_size_x = 64) in;

layout(std140, binding = 8) uniform Stage {
  uvec4 range;           // items, first item, first output
  uvec4 channel_matrix;  // which matrix each channel uses
};
layout(std430, binding = 0) readonly buffer Couplings { uint couplings[]; };  // floats, or pairs of 16 bits
layout(std430, binding = 1) readonly buffer Scales { float scales[]; };
// Two entries for each side of a matrix: first input, inputs, first value, values of one matrix;
// values from output to output, values from input to input, bits of the matrix's scale, format.
layout(std430, binding = 2) readonly buffer Sides { uvec4 sides[]; };
layout(std430, binding = 3) readonly buffer Outputs { uvec2 outputs[]; };  // side, and place in it
layout(std430, binding = 4) readonly buffer Inputs { uint inputs[]; };     // slots
layout(std430, binding = 5) readonly buffer Light { vec4 light[]; };
layout(std430, binding = 6) writeonly buffer Arriving { vec4 arriving[]; };

shared vec3 parts[64];

// An entry in a format of GpuOperator: half, float or integer.
float coupling(uint index, uint format) {
  if (format == 1u) return uintBitsToFloat(couplings[index]);
  uint pair = couplings[index >> 1];
  if (format == 2u) return float(bitfieldExtract(int(pair), 16 * int(index & 1u), 16));
  return unpackHalf2x16(pair)[index & 1u];
}

// The product of a row of a side's matrix with every eighth input.
vec3 product(uvec2 place, uint lane) {
  uvec4 side = sides[2u * place.x], strides = sides[2u * place.x + 1u];
  uvec3 value = side.z + channel_matrix.xyz * side.w + place.y * strides.x;
  vec3 sum = vec3(0.0);
  for (uint k = lane; k < side.y; k += 8u) {
    uvec3 at = value + k * strides.y;
    vec3 factors = vec3(coupling(at.x, strides.w), coupling(at.y, strides.w), coupling(at.z, strides.w));
    sum += factors * light[inputs[side.x + k]].xyz;
  }
  return uintBitsToFloat(strides.z) * sum;
}

void main() {
  uint thread = gl_LocalInvocationID.x, lane = thread % 8u;
  uint index = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 8u + thread / 8u;
  parts[thread] = index < range.x ? product(outputs[index], lane) : vec3(0.0);
  barrier();
  if (lane != 0u || index >= range.x) return;
  vec3 sum = vec3(0.0);
  for (uint k = 0u; k < 8u; ++k) sum += parts[thread + k];
  uint slot = range.z + index;
  arriving[slot] = vec4(scales[slot] * sum, 0.0);
}
