#include "precompute/patches/enclosed_sides.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "precompute/patches/texture_sampling.h"
#include "precompute/sampling/hemisphere_rays.h"

namespace rebounce {
namespace {

// A path is outside if it meets nothing within this fraction of the diagonal of the scene, or
// within kRoom metres: where a person can stand, there may be lamps (lab/032).
constexpr double kReach = 1.0 / 4, kRoom = 1.5;

// At each bounce the reflected fraction of the paths continues, but at least half of them; no path
// has more bounces than this.
constexpr double kLeastSurvival = 0.5;
constexpr int kBounces = 32;

// Texture samples for the reflectance of a triangle.
constexpr int kTextureSamples = 16;

/// One step of the test of a single side, by this total number of paths: the side is inside if at
/// most `inside` of them are outside, lit if at least `lit` are, and tested further otherwise.
struct Look {
  std::uint32_t paths;
  int inside, lit;
};

// A sequential test (A. Wald, 1945), truncated. A side with 8 % of its paths outside is taken for
// inside once in eight times, one with 12 % once in fifty; one with 1 % is taken for lit once in
// 250 times.
constexpr std::array<Look, 10> kLooks{{{4, -1, 2},
                                       {12, -1, 3},
                                       {20, -1, 3},
                                       {32, 0, 4},
                                       {48, 0, 4},
                                       {64, 1, 5},
                                       {80, 2, 5},
                                       {96, 3, 6},
                                       {112, 4, 6},
                                       {128, 5, 6}}};

// A side smaller than the square of this fraction of the reach matters little: it gets one look.
constexpr double kTiny = 1.0 / 64;
constexpr Look kLookAtTiny{32, 1, 2};

// Consecutive sides of triangles no farther apart than this fraction of the reach are first tested
// together: by a number of paths in all, then by a number for each side, at least kLeastPaths in
// all, then by four times as many (lab/029).
constexpr std::size_t kGroup = 16;
constexpr double kGroupReach = 1.0 / 8;
constexpr std::size_t kFirstPaths = 16, kPathsOfSide = 4, kLeastPaths = 32;

// All sides of a group are lit if the fraction kFirstLit of the first paths, or kLitPart of all, is
// outside; all are inside if no path is. Of the rest, a side is lit if it has the fraction kLitPart
// outside in a group with more than kFew, and inside if it has none in a group with at most kFew.
constexpr double kFirstLit = 1.0 / 4, kLitPart = 1.0 / 8, kFew = 1.0 / 32;

// A triangle larger than the square of this fraction of the reach is only inside if none of a
// number of paths for each such square is outside, up to a largest number: a triangle of a wall may
// extend beyond a board that hides most of it.
constexpr double kLarge = 1.0 / 8;
constexpr std::uint32_t kPathsOfSquare = 32, kMostPaths = 2048;

// The id of a ray holds the number of its path in the low bits, and that of the side in its group
// above.
constexpr int kPathBits = 16;
static_assert(kMostPaths <= 1U << kPathBits);

// Groups between two reports of progress.
constexpr std::size_t kGroupBatch = 1 << 13;

class EnclosedSides {
 public:
  EnclosedSides(const Scene& scene, const RayTracer& tracer, std::vector<TriangleSides>& sides)
      : scene_(scene), tracer_(tracer), sides_(sides), surface_(sides.size()) {
    glm::dvec3 low(std::numeric_limits<double>::max()), high = -low;
    for (const Float3& p : scene.position) {
      low = glm::min(low, to_dvec3(p));
      high = glm::max(high, to_dvec3(p));
    }
    reach_ = std::min(kReach * glm::distance(low, high), kRoom);
#pragma omp parallel for schedule(static)
    for (std::uint32_t t = 0; t < surface_.size(); ++t) surface_[t] = surface_of(t);
    group_candidates();
  }

