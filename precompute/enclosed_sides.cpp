#include "enclosed_sides.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "hemisphere_rays.h"

namespace rebounce {
namespace {

// What meets nothing within this part of the scene's diagonal is out, nor need it go farther than
// these metres: where a person can stand there may be lamps.
constexpr double kReach = 1.0 / 4, kRoom = 1.5;

/// A look at a side: by how many paths all in all, and how many of them may be out at most, if it
/// is not to count as lit. More are followed only where that is in doubt.
struct Look {
  std::uint32_t paths, most_out;
};

// The last allows 4 %; a side of twice that is taken for inside once in fifty times, one of a
// quarter is taken for lit once in five hundred.
constexpr std::array<Look, 4> kLooks{{{4, 1}, {12, 2}, {32, 3}, {128, 5}}};

// So many paths of which none is out are enough.
constexpr std::uint32_t kClear = 32;

// Sides of triangles that follow each other, no farther apart than this part of the reach, are
// first looked at together, by so many paths each: where none is out they are all inside, where
// this part of them or more is out they are all lit.
constexpr std::size_t kGroup = 8;
constexpr double kGroupReach = 1.0 / 8;
constexpr std::uint32_t kGroupPaths = 8;
constexpr double kClearlyLit = 1.0 / 8;

// A group is looked at twice; it is lit already if twice that part of the first paths is out.
constexpr std::uint32_t kFirstPaths = 16;

// Of a triangle larger than the square of this part of the reach none may be out of so many paths
// for each such square, up to a largest number: a wall's triangle may look out from behind a board.
constexpr double kLarge = 1.0 / 8;
constexpr std::uint32_t kMostPaths = 2048;

// Half of the paths end at each bounce; none is followed for longer than this.
constexpr int kBounces = 16;

class EnclosedSides {
 public:
  EnclosedSides(const Scene& scene, const RayTracer& tracer, std::vector<TriangleSides>& sides)
      : scene_(scene), tracer_(tracer), sides_(sides) {
    glm::dvec3 low(std::numeric_limits<double>::max()), high = -low;
    for (const Float3& p : scene.position) {
      low = glm::min(low, to_dvec3(p));
      high = glm::max(high, to_dvec3(p));
    }
    reach_ = std::min(kReach * glm::distance(low, high), kRoom);
  }

  void run() {
    group_candidates();
    const std::size_t group_count = group_begin_.size() - 1;
    std::vector<std::uint8_t> inside(candidates_.size(), 0);
#pragma omp parallel
    {
      Scratch scratch;
#pragma omp for schedule(dynamic, 64)
      for (std::size_t g = 0; g < group_count; ++g) {
        const std::size_t begin = group_begin_[g], end = group_begin_[g + 1];
        const Verdict verdict =
            look_at(std::span(candidates_).subspan(begin, end - begin), scratch);
        if (verdict == Verdict::kLit) continue;
        for (std::size_t k = begin; k < end; ++k) {
          const bool is = verdict == Verdict::kInside || is_inside(candidates_[k], scratch);
          inside[k] = is ? 1 : 0;
        }
      }
    }
    for (std::size_t k = 0; k < candidates_.size(); ++k) {
      if (inside[k] != 0) kind(candidates_[k]) = SideKind::kBuried;
    }
  }

 private:
  enum class Verdict : std::uint8_t { kInside, kLit, kDoubt };

  struct Scratch {
    std::vector<Ray> rays;  ///< of the paths that go on; their ids are the paths' numbers
    std::vector<Hit> hits;
  };

  /// Sides are numbered by their triangles, fronts even and backs odd.
  SideKind& kind(std::uint32_t side) {
    return side % 2 == 0 ? sides_[side / 2].front : sides_[side / 2].back;
  }

  const Material& material(std::uint32_t t) const {
    return scene_.materials[scene_.triangle_material[t]];
  }

