#include "precompute/patches/lit_sides.h"

#include <algorithm>
#include <array>
#include <functional>

#include "precompute/patches/enclosed_sides.h"
#include "precompute/sampling/hemisphere_rays.h"
#include "runtime/rays/box.h"

namespace rebounce {
namespace {

// A side that sees other surfaces in less than about one of kRaysPerSide rays counts as seeing
// none. Most sides see one at once: the first ray is traced alone, then the number grows fourfold.
constexpr std::uint32_t kRaysPerSide = 256, kFirstRays = 1;

// Backs within this fraction of the diagonal of the scene may belong to the solid that a side is
// in; backs farther away may belong to a lit room.
constexpr double kBuriedReach = 1.0 / 16;

// Triangles between two reports of progress, and the progress when every side was tested alone.
constexpr std::size_t kSideBatch = 1 << 15;
constexpr double kAfterLooking = 0.4;

// Points at which a side is tested for copies of itself.
constexpr std::uint32_t kPointsPerSide = 32;

// Rays, on either face, by which a side that touches another looks for a solid.
constexpr std::uint32_t kRaysPerContact = 64;

class LitSides {
 public:
  LitSides(const Scene& scene, const RayTracer& tracer)
      : scene_(scene),
        tracer_(tracer),
        buried_reach_(kBuriedReach * box_around(scene.position).diagonal()) {}

  std::vector<TriangleSides> find(const Progress& progress) {
    const std::size_t count = scene_.triangle.size();
    sides_.resize(count);
    std::vector<Cover> covers;
    for (std::size_t begin = 0; begin < count; begin += kSideBatch) {
      report_progress(progress, static_cast<double>(begin) / static_cast<double>(count));
      look_at(begin, std::min(begin + kSideBatch, count), covers);
    }
    // Later triangles yield to earlier ones that have not yielded themselves.
    std::ranges::sort(covers, [](const Cover& a, const Cover& b) {
      return a.triangle != b.triangle ? a.triangle > b.triangle : a.front && !b.front;
    });
    for (const Cover& cover : covers) {
      if (!is_covered(cover)) continue;
      (cover.front ? sides_[cover.triangle].front : sides_[cover.triangle].back) =
          SideKind::kCovered;
    }
    return std::move(sides_);
  }

 private:
  struct Cover;

  /// Tests the sides of triangles [begin, end) alone.
  void look_at(std::size_t begin, std::size_t end, std::vector<Cover>& covers) {
#pragma omp parallel
    {
      Scratch scratch;
      std::vector<Cover> found;
#pragma omp for schedule(dynamic, 16)
      for (std::size_t k = begin; k < end; ++k) {
        const auto t = static_cast<std::uint32_t>(k);
        sides_[t].front = look_around(t, true, scratch);
        if (is_double_sided(t)) sides_[t].back = look_around(t, false, scratch);
        if (sides_[t].front == SideKind::kUnlit && sides_[t].back != SideKind::kLit) {
          sides_[t].front = SideKind::kLit;
        }
        if (sides_[t].front == SideKind::kLit) {
          sides_[t].front = look_for_contact(t, true, scratch, found);
        }
        if (sides_[t].back == SideKind::kLit) {
          sides_[t].back = look_for_contact(t, false, scratch, found);
        }
      }
#pragma omp critical
      std::ranges::move(found, std::back_inserter(covers));
    }
  }

  struct Scratch {
    std::vector<Ray> rays = std::vector<Ray>(kRaysPerSide);
    std::vector<Hit> hits;
    std::vector<CoincidentSide> sides;
  };

  /// A side, and the sides that together cover it.
  struct Cover {
    std::uint32_t triangle;
    bool front;
    std::vector<CoincidentSide> by;
  };

  struct Side {
    std::array<glm::dvec3, 3> corner;
    glm::dvec3 normal;
  };

  bool is_double_sided(std::uint32_t t) const {
    return scene_.materials[scene_.triangle_material[t]].double_sided;
  }

  Side side_of(std::uint32_t t, bool front) const {
    Side side;
    for (int k = 0; k < 3; ++k) side.corner[k] = to_dvec3(scene_.position[scene_.triangle[t][k]]);
    const auto& [a, b, c] = side.corner;
    side.normal = glm::normalize(glm::cross(b - a, c - a)) * (front ? 1.0 : -1.0);
    return side;
  }

