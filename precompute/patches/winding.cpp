#include "precompute/patches/winding.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <utility>

#include "precompute/base/edge_table.h"
#include "precompute/import/import_gltf.h"
#include "precompute/patches/welded_positions.h"
#include "precompute/sampling/hemisphere_rays.h"
#include "runtime/rays/ray_tracer.h"
#include "runtime/rays/triangle.h"
#include "transfer/base/disjoint_sets.h"

namespace rebounce {
namespace {

// A piece with a thousandth of the area of the scene sends and receives about a hundred of these
// rays.
constexpr std::uint32_t kRayCount = 1U << 18;
constexpr std::uint32_t kRaysPerBatch = 1U << 10;

// Fewer rays on a piece tell nothing: with 16 of one kind and none of the other, the true fraction
// may still be one in six.
constexpr std::uint32_t kFewestHits = 16;

// A piece whose front gets more than this fraction of the rays that meet it is visible from its
// front.
constexpr double kLargestFrontShare = 0.02;

// A back that gets less than this fraction of what it would get in a closed room is visible through
// cracks only.
constexpr double kLeastBackCoverage = 0.02;

// If a smaller fraction of rays from fronts meets something, the fronts of the scene exchange no
// light.
constexpr double kNoExchange = 1e-3;

// [t] The piece of each triangle, numbered by one of its triangles.
std::vector<std::uint32_t> find_pieces(const Scene& scene, const WeldedPositions& place) {
  const auto corner = [&](std::uint32_t t) {
    const auto& [a, b, c] = scene.triangle[t];
    return Uint3{place.id[a], place.id[b], place.id[c]};
  };
  const EdgeTable edges(scene.triangle.size(), place.count, corner);
  DisjointSets sets(scene.triangle.size());
  edges.for_each([&](std::uint32_t /*low*/, std::span<const HalfEdge> sides) {
    const bool is_consistent = sides.size() == 2 && sides[0].ascends() != sides[1].ascends();
    if (is_consistent) sets.join(sides[0].triangle(), sides[1].triangle());
  });
  std::vector<std::uint32_t> piece(scene.triangle.size());
  for (std::uint32_t t = 0; t < piece.size(); ++t) piece[t] = sets.find(t);
  return piece;
}

// [t] Whether another triangle has the same corners. One of the two is then the second side of the
// other, and it is arbitrary which of them a ray meets.
std::vector<bool> find_coincident(const Scene& scene, const WeldedPositions& place) {
  std::vector<std::pair<Uint3, std::uint32_t>> corners(scene.triangle.size());
  for (std::uint32_t t = 0; t < corners.size(); ++t) {
    Uint3 corner{};
    for (std::size_t k = 0; k < 3; ++k) corner[k] = place.id[scene.triangle[t][k]];
    std::sort(corner.begin(), corner.end());
    corners[t] = {corner, t};
  }
  std::sort(corners.begin(), corners.end());
  std::vector<bool> coincident(corners.size(), false);
  for (std::size_t i = 1; i < corners.size(); ++i) {
    if (corners[i].first != corners[i - 1].first) continue;
    coincident[corners[i].second] = coincident[corners[i - 1].second] = true;
  }
  return coincident;
}

// A hit of a ray, and the triangle that it comes from.
struct Sight {
  std::uint32_t from = kNone, to = kNone;  // triangles
  bool front = false;                      // it met the front of `to`
};

// Rays from the sides of the triangles of the scene, in proportion to their area.
class Sights {
 public:
  Sights(const Scene& scene, const RayTracer& tracer) : scene_(scene), tracer_(tracer) {
    area_end_.reserve(scene.triangle.size());
    double sum = 0;
    for (std::uint32_t t = 0; t < scene.triangle.size(); ++t) {
      sum += area_of(corners_of(scene, t)) * (is_double_sided(t) ? 2 : 1);
      area_end_.push_back(sum);
    }
  }

  bool is_double_sided(std::uint32_t t) const {
    return scene_.materials[scene_.triangle_material[t]].double_sided;
  }

  // The area that one ray stands for.
  double area_per_ray() const { return area_end_.back() / kRayCount; }

  // Traces rays from the fronts, and from both sides of double-sided triangles; or from the backs
  // of one-sided triangles.
  std::vector<Sight> trace(bool from_fronts) const {
    std::vector<Sight> sights(kRayCount);
#pragma omp parallel
    {
      std::vector<Ray> rays(kRaysPerBatch);
      std::vector<Hit> hits(kRaysPerBatch);
#pragma omp for schedule(dynamic, 1)
      for (std::uint32_t first = 0; first < kRayCount; first += kRaysPerBatch) {
        for (std::uint32_t k = 0; k < kRaysPerBatch; ++k) {
          rays[k] = make_ray(first + k, from_fronts, sights[first + k].from);
        }
        tracer_.intersect(rays, hits);
        for (std::uint32_t k = 0; k < kRaysPerBatch; ++k) {
          sights[first + k].to = hits[k].triangle;
          sights[first + k].front = hits[k].front;
        }
      }
    }
    return sights;
  }

 private:
  Ray make_ray(std::uint32_t k, bool from_front, std::uint32_t& t) const {
    const double place = (k + 0.5) * area_per_ray();
    const auto end = std::upper_bound(area_end_.begin(), area_end_.end() - 1, place);
    t = static_cast<std::uint32_t>(end - area_end_.begin());
    const TriangleCorners corner = corners_of(scene_, t);
    glm::dvec3 normal = front_normal(corner) * (from_front ? 1.0 : -1.0);
    if (is_double_sided(t) && k % 2 == 1) normal = -normal;
    Ray ray;
    make_hemisphere_rays(corner, normal, tracer_, mix_bits(k), {&ray, 1});
    return ray;
  }

