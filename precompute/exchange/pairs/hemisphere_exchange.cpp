#include "precompute/exchange/pairs/hemisphere_exchange.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rebounce/types.h"

namespace rebounce {
namespace {

/// The variance of a count of low-discrepancy rays with this expected value. It is that of random
/// rays while they are few, then grows with the power 3/4, as for points in four dimensions on
/// either side of a border (lab/007).
double variance_of_count(double expected) {
  return expected / std::pow(1 + 0.5 * expected, 0.25);
}

}  // namespace

std::vector<MetPatch> MetPatchCounter::count(std::size_t patch_count,
                                             std::span<const std::uint32_t> met_by_rays) {
  count_.resize(patch_count, 0);
  for (const std::uint32_t patch : met_by_rays) {
    if (patch != kNone && count_[patch]++ == 0) met_.push_back(patch);
  }
  std::ranges::sort(met_);
  std::vector<MetPatch> met;
  met.reserve(met_.size());
  for (const std::uint32_t patch : met_) met.push_back({patch, std::exchange(count_[patch], 0)});
  met_.clear();
  return met;
}

HemisphereExchange::HemisphereExchange(const std::vector<std::vector<MetPatch>>& met,
                                       std::span<const double> area, int ray_count)
    : CountedExchange(area, ray_count), pairs_(met.size()) {
  // Lists by the other patch, in its order, so that each list below comes out in order.
  std::vector<std::vector<MetPatch>> met_by(met.size());
  for (std::uint32_t k = 0; k < met.size(); ++k) {
    for (const MetPatch& m : met[k]) {
      if (m.patch < k) met_by[m.patch].push_back({k, m.count});
    }
  }
  for (std::uint32_t i = 0; i < met.size(); ++i) {
    auto own = std::ranges::lower_bound(met[i], i, {}, &MetPatch::patch);
    auto other = met_by[i].begin();
    while (own != met[i].end() || other != met_by[i].end()) {
      const bool take_own =
          other == met_by[i].end() || (own != met[i].end() && own->patch <= other->patch);
      const bool take_other =
          own == met[i].end() || (other != met_by[i].end() && other->patch <= own->patch);
      const std::uint32_t j = take_own ? own->patch : other->patch;
      // Rays of a patch to itself count for both sides.
      const std::uint32_t count =
          (take_own ? (j == i ? 2 : 1) * own->count : 0) + (take_other ? other->count : 0);
      pairs_[i].push_back({j, count, exchange(i, j, count)});
      if (take_own) ++own;
      if (take_other) ++other;
    }
  }
}

double CountedExchange::area_per_ray(std::uint32_t i, std::uint32_t j) const {
  return area_[i] * area_[j] / (area_[i] * ray_count_[j] + area_[j] * ray_count_[i]);
}

HemisphereExchange::Pair HemisphereExchange::find(std::uint32_t i, std::uint32_t j) const {
  const auto pair = std::ranges::lower_bound(pairs_[i], j, {}, &Pair::patch);
  if (pair != pairs_[i].end() && pair->patch == j) return *pair;
  return {j, 0, 0};
}

double CountedExchange::variance(std::uint32_t i, std::uint32_t j, double truth) const {
  const double unit = area_per_ray(i, j);
  return unit * unit * variance_of_count(truth / unit + 1);
}

double CountedExchange::expected_count(std::uint32_t i, std::uint32_t j, double exchange) const {
  return exchange / area_per_ray(i, j);
}

}  // namespace rebounce
