#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace rebounce {

/// How many hemisphere rays of one patch met another.
struct MetPatch {
  std::uint32_t patch;
  std::uint32_t count;
};

/// Counts what the hemisphere rays of one patch after another met; for one thread.
class MetPatchCounter {
 public:
  /// How often the patches < `patch_count` occur in `met`, which is what the rays of one patch met
  /// (EscapeScratch), in ascending order; kNone is left out.
  std::vector<MetPatch> count(std::size_t patch_count, std::span<const std::uint32_t> met);

 private:
  std::vector<std::uint32_t> count_;  ///< [n] all 0 between calls
  std::vector<std::uint32_t> met_;    ///< those that are not
};

/// What pairs of patches exchange as hemisphere rays have it: a Monte Carlo estimate without bias,
/// visibility and all bends of the patches included, and rows that add up. Coarse for what is far
/// and small, good for what is near, where kernels times visibility are at their worst.
class HemisphereExchange {
 public:
  /// `met` [n] of each patch, of `ray_count` cosine-distributed rays each; `area` [n] in m².
  HemisphereExchange(const std::vector<std::vector<MetPatch>>& met, std::span<const double> area,
                     int ray_count);

  /// One pair (i, j), i <= j, that at least one ray went between.
  struct Pair {
    std::uint32_t patch;  ///< j
    std::uint32_t count;  ///< rays of either
    double exchange;      ///< m²
  };

  /// The pairs of patch i, j ascending.
  std::span<const Pair> pairs(std::uint32_t i) const { return pairs_[i]; }

  /// The pair (i, j), i <= j; count and exchange 0 if no ray went between.
  Pair find(std::uint32_t i, std::uint32_t j) const;

  /// Variance of a pair's `exchange`, m⁴, if `truth` in m² is what the pair exchanges.
  double variance(std::uint32_t i, std::uint32_t j, double truth) const;

  /// How many rays are expected between the pair if it exchanges `exchange` m².
  double expected_count(std::uint32_t i, std::uint32_t j, double exchange) const;

 private:
  double area_per_ray(std::uint32_t i, std::uint32_t j) const;

  std::vector<double> area_;
  double ray_count_;
  std::vector<std::vector<Pair>> pairs_;
};

}  // namespace rebounce
