#version 430
// Products with coupling matrices: one thread for each coefficient of the arriving light.
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

// An entry in a format of GpuOperator: half, float or integer.
float coupling(uint index, uint format) {
  if (format == 1u) return uintBitsToFloat(couplings[index]);
  uint pair = couplings[index >> 1];
  if (format == 2u) return float(bitfieldExtract(int(pair), 16 * int(index & 1u), 16));
  return unpackHalf2x16(pair)[index & 1u];
}

void main() {
  uint index = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
  if (index >= range.x) return;
  uvec2 place = outputs[index];
  uvec4 side = sides[2u * place.x], strides = sides[2u * place.x + 1u];
  uvec3 value = side.z + channel_matrix.xyz * side.w + place.y * strides.x;
  vec3 sum = vec3(0.0);
  for (uint k = 0u; k < side.y; ++k) {
    vec3 factors = vec3(coupling(value.x, strides.w), coupling(value.y, strides.w),
                     coupling(value.z, strides.w));
    sum += factors * light[inputs[side.x + k]].xyz;
    value += strides.y;
  }
  uint slot = range.z + index;
  arriving[slot] = vec4(scales[slot] * uintBitsToFloat(strides.z) * sum, 0.0);
}