  const Scene& scene_;
  const RayTracer& tracer_;
  std::vector<double> area_end_;  // [t] sum of the areas of the sides up to this triangle
};

// How much of a piece the others see.
struct Exposure {
  double area = 0;
  std::uint32_t front_hits = 0, back_hits = 0;
  bool may_be_turned = false;
};

class InsideOutSearch {
 public:
  InsideOutSearch(const Scene& scene, const RayTracer& tracer)
      : scene_(scene), sights_(scene, tracer), exposure_(scene.triangle.size()) {
    const WeldedPositions place = weld_positions(scene.position);
    piece_ = find_pieces(scene, place);
    coincident_ = find_coincident(scene, place);
    for (std::uint32_t t = 0; t < piece_.size(); ++t) {
      Exposure& exposure = exposure_[piece_[t]];
      exposure.area += area_of(corners_of(scene, t));
      if (!sights_.is_double_sided(t) && !coincident_[t]) exposure.may_be_turned = true;
    }
  }

  std::vector<InsideOutPiece> run() {
    const std::vector<Sight> sights = sights_.trace(true);
    const auto met = std::count_if(sights.begin(), sights.end(),
                                   [](const Sight& sight) { return sight.to != kNone; });
    if (static_cast<double>(met) < kNoExchange * kRayCount) {
      count(sights_.trace(false), true);
    } else {
      count(sights, false);
    }
    return turned_pieces();
  }

 private:
  void count(const std::vector<Sight>& sights, bool within_pieces) {
    for (const Sight& sight : sights) {
      if (sight.to == kNone || coincident_[sight.to] || sights_.is_double_sided(sight.to)) continue;
      if (!within_pieces && piece_[sight.from] == piece_[sight.to]) continue;
      Exposure& exposure = exposure_[piece_[sight.to]];
      ++(sight.front ? exposure.front_hits : exposure.back_hits);
    }
  }

  std::vector<InsideOutPiece> turned_pieces() const {
    std::vector<std::uint32_t> slot(exposure_.size(), kNone);
    std::vector<InsideOutPiece> turned;
    for (std::uint32_t t = 0; t < piece_.size(); ++t) {
      const Exposure& exposure = exposure_[piece_[t]];
      if (!is_turned(exposure)) continue;
      if (slot[piece_[t]] == kNone) {
        slot[piece_[t]] = static_cast<std::uint32_t>(turned.size());
        turned.push_back({{}, exposure.area, front_share(exposure), back_coverage(exposure)});
      }
      turned[slot[piece_[t]]].triangle.push_back(t);
    }
    std::stable_sort(turned.begin(), turned.end(),
                     [](const auto& a, const auto& b) { return a.area > b.area; });
    return turned;
  }

  bool is_turned(const Exposure& exposure) const {
    return exposure.may_be_turned && exposure.back_hits >= kFewestHits &&
           front_share(exposure) <= kLargestFrontShare &&
           back_coverage(exposure) >= kLeastBackCoverage;
  }

  static double front_share(const Exposure& exposure) {
    return static_cast<double>(exposure.front_hits) / (exposure.front_hits + exposure.back_hits);
  }

  double back_coverage(const Exposure& exposure) const {
    return std::min(1.0, exposure.back_hits * sights_.area_per_ray() / exposure.area);
  }

  const Scene& scene_;
  Sights sights_;
  std::vector<std::uint32_t> piece_;  // [t]
  std::vector<bool> coincident_;      // [t]
  std::vector<Exposure> exposure_;    // [t] at the number of each piece
};

}  // namespace

std::vector<InsideOutPiece> find_inside_out(const Scene& scene) {
  const auto is_one_sided = [&](std::uint32_t m) { return !scene.materials[m].double_sided; };
  if (std::ranges::none_of(scene.triangle_material, is_one_sided)) return {};
  const RayTracer tracer(scene.position, scene.triangle);
  return InsideOutSearch(scene, tracer).run();
}

void make_double_sided(Scene& scene, std::span<const InsideOutPiece> pieces) {
  if (pieces.empty()) return;
  std::map<std::uint32_t, std::uint32_t> double_sided;  // copies of materials
  std::size_t triangle_count = 0;
  for (const InsideOutPiece& piece : pieces) {
    triangle_count += piece.triangle.size();
    for (const std::uint32_t t : piece.triangle) {
      std::uint32_t& material = scene.triangle_material[t];
      const auto next = static_cast<std::uint32_t>(scene.materials.size());
      const auto [copy, is_new] = double_sided.try_emplace(material, next);
      if (is_new) {
        scene.materials.push_back(scene.materials[material]);
        scene.materials.back().double_sided = true;
      }
      material = copy->second;
    }
  }
  scene.warnings.push_back(
      fmt::format("{} triangles are seen from behind only and were taken as double-sided; check "
                  "their winding",
                  triangle_count));
}

Scene import_usable(const std::filesystem::path& path, double scale) {
  Scene scene = import_gltf(path, scale);
  scene.scale = scale;
  make_double_sided(scene, find_inside_out(scene));
  return scene;
}

}  // namespace rebounce
