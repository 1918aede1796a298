#include "precompute/patches/texture_sampling.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"

namespace rebounce {
namespace {

// The least number of samples along one side of a triangle; its square, 16, resolves the slope
// inside a texel.
constexpr int kMinSubdivision = 4;

// IEC 61966-2-1.
std::array<float, 256> make_linear_table() {
  std::array<float, 256> table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double encoded = static_cast<double>(i) / 255;
    table[i] = static_cast<float>(encoded <= 0.04045 ? encoded / 12.92
                                                     : std::pow((encoded + 0.055) / 1.055, 2.4));
  }
  return table;
}

const std::array<float, 256>& linear_of_srgb() {
  static const std::array<float, 256> table = make_linear_table();
  return table;
}

// Brings a coordinate into [0, 1] by the mode of the sampler. A coordinate that is not finite
// becomes 0.
double wrapped(double coordinate, TextureWrap wrap) {
  if (!std::isfinite(coordinate)) return 0;
  switch (wrap) {
    case TextureWrap::kClampToEdge:
      return std::clamp(coordinate, 0.0, 1.0);
    case TextureWrap::kMirroredRepeat: {
      const double period = coordinate - 2 * std::floor(coordinate / 2);
      return period <= 1 ? period : 2 - period;
    }
    case TextureWrap::kRepeat:
      break;
  }
  return coordinate - std::floor(coordinate);
}

// The two texels that a coordinate lies between, and the weight of the second.
struct TexelPair {
  int first;
  int second;
  float weight;
};

TexelPair texel_pair(double coordinate, int size, TextureWrap wrap) {
  // The centre of texel i is at (i + 1/2) / size.
  const double place = wrapped(coordinate, wrap) * size - 0.5;
  const double below = std::floor(place);
  const int first = static_cast<int>(below);
  const auto neighbour = [&](int texel) {
    if (texel >= 0 && texel < size) return texel;
    if (wrap == TextureWrap::kRepeat) return texel < 0 ? size - 1 : 0;
    return texel < 0 ? 0 : size - 1;  // a mirror shows the edge texel again
  };
  return {neighbour(first), neighbour(first + 1), static_cast<float>(place - below)};
}

const std::uint8_t* pixel(const Image& image, int column, int row) {
  return &image.rgba[4 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) +
                          static_cast<std::size_t>(column))];
}

Float3 linear_color(const std::uint8_t* rgba) {
  const std::array<float, 256>& linear = linear_of_srgb();
  return {linear[rgba[0]], linear[rgba[1]], linear[rgba[2]]};
}

// Alpha is not sRGB-encoded.
float alpha(const std::uint8_t* rgba) {
  return static_cast<float>(rgba[3]) / 255;
}

float mixed(float a, float b, float weight) {
  return a + (b - a) * weight;
}

Float3 mixed(const Float3& a, const Float3& b, float weight) {
  Float3 result{};
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = mixed(a[i], b[i], weight);
  return result;
}

// Interpolates `value` of the pixels around `texcoord`.
template <typename Value>
auto bilinear(const Texture& texture, const Image& image, Float2 texcoord, const Value& value) {
  const TexelPair column = texel_pair(texcoord[0], image.width, texture.wrap_s);
  const TexelPair row = texel_pair(texcoord[1], image.height, texture.wrap_t);
  const auto across = [&](int y) {
    return mixed(value(pixel(image, column.first, y)), value(pixel(image, column.second, y)),
                 column.weight);
  };
  return mixed(across(row.first), across(row.second), row.weight);
}

template <std::size_t N>
std::array<float, N> interpolated(const std::array<std::array<float, N>, 3>& corner,
                                  const std::array<double, 3>& weight) {
  std::array<float, N> result{};
  for (std::size_t i = 0; i < N; ++i) {
    result[i] = static_cast<float>(weight[0] * corner[0][i] + weight[1] * corner[1][i] +
                                   weight[2] * corner[2][i]);
  }
  return result;
}

// The number of parts of each side for about one sample per texel that the triangle touches: texels
// in its area and along its longest side; bounded so that there are at most about `most` samples.
int subdivision(const Image& image, const std::array<Float2, 3>& texcoord,
                int most = kMostTextureSamples) {
  std::array<std::array<double, 2>, 3> side{};
  double longest = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Float2& from = texcoord[i];
    const Float2& to = texcoord[(i + 1) % 3];
    side[i] = {(static_cast<double>(to[0]) - from[0]) * image.width,
               (static_cast<double>(to[1]) - from[1]) * image.height};
    longest = std::max(longest, std::hypot(side[i][0], side[i][1]));
  }
  const double area = std::abs(side[0][0] * side[1][1] - side[0][1] * side[1][0]) / 2;
  const double parts = std::ceil(std::sqrt(area + longest));
  const double finest = std::ceil(std::sqrt(most));
  return std::max(kMinSubdivision, static_cast<int>(parts < finest ? parts : finest));
}

