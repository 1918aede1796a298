#include "precompute/exchange/pairs/pair_exchange.h"

#include <algorithm>
#include <cmath>

namespace rebounce {
namespace {

// Deviations by which the count of hemisphere rays must be off before a clear pair is examined
// again, and before the count overrules all rays of the pair.
constexpr double kDoubt = 2, kContradiction = 4;

// A large pair exchanges more than this fraction of the light of either patch. If it is partly
// hidden, it gets kLargeFactor times the rays of other pairs: what its rays miss shows in row sums,
// and its noise in the ranks of blocks (lab/011).
constexpr double kLargePart = 3e-4;
constexpr int kLargeFactor = 6;

// The rays of mixed pairs that are traced together, so that those of a long row fit the nearest
// caches.
constexpr std::size_t kRaysTogether = 1 << 14;

// A pair whose rays all agree may still be partly hidden: its variance is this fraction of the
// squared exchange instead of zero.
constexpr double kVisibilityVarianceFloor = 1e-6;

// The variance of points of Sobol's sequence as a fraction of that of random ones; over
// partly hidden pairs it is 0.14 to 0.19 (lab/004).
constexpr double kSpreadGain = 0.2;

bool is_large_pair(const PatchGeometry& geometry, std::uint32_t i, const FacingPatch& pair) {
  return pair.unoccluded > kLargePart * std::min(geometry.area(i), geometry.area(pair.patch));
}

/// Adds a pair with this `exchange`, m², and variance, m⁴.
void append(std::vector<ExchangeEntry>& row, const FacingPatch& pair, double exchange,
            double variance) {
  if (static_cast<float>(exchange) <= 0) return;
  const double most = pair.unoccluded;
  row.push_back({pair.patch, static_cast<float>(exchange), static_cast<float>(most),
                 static_cast<float>(variance / (most * most))});
}

void append_clear(const FacingPatch& pair, std::vector<ExchangeEntry>& row) {
  append(row, pair, pair.unoccluded, kVisibilityVarianceFloor * pair.unoccluded * pair.unoccluded);
}

/// The variance of `visible` if `part` of the light passes. Rays that are dimmed, as by glass,
/// spread less than rays that either pass or are stopped.
double variance_of_part(double part, const ShadowRays::Visibility& visible) {
  const double binary = visible.part * (1 - visible.part), rays = visible.ray_count;
  const double spread = binary > 0 ? visible.variance * rays / binary : 1;
  // No fraction is known better than this number of rays tells (rule of succession).
  const double expected = (part * rays + 1) / (rays + 2), least = 1 / (rays + 2);
  return kSpreadGain * std::max(spread * expected * (1 - expected) / (rays + 1), least * least);
}

}  // namespace

void PairExchange::measure(std::uint32_t i, const std::vector<FacingPatch>& facing, int probe,
                           Scratch& scratch, std::vector<ExchangeEntry>& row) const {
  shadow_rays_.make_probe_rays(i, facing, probe, scratch.rays);
  trace(scratch);
  scratch.mixed.clear();
  scratch.large_mixed.clear();
  for (std::size_t p = 0; p < facing.size(); ++p) {
    const FacingPatch& pair = facing[p];
    const auto agreement =
        ShadowRays::agreement(std::span(scratch.rays).subspan(p * probe, probe),
                              std::span(scratch.transmitted).subspan(p * probe, probe));
    if (agreement == ShadowRays::Agreement::kMixed || is_contradicted(i, pair, agreement, kDoubt)) {
      (is_large_pair(geometry_, i, pair) ? scratch.large_mixed : scratch.mixed).push_back(pair);
    } else if (agreement == ShadowRays::Agreement::kClear) {
      append_clear(pair, row);
    }
  }
  append_mixed(i, scratch.mixed, full_rays_, scratch, row);
  append_mixed(i, scratch.large_mixed, kLargeFactor * full_rays_, scratch, row);
}

void PairExchange::count_coarse(std::uint32_t i, std::uint32_t j, std::uint32_t count,
                                std::vector<ExchangeEntry>& row) const {
  const double exchange = counted_.exchange(i, j, count);
  append(row, {j, exchange, count}, exchange, counted_.variance(i, j, exchange));
}

/// True if the hemisphere rays contradict the agreeing rays of a pair: by this number of
/// `deviations` if the pair counts as clear.
bool PairExchange::is_contradicted(std::uint32_t i, const FacingPatch& pair,
                                   ShadowRays::Agreement agreement, double deviations) const {
  if (agreement == ShadowRays::Agreement::kHidden) return pair.count > 0;
  const double expected = counted_.expected_count(i, pair.patch, pair.unoccluded);
  // The deviation is that of random rays. It is larger than that of these rays, because among
  // many thousand pairs no pair with an exact kernel may be lost to chance.
  return std::abs(pair.count - expected) > deviations * std::sqrt(expected + 1);
}

/// Traces `full` rays for each of `pairs`, some pairs at a time, and adds them to row i.
void PairExchange::append_mixed(std::uint32_t i, std::span<const FacingPatch> pairs, int full,
                                Scratch& scratch, std::vector<ExchangeEntry>& row) const {
  const std::size_t together = std::max<std::size_t>(1, kRaysTogether / full);
  for (std::size_t begin = 0; begin < pairs.size(); begin += together) {
    const std::size_t count = std::min(together, pairs.size() - begin);
    append_traced(i, pairs.subspan(begin, count), full, scratch, row);
  }
}

/// Traces `full` rays for each of `pairs` and adds the mean of shadow rays and hemisphere rays,
/// weighted by the inverse of their variances, to row i.
void PairExchange::append_traced(std::uint32_t i, std::span<const FacingPatch> pairs, int full,
                                 Scratch& scratch, std::vector<ExchangeEntry>& row) const {
  shadow_rays_.make_rays(i, pairs, full, scratch.rays);
  trace(scratch);
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const FacingPatch& pair = pairs[p];
    const ShadowRays::Visibility visible =
        ShadowRays::visibility(std::span(scratch.rays).subspan(p * full, full),
                               std::span(scratch.transmitted).subspan(p * full, full));
    if (visible.part == 1 &&
        !is_contradicted(i, pair, ShadowRays::Agreement::kClear, kContradiction)) {
      append_clear(pair, row);
    } else {
      append_mean(i, pair, visible, row);
    }
  }
}

/// Adds the mean of `visible` and of the hemisphere rays. Both variances follow from one common
/// estimate: with an estimate of its own, each side would count more the less light it finds.
void PairExchange::append_mean(std::uint32_t i, const FacingPatch& pair,
                               const ShadowRays::Visibility& visible,
                               std::vector<ExchangeEntry>& row) const {
  const double most = pair.unoccluded, shadow = most * visible.part;
  const double met = counted_.exchange(i, pair.patch, pair.count);
  const double guess = std::min(most, 0.5 * (shadow + met));
  const double shadow_variance = most * most * variance_of_part(guess / most, visible);
  const double met_variance = counted_.variance(i, pair.patch, guess);
  const double both = shadow_variance + met_variance;
  append(row, pair, (shadow * met_variance + met * shadow_variance) / both,
         shadow_variance * met_variance / both);
}

/// Traces the rays of the pairs of a patch. Where a surface has holes, the mean of a triangle is
/// all that patches resolve; using it keeps the noise of single holes out of F.
void PairExchange::trace(Scratch& scratch) const {
  scratch.transmitted.resize(scratch.rays.size());
  tracer_.transmittance(scratch.rays, PassageDetail::kTriangle, scratch.transmitted);
  scratch.ray_count += scratch.rays.size();
}

}  // namespace rebounce