  /// Classifies a side by what its rays see: kLit if it sees a side of a surface, kBuried if it
  /// only sees near backs, otherwise kUnlit. Stops as soon as this is certain; a one-sided triangle
  /// is only tested for kBuried.
  SideKind look_around(std::uint32_t t, bool front, Scratch& scratch) const {
    const Side side = side_of(t, front);
    bool buried = true;
    for (std::uint32_t first = 0, end = kFirstRays; first < kRaysPerSide; first = end, end *= 4) {
      const std::span rays = std::span(scratch.rays).first(end - first);
      make_hemisphere_rays(side.corner, side.normal, tracer_, mix_bits(t), rays, first);
      scratch.hits.resize(rays.size());
      tracer_.intersect(rays, scratch.hits);
      for (const Hit& hit : scratch.hits) {
        if (hit.triangle != kNone && (hit.front || is_double_sided(hit.triangle))) {
          return SideKind::kLit;
        }
        buried = buried && hit.triangle != kNone && hit.t < buried_reach_;
      }
      if (!buried && !is_double_sided(t)) return SideKind::kUnlit;
    }
    return buried ? SideKind::kBuried : SideKind::kUnlit;
  }

  /// True if at least half of the rays from one of the faces of a side meet backs of one-sided
  /// surfaces: a solid is there, such as the box that stands on a floor. Two surfaces back to back
  /// that form a sheet have no solid on either face.
  bool is_beside_solid(const Side& side, std::uint32_t t, Scratch& scratch) const {
    const std::span rays = std::span(scratch.rays).first(kRaysPerContact);
    scratch.hits.resize(rays.size());
    for (const double face : {1.0, -1.0}) {
      make_hemisphere_rays(side.corner, face * side.normal, tracer_, mix_bits(t), rays);
      tracer_.intersect(rays, scratch.hits);
      const auto backs = std::ranges::count_if(scratch.hits, [&](const Hit& hit) {
        return hit.triangle != kNone && !hit.front && !is_double_sided(hit.triangle);
      });
      if (2 * static_cast<std::size_t>(backs) >= rays.size()) return true;
    }
    return false;
  }

  /// Looks for other surfaces in the same place, at points all over a side. Returns kUnlit if it
  /// lies on fronts everywhere, with a solid behind one of the two. Otherwise adds the sides that
  /// together cover it to `covers`, unless some point is free. One side is enough for a point: that
  /// of the earliest triangle.
  SideKind look_for_contact(std::uint32_t t, bool front, Scratch& scratch,
                            std::vector<Cover>& covers) const {
    std::vector<CoincidentSide> cover;
    const Side side = side_of(t, front);
    const Float3 normal = to_float3(side.normal);
    const glm::dvec2 shift = unit_square(mix_bits(t));
    std::uint32_t sealed_count = 0;
    for (std::uint32_t k = 0; k < kPointsPerSide; ++k) {
      const glm::dvec2 b = square_to_triangle(r2_point(k, shift));
      const glm::dvec3 point =
          side.corner[0] * (1 - b.x - b.y) + side.corner[1] * b.x + side.corner[2] * b.y;
      find_coincident_sides(
          tracer_, to_float3(point), normal, t, [&](std::uint32_t o) { return is_double_sided(o); },
          scratch.hits, scratch.sides);
      std::ranges::sort(scratch.sides, {}, &CoincidentSide::triangle);
      const auto earliest = std::ranges::find_if(scratch.sides, &CoincidentSide::same_way);
      if (earliest != scratch.sides.end()) cover.push_back(*earliest);
      const bool sealed =
          std::ranges::any_of(scratch.sides, std::not_fn(&CoincidentSide::same_way));
      if (sealed) ++sealed_count;
      if (sealed_count <= k && cover.size() <= k) break;
    }
    if (cover.size() == kPointsPerSide) covers.push_back({t, front, std::move(cover)});
    const bool sealed = sealed_count == kPointsPerSide && is_beside_solid(side, t, scratch);
    return sealed ? SideKind::kUnlit : SideKind::kLit;
  }

  bool is_covered(const Cover& cover) const {
    return std::ranges::all_of(cover.by, [&](const CoincidentSide& by) {
      return (by.front ? sides_[by.triangle].front : sides_[by.triangle].back) == SideKind::kLit;
    });
  }

  const Scene& scene_;
  const RayTracer& tracer_;
  double buried_reach_;  ///< metres
  std::vector<TriangleSides> sides_;
};

}  // namespace

std::vector<TriangleSides> find_lit_sides(const Scene& scene, const RayTracer& tracer,
                                          const Progress& progress) {
  std::vector<TriangleSides> sides =
      LitSides(scene, tracer).find(part_of(progress, 0, kAfterLooking));
  bury_enclosed_sides(scene, tracer, sides, part_of(progress, kAfterLooking, 1));
  return sides;
}

}  // namespace rebounce