// Averages value(barycentric) over the triangle: one sample in each of n² congruent parts. Its
// place in the part follows the R2 sequence, so that a texture with the period of the parts cannot
// hide between the samples. Deterministic.
template <typename Sum, typename Value>
Sum stratified_mean(int n, const Value& value) {
  Sum sum{0.0};
  std::uint32_t sample = 0;
  for (int row = 0; row < n; ++row) {
    // Row `row` has 2 (n - row) - 1 parts, upright ones and between them inverted ones.
    for (int part = 0; part < 2 * (n - row) - 1; ++part) {
      const glm::dvec2 inside = square_to_triangle(r2_point(sample++, glm::dvec2(0.0)));
      const bool inverted = part % 2 == 1;
      const glm::dvec2 place =
          (glm::dvec2(part / 2, row) + (inverted ? 1.0 - inside : inside)) / static_cast<double>(n);
      sum += value(std::array<double, 3>{1 - place.x - place.y, place.x, place.y});
    }
  }
  return sum / (static_cast<double>(n) * n);
}

// The mean of `value` weighted by `weight`; the plain mean if the weight is 0 everywhere.
template <typename Value, typename Weight>
Float3 mean_color(int n, const Value& value, const Weight& weight) {
  constexpr double kLeast = 1e-6;
  const auto sum = stratified_mean<glm::dvec4>(n, [&](const std::array<double, 3>& place) {
    return (weight(place) + kLeast) * glm::dvec4(to_dvec3(value(place)), 1);
  });
  return to_float3(glm::dvec3(sum) / sum.w);
}

Float3 product(const Float3& a, const Float3& b) {
  return {a[0] * b[0], a[1] * b[1], a[2] * b[2]};
}

constexpr std::array<double, 3> kCentroid{1.0 / 3, 1.0 / 3, 1.0 / 3};

bool has_uniform_opacity(const Material& material) {
  return material.alpha_mode == AlphaMode::kOpaque || material.base_color_texture == kNone;
}

// The opacity at a place of the triangle with these base colour texture coordinates.
auto opacity_over(const Scene& scene, const Material& material,
                  const std::array<Float2, 3>& texcoord) {
  return [&](const std::array<double, 3>& place) -> double {
    if (has_uniform_opacity(material)) return 1;
    return opacity_at(scene, material, interpolated(texcoord, place));
  };
}

}  // namespace

float srgb_to_linear(std::uint8_t value) {
  return linear_of_srgb()[value];
}

Float3 sample_texture(const Texture& texture, const Image& image, Float2 texcoord) {
  return bilinear(texture, image, texcoord, linear_color);
}

Float3 mean_base_color(const Scene& scene, const Material& material,
                       const std::array<Float2, 3>& texcoord,
                       const std::array<Float3, 3>& vertex_color, int most) {
  if (material.base_color_texture == kNone) {
    return product(material.base_color, interpolated(vertex_color, kCentroid));
  }
  const Texture& texture = scene.textures.at(material.base_color_texture);
  const Image& image = scene.images.at(material.base_color_texture);
  const auto color = [&](const std::array<double, 3>& place) {
    return product(sample_texture(texture, image, interpolated(texcoord, place)),
                   interpolated(vertex_color, place));
  };
  const Float3 mean = mean_color(subdivision(image, texcoord, most), color,
                                 opacity_over(scene, material, texcoord));
  return product(material.base_color, mean);
}

Float3 mean_emitted_luminance(const Scene& scene, const Material& material,
                              const std::array<Float2, 3>& texcoord,
                              const std::array<Float2, 3>& base_color_texcoord, int most) {
  if (material.emissive_texture == kNone) return material.emitted_luminance;
  const Texture& texture = scene.textures.at(material.emissive_texture);
  const Image& image = scene.images.at(material.emissive_texture);
  const auto color = [&](const std::array<double, 3>& place) {
    return sample_texture(texture, image, interpolated(texcoord, place));
  };
  const Float3 mean = mean_color(subdivision(image, texcoord, most), color,
                                 opacity_over(scene, material, base_color_texcoord));
  return product(material.emitted_luminance, mean);
}

float opacity_at(const Scene& scene, const Material& material, Float2 texcoord) {
  if (material.alpha_mode == AlphaMode::kOpaque) return 1;
  float opacity = material.base_alpha;
  if (material.base_color_texture != kNone) {
    opacity *= bilinear(scene.textures.at(material.base_color_texture),
                        scene.images.at(material.base_color_texture), texcoord, alpha);
  }
  if (material.alpha_mode == AlphaMode::kBlend) return opacity;
  return opacity >= material.alpha_cutoff ? 1.0F : 0.0F;
}

float mean_opacity(const Scene& scene, const Material& material,
                   const std::array<Float2, 3>& texcoord) {
  if (has_uniform_opacity(material)) return opacity_at(scene, material, texcoord[0]);
  const Image& image = scene.images.at(material.base_color_texture);
  return static_cast<float>(stratified_mean<double>(
      subdivision(image, texcoord), [&](const std::array<double, 3>& place) {
        return opacity_at(scene, material, interpolated(texcoord, place));
      }));
}

}  // namespace rebounce
