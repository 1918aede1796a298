#pragma once

namespace rebounce::shaders {

/// The sky behind everything, by its cells (rebounce/sky.h).
inline constexpr const char* kSkyFragment = R"(#version 330 core
uniform vec3 right, up, forward;  // right and up as long as half the picture at unit distance
uniform vec2 picture_size;        // pixels
uniform float cell_part[146];     // of sky_luminance
uniform vec3 sky_luminance;       // scaled by the exposure
uniform float brightest;
out vec4 result;

const float kPi = 3.14159265;
const int kRows = 8;
const int kRowCells[kRows] = int[kRows](30, 30, 24, 24, 18, 12, 6, 1);

int sky_cell(vec3 direction) {
  if (direction.y < 0) return 0;
  float altitude = atan(direction.y, length(direction.xz));
  int wanted = min(int(altitude / (kPi / 15)), kRows - 1);
  int first = 1;
  for (int row = 0; row < wanted; ++row) first += kRowCells[row];
  float turns = atan(direction.x, -direction.z) / (2 * kPi) + 1;  // from north, clockwise
  return first + int(turns * float(kRowCells[wanted]) + 0.5) % kRowCells[wanted];
}

void main() {
  vec2 at = 2 * gl_FragCoord.xy / picture_size - 1;
  vec3 color = sky_luminance * cell_part[sky_cell(forward + at.x * right + at.y * up)];
  float peak = max(max(color.r, color.g), color.b);
  result = vec4(peak > brightest ? color * (brightest / peak) : color, 1);
}
)";

}  // namespace rebounce::shaders