  bool emits(std::uint32_t t) const {
    return material(t).emitted_luminance != Float3{0, 0, 0};
  }

  /// Gathers the lit sides of double-sided triangles, fronts first.
  void group_candidates() {
    for (const bool front : {true, false}) {
      for (std::uint32_t t = 0; t < sides_.size(); ++t) {
        const std::uint32_t side = 2 * t + (front ? 0 : 1);
        if (kind(side) != SideKind::kLit || !material(t).double_sided) continue;
        if (!joins_group(side)) {
          group_begin_.push_back(static_cast<std::uint32_t>(candidates_.size()));
        }
        candidates_.push_back(side);
      }
    }
    group_begin_.push_back(static_cast<std::uint32_t>(candidates_.size()));
  }

  /// True if a side is like the first of the last group, and there is room for it.
  bool joins_group(std::uint32_t side) const {
    if (group_begin_.empty() || candidates_.size() - group_begin_.back() >= kGroup) return false;
    const std::uint32_t first = candidates_[group_begin_.back()];
    return first % 2 == side % 2 && area(first / 2) <= 1 && area(side / 2) <= 1 &&
           glm::distance(centroid(first / 2), centroid(side / 2)) <= kGroupReach * reach_;
  }

  glm::dvec3 centroid(std::uint32_t t) const {
    const auto [a, b, c] = scene_.triangle[t];
    return (to_dvec3(scene_.position[a]) + to_dvec3(scene_.position[b]) +
            to_dvec3(scene_.position[c])) /
           3.0;
  }

  /// Tells what all of a group are, if that is clear.
  Verdict look_at(std::span<const std::uint32_t> group, Scratch& scratch) const {
    if (group.size() == 1) return Verdict::kDoubt;
    const std::size_t count = std::max<std::size_t>(kClear, kGroupPaths * group.size());
    std::uint32_t out = count_paths_out(group, 0, kFirstPaths, scratch);
    if (out >= 2 * kClearlyLit * kFirstPaths) return Verdict::kLit;
    out += count_paths_out(group, kFirstPaths, count, scratch);
    if (out == 0) return Verdict::kInside;
    return out >= kClearlyLit * static_cast<double>(count) ? Verdict::kLit : Verdict::kDoubt;
  }

  /// Tells whether of so many paths that the sides take in turn none gets out.
  bool is_none_out(std::span<const std::uint32_t> sides, std::size_t count,
                   Scratch& scratch) const {
    for (std::size_t begin = 0, end = 4; begin < count; begin = end, end *= 4) {
      end = std::min(end, count);
      if (count_paths_out(sides, begin, end, scratch) > 0) return false;
    }
    return true;
  }

  /// In such squares as are large.
  double area(std::uint32_t t) const {
    const auto [a, b, c] = scene_.triangle[t];
    const glm::dvec3 p = to_dvec3(scene_.position[a]);
    const glm::dvec3 cross =
        glm::cross(to_dvec3(scene_.position[b]) - p, to_dvec3(scene_.position[c]) - p);
    return 0.5 * glm::length(cross) / std::pow(kLarge * reach_, 2);
  }

  bool is_inside(std::uint32_t side, Scratch& scratch) const {
    if (const double size = area(side / 2); size > 1) {
      const auto paths = static_cast<std::size_t>(std::min<double>(kMostPaths, kClear * size));
      return is_none_out({&side, 1}, paths, scratch);
    }
    std::uint32_t begin = 0, out = 0;
    for (const Look& look : kLooks) {
      out += count_paths_out({&side, 1}, begin, look.paths, scratch);
      if (out > look.most_out) return false;
      if (out == 0 && look.paths >= kClear) return true;
      begin = look.paths;
    }
    return true;
  }

