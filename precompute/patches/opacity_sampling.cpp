#include "precompute/patches/opacity_sampling.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "precompute/patches/texture_sampling.h"
#include "rebounce/error.h"
#include "transfer/data/opacity_maps.h"

namespace rebounce {
namespace {

using Map = std::vector<std::uint8_t>;

constexpr double kTexelsPerMicroTriangle = 4;

// A micro-triangle is sampled at the centres of its parts, this number of levels finer.
constexpr int kSampleLevels = 1;

bool is_opaque(const Material& material) {
  return material.alpha_mode == AlphaMode::kOpaque && material.transmission == 0;
}

/// A material that emits counts as if it transmitted nothing.
double untransmitted_part(const Material& material) {
  const bool emits = material.emitted_luminance != Float3{0, 0, 0};
  return emits ? 1 : 1 - static_cast<double>(material.transmission);
}

class TriangleSampler {
 public:
  TriangleSampler(const Scene& scene, const Material& material,
                  const std::array<Float2, 3>& texcoord)
      : scene_(scene), material_(material), texcoord_(texcoord) {}

  Map sample() const {
    Map map(std::size_t{1} << (2 * level()));
    for (std::uint32_t k = 0; k < map.size(); ++k) {
      map[k] =
          static_cast<std::uint8_t>(std::lround(OpacityMaps::kOpaque * opacity_of(k, level())));
    }
    while (drop_level(map)) {
    }
    return map;
  }

 private:
  int level() const {
    const bool is_uniform =
        material_.alpha_mode == AlphaMode::kOpaque || material_.base_color_texture == kNone;
    if (is_uniform) return 0;
    const Image& image = scene_.images.at(material_.base_color_texture);
    const auto texels = [&](int from, int to) {
      return std::array{
          (static_cast<double>(texcoord_[to][0]) - texcoord_[from][0]) * image.width,
          (static_cast<double>(texcoord_[to][1]) - texcoord_[from][1]) * image.height};
    };
    const auto a = texels(0, 1), b = texels(0, 2), c = texels(1, 2);
    const double area = std::abs(a[0] * b[1] - a[1] * b[0]) / 2;
    const double longest =
        std::max({std::hypot(a[0], a[1]), std::hypot(b[0], b[1]), std::hypot(c[0], c[1])});
    const double level = 0.5 * std::log2((area + longest) / kTexelsPerMicroTriangle);
    if (!(level < OpacityMaps::kMaxLevel)) return OpacityMaps::kMaxLevel;
    // It is minus infinity where all corners have the same coordinates.
    return static_cast<int>(std::ceil(std::max(level, 1.0)));
  }

  double opacity_of(std::uint32_t micro_triangle, int level) const {
    constexpr std::uint32_t kCount = 1U << (2 * kSampleLevels);
    double sum = 0;
    for (std::uint32_t k = 0; k < kCount; ++k) {
      const auto [u, v] = place_in_micro_triangle(level + kSampleLevels,
                                                  micro_triangle * kCount + k, {1.0 / 3, 1.0 / 3});
      sum += opacity_at(scene_, material_, texcoord_at(u, v));
    }
    return untransmitted_part(material_) * sum / kCount;
  }

  Float2 texcoord_at(double u, double v) const {
    Float2 at;
    for (std::size_t k = 0; k < at.size(); ++k) {
      at[k] = static_cast<float>((1 - u - v) * texcoord_[0][k] + u * texcoord_[1][k] +
                                 v * texcoord_[2][k]);
    }
    return at;
  }

  /// Drops the finest level if it contains no information.
  static bool drop_level(Map& map) {
    if (map.size() == 1) return false;
    for (std::size_t k = 0; k < map.size(); k += 4) {
      const bool same = std::all_of(&map[k], &map[k] + 4, [&](auto x) { return x == map[k]; });
      if (!same) return false;
    }
    for (std::size_t k = 0; 4 * k < map.size(); ++k) map[k] = map[4 * k];
    map.resize(map.size() / 4);
    return true;
  }

  const Scene& scene_;
  const Material& material_;
  const std::array<Float2, 3> texcoord_;
};

/// Collects the maps in one array, equal ones once; a fully opaque triangle has none. `map_of` is
/// the map of each triangle, or kNone.
OpacityMaps collect(const std::vector<Map>& maps, std::span<const std::uint32_t> map_of) {
  OpacityMaps collected;
  std::unordered_map<std::string_view, std::uint32_t> known;
  std::vector<std::uint32_t> place;  // of each map
  collected.begin = {0};
  for (const Map& map : maps) {
    const std::string_view bytes(reinterpret_cast<const char*>(map.data()), map.size());
    const bool opaque = map == Map{OpacityMaps::kOpaque};
    const auto next = opaque ? kNone : static_cast<std::uint32_t>(collected.map_count());
    const auto [entry, is_new] = known.try_emplace(bytes, next);
    place.push_back(entry->second);
    if (!is_new || opaque) continue;
    if (collected.opacity.size() + map.size() >= kNone) {
      throw Error("the scene's masks need more than 4 GiB of opacity maps; ask for fewer patches");
    }
    collected.opacity.insert(collected.opacity.end(), map.begin(), map.end());
    collected.begin.push_back(static_cast<std::uint32_t>(collected.opacity.size()));
  }
  if (collected.map_count() == 0) return {};
  for (const std::uint32_t map : map_of) {
    collected.triangle_map.push_back(map == kNone ? kNone : place[map]);
  }
  return collected;
}

/// The key of the map of a triangle: its material and the bits of its texture coordinates.
std::array<std::uint32_t, 7> sampling_key(std::uint32_t material,
                                          const std::array<Float2, 3>& texcoord) {
  std::array<std::uint32_t, 7> key{material};
  for (std::size_t k = 0; k < 6; ++k) {
    key[k + 1] = std::bit_cast<std::uint32_t>(texcoord[k / 2][k % 2]);
  }
  return key;
}

}  // namespace

OpacityMaps find_opacity_maps(const Scene& scene, std::span<const Uint3> triangle,
                              std::span<const std::uint32_t> triangle_material,
                              std::span<const Float2> texcoord) {
  // Instances share their maps: each is sampled once.
  std::map<std::array<std::uint32_t, 7>, std::uint32_t> known;
  std::vector<TriangleSampler> samplers;
  std::vector<std::uint32_t> map_of(triangle.size(), kNone);
  for (std::size_t t = 0; t < triangle.size(); ++t) {
    const Material& material = scene.materials[triangle_material[t]];
    if (is_opaque(material)) continue;
    const auto [a, b, c] = triangle[t];
    const std::array<Float2, 3> corners{texcoord[a], texcoord[b], texcoord[c]};
    const auto [entry, is_new] = known.try_emplace(sampling_key(triangle_material[t], corners),
                                                   static_cast<std::uint32_t>(samplers.size()));
    if (is_new) samplers.emplace_back(scene, material, corners);
    map_of[t] = entry->second;
  }
  std::vector<Map> maps(samplers.size());
#pragma omp parallel for schedule(dynamic, 64)
  for (std::size_t k = 0; k < maps.size(); ++k) maps[k] = samplers[k].sample();
  return collect(maps, map_of);
}

OpacityMaps find_opacity_maps(const Scene& scene) {
  return find_opacity_maps(scene, scene.triangle, scene.triangle_material,
                           scene.base_color_texcoord);
}

}  // namespace rebounce