  void run(const Progress& progress) {
    const std::size_t count = group_begin_.size() - 1;
    for (std::size_t begin = 0; begin < count; begin += kGroupBatch) {
      report_progress(progress, static_cast<double>(begin) / static_cast<double>(count));
      judge_groups(begin, std::min(begin + kGroupBatch, count));
    }
  }

 private:
  enum class Verdict : std::uint8_t { kDoubt, kInside, kLit };

  /// A side under test, and its paths so far.
  struct Suspect {
    std::uint32_t side;
    std::uint32_t paths = 0;  ///< paths that were followed
    int out = 0;              ///< paths that are outside
    Verdict verdict = Verdict::kDoubt;
  };

  /// How a triangle treats paths. Backs of one-sided surfaces and buried sides absorb them.
  struct Surface {
    Float3 normal;  ///< of the front
    bool emits, front_reflects, back_reflects;
    float survival;  ///< fraction of the paths that continue where it reflects
  };

  struct Scratch {
    std::vector<Ray> rays;  ///< of the paths that continue
    std::vector<Hit> hits;
  };

  /// Sides are numbered by their triangles: fronts even, backs odd.
  SideKind& kind(std::uint32_t side) {
    return side % 2 == 0 ? sides_[side / 2].front : sides_[side / 2].back;
  }

  const Material& material(std::uint32_t t) const {
    return scene_.materials[scene_.triangle_material[t]];
  }

  std::array<glm::dvec3, 3> corners(std::uint32_t t) const {
    const auto [a, b, c] = scene_.triangle[t];
    return {to_dvec3(scene_.position[a]), to_dvec3(scene_.position[b]),
            to_dvec3(scene_.position[c])};
  }

  glm::dvec3 area_vector(std::uint32_t t) const {
    const auto [p, q, r] = corners(t);
    return 0.5 * glm::cross(q - p, r - p);
  }

  /// The area in squares of kLarge.
  double area(std::uint32_t t) const {
    const double side = kLarge * reach_;
    return glm::length(area_vector(t)) / (side * side);
  }

  float survival(std::uint32_t t) const {
    const auto [a, b, c] = scene_.triangle[t];
    const auto& texcoord = scene_.base_color_texcoord;
    const auto& color = scene_.vertex_color;
    const Float3 reflected =
        mean_base_color(scene_, material(t), {texcoord[a], texcoord[b], texcoord[c]},
                        {color[a], color[b], color[c]}, kTextureSamples);
    return std::max(static_cast<float>(kLeastSurvival), *std::ranges::max_element(reflected));
  }

  Surface surface_of(std::uint32_t t) const {
    const Material& m = material(t);
    return {.normal = to_float3(glm::normalize(area_vector(t))),
            .emits = m.emitted_luminance != Float3{0, 0, 0},
            .front_reflects = sides_[t].front != SideKind::kBuried,
            .back_reflects = m.double_sided && sides_[t].back != SideKind::kBuried,
            .survival = survival(t)};
  }

  /// Gathers the lit sides of double-sided triangles, fronts first.
  void group_candidates() {
    for (const bool front : {true, false}) {
      bool open = false;     // others may join the last group
      glm::dvec3 middle(0);  // of its first triangle
      for (std::uint32_t t = 0; t < sides_.size(); ++t) {
        const std::uint32_t side = 2 * t + (front ? 0 : 1);
        if (kind(side) != SideKind::kLit || !material(t).double_sided) continue;
        const auto [p, q, r] = corners(t);
        const glm::dvec3 centroid = (p + q + r) / 3.0;
        const bool small = area(t) <= 1;
        if (!small || !open || candidates_.size() - group_begin_.back() == kGroup ||
            glm::distance(centroid, middle) > kGroupReach * reach_) {
          group_begin_.push_back(candidates_.size());
          open = small;
          middle = centroid;
        }
        candidates_.push_back(side);
      }
    }
    group_begin_.push_back(candidates_.size());
  }