  /// How many of the paths [begin, end) get out, which the sides take in turn.
  std::uint32_t count_paths_out(std::span<const std::uint32_t> sides, std::size_t begin,
                                std::size_t end, Scratch& scratch) const {
    scratch.rays.resize(end - begin);
    for (std::size_t k = begin; k < end; ++k) {
      scratch.rays[k - begin] = start_path(sides[k % sides.size()], static_cast<std::uint32_t>(k));
    }
    std::uint32_t out = 0;
    for (int bounce = 0; bounce < kBounces && !scratch.rays.empty(); ++bounce) {
      scratch.hits.resize(scratch.rays.size());
      tracer_.intersect(scratch.rays, scratch.hits);
      std::size_t kept = 0;
      for (std::size_t k = 0; k < scratch.rays.size(); ++k) {
        const Ray& ray = scratch.rays[k];
        const Hit& hit = scratch.hits[k];
        if (is_out(hit)) {
          ++out;
        } else if (reflects(hit)) {
          const std::uint64_t bits = path_bits(sides[ray.id % sides.size()], ray.id, bounce);
          if (bits % 2 == 0) scratch.rays[kept++] = reflect(ray, hit, mix_bits(bits));
        }
      }
      scratch.rays.resize(kept);
    }
    return out;
  }

  static std::uint64_t path_bits(std::uint32_t side, std::uint32_t path, int bounce) {
    return mix_bits(mix_bits(side) ^ (std::uint64_t{path} << 8 | static_cast<unsigned>(bounce)));
  }

  Ray start_path(std::uint32_t side, std::uint32_t path) const {
    std::array<glm::dvec3, 3> corner;
    for (int k = 0; k < 3; ++k) {
      corner[k] = to_dvec3(scene_.position[scene_.triangle[side / 2][k]]);
    }
    Ray ray{};
    make_hemisphere_rays(corner, normal(side / 2, side % 2 == 0), tracer_, mix_bits(side),
                         {&ray, 1}, path);
    ray.id = path;
    return ray;
  }

  glm::dvec3 normal(std::uint32_t t, bool front) const {
    const auto [a, b, c] = scene_.triangle[t];
    const glm::dvec3 p = to_dvec3(scene_.position[a]);
    const glm::dvec3 cross =
        glm::cross(to_dvec3(scene_.position[b]) - p, to_dvec3(scene_.position[c]) - p);
    return glm::normalize(cross) * (front ? 1.0 : -1.0);
  }

  bool is_out(const Hit& hit) const {
    return hit.triangle == kNone || hit.t > reach_ || emits(hit.triangle);
  }

  /// Backs of one-sided surfaces absorb, and so does what is buried already.
  bool reflects(const Hit& hit) const {
    if (hit.front) return sides_[hit.triangle].front != SideKind::kBuried;
    return material(hit.triangle).double_sided && sides_[hit.triangle].back != SideKind::kBuried;
  }

  /// Goes on from where `ray` has met something, in a direction that `bits` choose.
  Ray reflect(const Ray& ray, const Hit& hit, std::uint64_t bits) const {
    const glm::dvec3 place = to_dvec3(ray.origin) + double{hit.t} * to_dvec3(ray.direction);
    const glm::dvec3 n = normal(hit.triangle, hit.front);
    const glm::dvec3 direction = frame_around(n) * square_to_cosine_hemisphere(unit_square(bits));
    Ray next = make_free_ray({to_float3(place), to_float3(n)}, glm::vec3(direction), tracer_);
    next.id = ray.id;
    return next;
  }

  const Scene& scene_;
  const RayTracer& tracer_;
  std::vector<TriangleSides>& sides_;
  double reach_;                            ///< metres
  std::vector<std::uint32_t> candidates_;   ///< sides
  std::vector<std::uint32_t> group_begin_;  ///< [g + 1] in candidates_
};

}  // namespace

void bury_enclosed_sides(const Scene& scene, const RayTracer& tracer,
                         std::vector<TriangleSides>& sides) {
  EnclosedSides(scene, tracer, sides).run();
}

}  // namespace rebounce
