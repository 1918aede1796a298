#include "enclosed_sides.h"

#include <algorithm>
#include <array>
#include <limits>

#include "hemisphere_rays.h"

namespace rebounce {
namespace {

// The first few rays tell of most sides that they are not inside.
constexpr std::uint32_t kRays = 32, kFirstRays = 4;

// What meets nothing within this part of the scene's diagonal is out, nor need it go farther than
// these metres: where a person can stand there may be lamps.
constexpr double kReach = 1.0 / 4, kRoom = 1.5;

// A path keeps this part at each bounce, so that after kBounces of them nothing is left that
// counts.
constexpr float kKept = 0.5F;
constexpr int kBounces = 8;

// A side is inside if no larger part of its light gets out.
constexpr float kLargestLeak = 0.04F;

// What a ray may meet beside one of the sides that are asked about.
constexpr std::uint32_t kOut = kNone, kAbsorbed = kNone - 1;

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
    find_candidates();
    trace();
    std::vector<float> out(candidates_.size(), 0.0F);
    for (int bounce = 0; bounce < kBounces; ++bounce) out = one_more_bounce(out);
    for (std::size_t k = 0; k < candidates_.size(); ++k) {
      if (out[k] <= kLargestLeak) kind(candidates_[k]) = SideKind::kBuried;
    }
  }

 private:
  /// Sides are numbered by their triangles, fronts even and backs odd.
  static constexpr std::uint32_t number(std::uint32_t t, bool front) {
    return 2 * t + (front ? 0 : 1);
  }

  SideKind& kind(std::uint32_t side) {
    return side % 2 == 0 ? sides_[side / 2].front : sides_[side / 2].back;
  }

  const Material& material(std::uint32_t t) const {
    return scene_.materials[scene_.triangle_material[t]];
  }

  bool emits(std::uint32_t t) const { return material(t).emitted_luminance != Float3{0, 0, 0}; }

  /// Lit sides of double-sided triangles from which no ray of the first few is out.
  void find_candidates() {
    std::vector<std::uint8_t> may(2 * sides_.size(), 0);
#pragma omp parallel
    {
      std::vector<Ray> rays(kFirstRays);
      std::vector<Hit> hits(kFirstRays);
#pragma omp for schedule(dynamic, 256)
      for (std::uint32_t side = 0; side < may.size(); ++side) {
        if (kind(side) != SideKind::kLit || !material(side / 2).double_sided) continue;
        look(side, rays, hits);
        may[side] = std::ranges::any_of(hits, [&](const Hit& h) { return is_out(h); }) ? 0 : 1;
      }
    }
    place_.assign(may.size(), kOut);
    for (std::uint32_t side = 0; side < may.size(); ++side) {
      if (may[side] == 0) continue;
      place_[side] = static_cast<std::uint32_t>(candidates_.size());
      candidates_.push_back(side);
    }
  }

  /// Finds which candidate each ray of the candidates meets.
  void trace() {
    met_.resize(candidates_.size() * kRays);
#pragma omp parallel
    {
      std::vector<Ray> rays(kRays);
      std::vector<Hit> hits(kRays);
#pragma omp for schedule(dynamic, 64)
      for (std::size_t k = 0; k < candidates_.size(); ++k) {
        look(candidates_[k], rays, hits);
        std::ranges::transform(hits, &met_[k * kRays], [&](const Hit& hit) { return met(hit); });
      }
    }
  }

  void look(std::uint32_t side, std::span<Ray> rays, std::span<Hit> hits) const {
    std::array<glm::dvec3, 3> corner;
    for (int k = 0; k < 3; ++k) {
      corner[k] = to_dvec3(scene_.position[scene_.triangle[side / 2][k]]);
    }
    const glm::dvec3 cross = glm::cross(corner[1] - corner[0], corner[2] - corner[0]);
    const glm::dvec3 normal = glm::normalize(cross) * (side % 2 == 0 ? 1.0 : -1.0);
    make_hemisphere_rays(corner, normal, tracer_, mix_bits(side), rays);
    tracer_.intersect(rays, hits);
  }

  bool is_out(const Hit& hit) const {
    return hit.triangle == kNone || hit.t > reach_ || emits(hit.triangle);
  }

  /// What a ray has met, as far as that tells whether light gets out.
  std::uint32_t met(const Hit& hit) const {
    if (is_out(hit)) return kOut;
    if (!hit.front && !material(hit.triangle).double_sided) return kAbsorbed;
    return place_[number(hit.triangle, hit.front)];
  }

  /// The part of each candidate's light that gets out with one bounce more than in `out`.
  std::vector<float> one_more_bounce(const std::vector<float>& out) const {
    std::vector<float> next(out.size());
#pragma omp parallel for
    for (std::size_t k = 0; k < out.size(); ++k) {
      float sum = 0;
      for (std::size_t ray = k * kRays; ray < (k + 1) * kRays; ++ray) {
        if (met_[ray] == kAbsorbed) continue;
        sum += met_[ray] == kOut ? 1 : kKept * out[met_[ray]];
      }
      next[k] = sum / kRays;
    }
    return next;
  }

  const Scene& scene_;
  const RayTracer& tracer_;
  std::vector<TriangleSides>& sides_;
  double reach_;                           ///< metres
  std::vector<std::uint32_t> candidates_;  ///< sides
  std::vector<std::uint32_t> place_;       ///< [side] among the candidates, or kOut
  std::vector<std::uint32_t> met_;  ///< [candidate, ray] a candidate's place, kOut or kAbsorbed
};

}  // namespace

void bury_enclosed_sides(const Scene& scene, const RayTracer& tracer,
                         std::vector<TriangleSides>& sides) {
  EnclosedSides(scene, tracer, sides).run();
}

}  // namespace rebounce