  /// Tests the groups [begin, end), and buries the sides that are inside.
  void judge_groups(std::size_t begin, std::size_t end) {
#pragma omp parallel
    {
      Scratch scratch;
      std::vector<Suspect> group;
#pragma omp for schedule(dynamic, 8)
      for (std::size_t g = begin; g < end; ++g) {
        group.clear();
        for (std::size_t k = group_begin_[g]; k < group_begin_[g + 1]; ++k) {
          group.push_back({.side = candidates_[k]});
        }
        judge(group, scratch);
        for (const Suspect& suspect : group) {
          if (suspect.verdict == Verdict::kInside) kind(suspect.side) = SideKind::kBuried;
        }
      }
    }
  }

  void judge(std::span<Suspect> group, Scratch& scratch) const {
    if (group.size() > 1) judge_together(group, scratch);
    for (Suspect& suspect : group) {
      if (suspect.verdict == Verdict::kDoubt) suspect.verdict = judge_alone(suspect, scratch);
    }
  }

  /// Decides the sides of a group that are like the others.
  void judge_together(std::span<Suspect> group, Scratch& scratch) const {
    const std::size_t enough = std::max(kPathsOfSide, divide_up(kLeastPaths, group.size()));
    follow(group, divide_up(kFirstPaths, group.size()), scratch);
    if (part_out(group) >= kFirstLit) return judge_all(group, Verdict::kLit);
    follow(group, enough, scratch);
    if (part_out(group) >= kLitPart) return judge_all(group, Verdict::kLit);
    if (part_out(group) == 0) return judge_all(group, Verdict::kInside);
    follow(group, 4 * enough, scratch);
    const bool few = part_out(group) <= kFew;
    for (Suspect& suspect : group) {
      const double part = part_out({&suspect, 1});
      if (few && part == 0) suspect.verdict = Verdict::kInside;
      if (!few && part >= kLitPart) suspect.verdict = Verdict::kLit;
    }
  }

  static void judge_all(std::span<Suspect> group, Verdict verdict) {
    for (Suspect& suspect : group) suspect.verdict = verdict;
  }

  static std::size_t divide_up(std::size_t a, std::size_t b) {
    return (a + b - 1) / b;
  }

  /// The fraction of all paths of a group that is outside.
  static double part_out(std::span<const Suspect> group) {
    int out = 0;
    std::uint32_t paths = 0;
    for (const Suspect& suspect : group) {
      out += suspect.out;
      paths += suspect.paths;
    }
    return static_cast<double>(out) / paths;
  }

  Verdict judge_alone(Suspect& suspect, Scratch& scratch) const {
    const double size = area(suspect.side / 2);
    if (size > 1) return judge_large(suspect, size, scratch);
    const bool tiny = size * kLarge * kLarge < kTiny * kTiny;
    for (const Look& usual : kLooks) {
      const Look& look = tiny && usual.paths == kLookAtTiny.paths ? kLookAtTiny : usual;
      if (look.paths <= suspect.paths) continue;
      follow({&suspect, 1}, look.paths, scratch);
      if (suspect.out <= look.inside) return Verdict::kInside;
      if (suspect.out >= look.lit) break;
    }
    return Verdict::kLit;
  }

  Verdict judge_large(Suspect& suspect, double size, Scratch& scratch) const {
    const auto paths =
        static_cast<std::size_t>(std::min<double>(kMostPaths, std::ceil(kPathsOfSquare * size)));
    for (std::size_t end = 4; suspect.out == 0 && suspect.paths < paths; end *= 4) {
      follow({&suspect, 1}, std::min(end, paths), scratch);
    }
    return suspect.out == 0 ? Verdict::kInside : Verdict::kLit;
  }

