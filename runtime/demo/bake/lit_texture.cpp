#include "runtime/demo/bake/lit_texture.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "runtime/demo/image/pixel_hash.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"

namespace rebounce {
namespace {

constexpr float kBrightestTexel =
    1e6F;  // relative to the screen's white: white with any tone curve
constexpr std::uint32_t kTexelBlock = 1024;  // texels that a thread lights at a time

/// The position of a display triangle in the texture.
class TexelFrame {
 public:
  TexelFrame(const TransferData& data, const DisplaySurface& surface, std::uint32_t triangle) {
    const Lightmap& map = data.lightmap;
    const Uint3& corner = data.mesh.triangle[triangle];
    const glm::dvec2 size(map.width, map.height);
    const auto at = [&](int k) { return glm::dvec2(to_glm(map.texcoord[corner[k]])) * size; };
    const glm::dvec2 e1 = at(1) - at(0), e2 = at(2) - at(0);
    const double area = e1.x * e2.y - e1.y * e2.x;
    if (area == 0) return;
    step_x_ = glm::dvec2(e2.y, -e1.y) / area;
    step_y_ = glm::dvec2(-e2.x, e1.x) / area;
    const auto position = [&](const glm::vec3& weight) {
      return surface.point_on(triangle, weight).position;
    };
    const glm::vec3 origin = position({1, 0, 0});
    const float doubled =
        glm::length(glm::cross(position({0, 1, 0}) - origin, position({0, 0, 1}) - origin));
    width_ = static_cast<float>(std::sqrt(doubled / std::abs(area)));
  }

  /// Metres of surface per texel.
  float width() const { return width_; }

  /// The point `offset` texels from the point at `weight`, clamped to the triangle.
  glm::vec3 moved(const Float2& weight, const glm::vec2& offset) const {
    const glm::dvec2 inside =
        glm::max(glm::dvec2(to_glm(weight)) + static_cast<double>(offset.x) * step_x_ +
                     static_cast<double>(offset.y) * step_y_,
                 glm::dvec2(0));
    const glm::dvec2 kept = inside / std::max(1.0, inside.x + inside.y);
    return {1 - kept.x - kept.y, kept.x, kept.y};
  }

 private:
  glm::dvec2 step_x_{0}, step_y_{0};  ///< change of the weights per texel to the right, and down
  float width_ = 0;
};

}  // namespace

ScreenImage light_texture(const TransferData& data, const SurfaceLighter& lighter,
                          std::span<const Float3> added, std::span<const std::uint8_t> chosen,
                          float exposure) {
  const Lightmap& map = data.lightmap;
  const auto texel_count = static_cast<std::uint32_t>(map.triangle.size());
  const auto count = static_cast<std::uint32_t>(lighter.samples_per_piece());
  Picture picture{.width = static_cast<int>(map.width), .height = static_cast<int>(map.height)};
  picture.pixel.assign(texel_count, Float3{0, 0, 0});
#pragma omp parallel for schedule(dynamic)
  for (std::uint32_t begin = 0; begin < texel_count; begin += kTexelBlock) {
    const std::uint32_t end = std::min(begin + kTexelBlock, texel_count);
    std::vector<std::uint32_t> texels;
    std::vector<LitPiece> pieces;
    std::vector<CameraSample> samples;
    for (std::uint32_t k = begin; k < end; ++k) {
      const std::uint32_t t = map.triangle[k];
      if (t == kNone || chosen[t] == 0) continue;
      const TexelFrame frame(data, lighter.surface(), t);
      const auto piece = begin + static_cast<std::uint32_t>(pieces.size());
      texels.push_back(k);
      pieces.push_back({lighter.surface().point_on(t, frame.moved(map.weight[k], {0, 0})),
                        frame.width(), added.empty() ? Float3{} : added[k]});
      for (std::uint32_t s = 0; s < count; ++s) {
        const glm::vec2 offset(r2_point(s, {hash_to_unit(piece, 0), hash_to_unit(piece, 1)}) - 0.5);
        CameraSample sample{.pixel = piece, .index = s};
        sample.point = lighter.surface().point_on(t, frame.moved(map.weight[k], offset));
        samples.push_back(sample);
      }
    }
    const std::vector<glm::vec3> shown =
        lighter.shown(begin, pieces, samples, std::exp2(exposure), true);
    for (std::size_t k = 0; k < texels.size(); ++k) {
      picture.pixel[texels[k]] = to_float3(glm::min(shown[k], glm::vec3(kBrightestTexel)));
    }
  }
  return tone_map(picture);
}

}  // namespace rebounce
