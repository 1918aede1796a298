#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace rebounce {

/// The number of hemisphere rays of one patch that met another.
struct MetPatch {
  std::uint32_t patch;
  std::uint32_t count;
};

/// Counts the patches that hemisphere rays met, for one patch after another; for one thread.
class MetPatchCounter {
 public:
  /// Counts how often the patches < `patch_count` occur in `met`, which holds what the rays of one
  /// patch met (EscapeScratch); ascending, without kNone.
  std::vector<MetPatch> count(std::size_t patch_count, std::span<const std::uint32_t> met);

 private:
  std::vector<std::uint32_t> count_;  ///< [n] all 0 between calls
  std::vector<std::uint32_t> met_;    ///< patches whose count is not 0
};

/// What the number of hemisphere rays between two patches, counted from both sides, tells of their
/// exchange: a Monte Carlo estimate without bias that includes visibility and the shape of the
/// patches. It is coarse for far and small patches and good for near ones, where kernels times
/// visibility are worst.
class CountedExchange {
 public:
  /// `area` [n] in m²; `ray_count` cosine-distributed rays leave each patch, or as many as are
  /// listed for it [n].
  CountedExchange(std::span<const double> area, int ray_count)
      : CountedExchange(area, std::vector<double>(area.size(), ray_count)) {}
  CountedExchange(std::span<const double> area, std::vector<double> ray_count)
      : area_(area.begin(), area.end()), ray_count_(std::move(ray_count)) {}

  /// The exchange in m² that `count` rays from either side tell of. Both sides are weighted by the
  /// inverse of their variances: n_i of N_i rays from area A_i and n_j of N_j from A_j give
  /// (n_i + n_j) / (N_i / A_i + N_j / A_j), whatever the exchange.
  double exchange(std::uint32_t i, std::uint32_t j, std::uint32_t count) const {
    return count * area_per_ray(i, j);
  }

  /// Variance of that, m⁴, if the pair really exchanges `truth` m².
  double variance(std::uint32_t i, std::uint32_t j, double truth) const;

  /// The expected number of rays between the pair if it exchanges `exchange` m².
  double expected_count(std::uint32_t i, std::uint32_t j, double exchange) const;

 private:
  double area_per_ray(std::uint32_t i, std::uint32_t j) const;

  std::vector<double> area_, ray_count_;
};

/// The exchange of all pairs of patches estimated from hemisphere rays; rows add up.
class HemisphereExchange : public CountedExchange {
 public:
  /// `met` [n] for each patch, from `ray_count` cosine-distributed rays each; `area` [n] in m².
  HemisphereExchange(const std::vector<std::vector<MetPatch>>& met, std::span<const double> area,
                     int ray_count);

  /// A pair (i, j), i <= j, that at least one ray connects.
  struct Pair {
    std::uint32_t patch;  ///< j
    std::uint32_t count;  ///< rays from either side
    double exchange;      ///< m²
  };

  /// The pairs of patch i, ascending by j.
  std::span<const Pair> pairs(std::uint32_t i) const { return pairs_[i]; }

  /// The pair (i, j), i <= j; count and exchange are 0 if no ray connects it.
  Pair find(std::uint32_t i, std::uint32_t j) const;

 private:
  std::vector<std::vector<Pair>> pairs_;
};

}  // namespace rebounce
