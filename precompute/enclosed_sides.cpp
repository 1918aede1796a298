#include "enclosed_sides.h"

#include <algorithm>
#include <array>
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
    std::vector<std::uint8_t> inside(2 * sides_.size(), 0);
#pragma omp parallel
    {
      Scratch scratch;
#pragma omp for schedule(dynamic, 256)
      for (std::uint32_t side = 0; side < inside.size(); ++side) {
        if (kind(side) != SideKind::kLit || !material(side / 2).double_sided) continue;
        inside[side] = is_inside(side, scratch) ? 1 : 0;
      }
    }
    for (std::uint32_t side = 0; side < inside.size(); ++side) {
      if (inside[side] != 0) kind(side) = SideKind::kBuried;
    }
  }

 private:
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

  bool is_inside(std::uint32_t side, Scratch& scratch) const {
    std::uint32_t begin = 0, out = 0;
    for (const Look& look : kLooks) {
      out += count_paths_out(side, begin, look.paths, scratch);
      if (out > look.most_out) return false;
      if (out == 0 && look.paths >= kClear) return true;
      begin = look.paths;
    }
    return true;
  }

  /// How many of the paths [begin, end) of a side get out.
  std::uint32_t count_paths_out(std::uint32_t side, std::uint32_t begin, std::uint32_t end,
                                Scratch& scratch) const {
    start_paths(side, begin, end, scratch.rays);
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
          const std::uint64_t bits = path_bits(side, ray.id, bounce);
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

  void start_paths(std::uint32_t side, std::uint32_t begin, std::uint32_t end,
                   std::vector<Ray>& rays) const {
    std::array<glm::dvec3, 3> corner;
    for (int k = 0; k < 3; ++k) {
      corner[k] = to_dvec3(scene_.position[scene_.triangle[side / 2][k]]);
    }
    rays.resize(end - begin);
    make_hemisphere_rays(corner, normal(side / 2, side % 2 == 0), tracer_, mix_bits(side), rays,
                         begin);
    for (std::uint32_t k = begin; k < end; ++k) rays[k - begin].id = k;
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
  double reach_;  ///< metres
};

}  // namespace

void bury_enclosed_sides(const Scene& scene, const RayTracer& tracer,
                         std::vector<TriangleSides>& sides) {
  EnclosedSides(scene, tracer, sides).run();
}

}  // namespace rebounce