  /// Follows paths from the sides of a group until there are `paths` of each.
  void follow(std::span<Suspect> group, std::size_t paths, Scratch& scratch) const {
    scratch.rays.clear();
    for (std::uint32_t k = 0; k < group.size(); ++k) {
      start_paths(group[k], k, paths, scratch.rays);
    }
    for (int bounce = 0; bounce < kBounces && !scratch.rays.empty(); ++bounce) {
      scratch.hits.resize(scratch.rays.size());
      tracer_.intersect(scratch.rays, scratch.hits);
      std::size_t kept = 0;
      for (std::size_t k = 0; k < scratch.rays.size(); ++k) {
        const Ray& ray = scratch.rays[k];
        const Hit& hit = scratch.hits[k];
        Suspect& suspect = group[ray.id >> kPathBits];
        if (is_out(hit)) {
          ++suspect.out;
        } else if (reflects(hit)) {
          const std::uint64_t bits = path_bits(suspect.side, ray.id, bounce);
          const bool goes_on =
              static_cast<double>(bits >> 32) * 0x1p-32 < surface_[hit.triangle].survival;
          if (goes_on) scratch.rays[kept++] = reflect(ray, hit, mix_bits(bits));
        }
      }
      scratch.rays.resize(kept);
    }
  }

  static std::uint64_t path_bits(std::uint32_t side, std::uint32_t id, int bounce) {
    const std::uint64_t path = id % (1U << kPathBits);
    return mix_bits(mix_bits(side) ^ (path << 8 | static_cast<unsigned>(bounce)));
  }

  /// Appends the first rays of paths [suspect.paths, paths) of side `number` of a group.
  void start_paths(Suspect& suspect, std::uint32_t number, std::size_t paths,
                   std::vector<Ray>& rays) const {
    const std::size_t begin = rays.size();
    rays.resize(begin + paths - suspect.paths);
    const std::span<Ray> started = std::span(rays).subspan(begin);
    const std::uint32_t t = suspect.side / 2;
    make_hemisphere_rays(corners(t), to_dvec3(normal(t, suspect.side % 2 == 0)), tracer_,
                         mix_bits(suspect.side), started, suspect.paths);
    for (Ray& ray : started) {
      ray.t_far = static_cast<float>(reach_);
      ray.id = number << kPathBits | suspect.paths++;
    }
  }

  Float3 normal(std::uint32_t t, bool front) const {
    const Float3& n = surface_[t].normal;
    return front ? n : Float3{-n[0], -n[1], -n[2]};
  }

  bool is_out(const Hit& hit) const {
    return hit.triangle == kNone || surface_[hit.triangle].emits;
  }

  bool reflects(const Hit& hit) const {
    const Surface& surface = surface_[hit.triangle];
    return hit.front ? surface.front_reflects : surface.back_reflects;
  }

  /// Continues from the hit of `ray`, in a direction that `bits` choose.
  Ray reflect(const Ray& ray, const Hit& hit, std::uint64_t bits) const {
    const glm::vec3 place = to_glm(ray.origin) + hit.t * to_glm(ray.direction);
    const Float3 n = normal(hit.triangle, hit.front);
    const glm::vec3 direction = NormalFrame().turn(n, to_cosine_direction(unit_square(bits)));
    Ray next = make_free_ray({to_float3(place), n}, direction, tracer_);
    next.t_far = static_cast<float>(reach_);
    next.id = ray.id;
    return next;
  }

  const Scene& scene_;
  const RayTracer& tracer_;
  std::vector<TriangleSides>& sides_;
  std::vector<Surface> surface_;           ///< [t]
  double reach_;                           ///< metres
  std::vector<std::uint32_t> candidates_;  ///< sides
  std::vector<std::size_t> group_begin_;   ///< [g + 1] in candidates_
};

}  // namespace

void bury_enclosed_sides(const Scene& scene, const RayTracer& tracer,
                         std::vector<TriangleSides>& sides, const Progress& progress) {
  EnclosedSides(scene, tracer, sides).run(progress);
}

}  // namespace rebounce
