#include "precompute/facets/view_factors.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "precompute/exchange/pairs/closure.h"
#include "precompute/exchange/pairs/raw_exchange.h"
#include "precompute/exchange/pairs/shadow_rays.h"
#include "precompute/facets/facet_patches.h"
#include "rebounce/error.h"

namespace rebounce {
namespace {

// Fewer facets are cut into about this number of patches, so that penumbrae are resolved.
constexpr std::size_t kLeastPatches = 1500;

// Facets of an enclosure may lose this fraction of their rays, at edges, between vertices that do
// not quite meet.
constexpr double kMostLeak = 0.01;

/// The upper triangle of the exchange of facets, row by row.
struct FacetExchange {
  std::vector<std::uint64_t> row_begin = {0};
  std::vector<std::uint32_t> column;
  std::vector<float> exchange;  ///< area i x F(i, j)
};

/// Sums by facet of something by patch.
class FacetSums {
 public:
  FacetSums(const FacetPatches& patches, std::vector<double> patch_area, std::size_t facet_count)
      : patches_(patches), patch_area_(std::move(patch_area)), area_(facet_count, 0.0) {
    for (std::size_t i = 0; i < patch_area_.size(); ++i) area_[facet(i)] += patch_area_[i];
  }

  std::size_t size() const { return area_.size(); }
  std::uint32_t facet(std::size_t patch) const { return patches_.patch_facet[patch]; }
  std::span<const double> patch_area() const { return patch_area_; }

  /// [facets] the mean of value(patch), weighted by area; 0 without patches.
  template <typename Value>
  std::vector<double> mean(const Value& value) const {
    std::vector<double> sum(area_.size(), 0.0);
    for (std::size_t i = 0; i < patch_area_.size(); ++i) {
      sum[facet(i)] += patch_area_[i] * value(i);
    }
    for (std::size_t k = 0; k < sum.size(); ++k) {
      if (area_[k] > 0) sum[k] /= area_[k];
    }
    return sum;
  }

  /// Adds up the exchange of patches. It empties `rows` as it goes, for they are large.
  FacetExchange add_up(ExchangeRows& rows) const {
    FacetExchange sums;
    std::size_t most = 0;
    for (const auto& row : rows) most += row.size();
    sums.column.reserve(most);
    sums.exchange.reserve(most);
    std::vector<double> of_column(size(), 0.0);
    std::vector<std::uint32_t> touched;
    std::size_t i = 0;
    for (std::uint32_t row = 0; row < size(); ++row) {
      for (; i < rows.size() && facet(i) == row; ++i) {
        for (const ExchangeEntry& entry : rows[i]) {
          const std::uint32_t j = facet(entry.column);
          if (j == row) continue;  // a flat facet does not see itself
          if (of_column[j] == 0) touched.push_back(j);
          of_column[j] += entry.exchange_area;
        }
        rows[i] = {};
      }
      std::ranges::sort(touched);
      for (const std::uint32_t j : touched) {
        sums.column.push_back(j);
        sums.exchange.push_back(static_cast<float>(std::exchange(of_column[j], 0.0)));
      }
      touched.clear();
      sums.row_begin.push_back(sums.column.size());
    }
    return sums;
  }

 private:
  const FacetPatches& patches_;
  std::vector<double> patch_area_;  ///< [patches]
  std::vector<double> area_;        ///< [facets]
};

/// Writes both triangles of `upper` as rows of factors; factors.area is known.
void fill_rows(const FacetExchange& upper, ViewFactors& factors) {
  const std::size_t n = factors.size();
  std::vector<std::uint64_t> begin(n + 1, 0);
  for (std::size_t i = 0; i < n; ++i) {
    begin[i + 1] += upper.row_begin[i + 1] - upper.row_begin[i];
    for (std::uint64_t k = upper.row_begin[i]; k < upper.row_begin[i + 1]; ++k) {
      ++begin[upper.column[k] + 1];
    }
  }
  for (std::size_t i = 0; i < n; ++i) begin[i + 1] += begin[i];
  factors.row_begin = begin;
  factors.column.resize(begin[n]);
  factors.factor.resize(begin[n]);
  const auto add = [&](std::size_t row, std::size_t column, double exchange) {
    const std::uint64_t place = begin[row]++;
    factors.column[place] = static_cast<std::uint32_t>(column);
    // An exchange area is at most the smaller area; rounding may say otherwise.
    factors.factor[place] =
        std::min({exchange, factors.area[row], factors.area[column]}) / factors.area[row];
  };
  // Row j gets its columns i < j before row j is come to: they ascend.
  for (std::size_t i = 0; i < n; ++i) {
    for (std::uint64_t k = upper.row_begin[i]; k < upper.row_begin[i + 1]; ++k) {
      add(i, upper.column[k], upper.exchange[k]);
      add(upper.column[k], i, upper.exchange[k]);
    }
  }
}

/// Makes rows of an enclosure add up to 1. Throws Error if it is none.
void close_targets(const RawExchange& raw, const FacetSums& sums,
                   std::vector<RowSumTarget>& target) {
  const std::vector<double> lost =
      sums.mean([&](std::size_t i) { return raw.escape[i].sky + raw.escape[i].absorbed; });
  const auto worst = std::ranges::max_element(lost);
  if (*worst > kMostLeak) {
    throw Error("the facets are no enclosure: " + std::to_string(std::lround(100 * *worst)) +
                " % of the light of facet " + std::to_string(worst - lost.begin() + 1) +
                " gets out or meets backs; leave out --closed, or turn facets so that their "
                "corners run counter-clockwise seen from inside");
  }
  for (RowSumTarget& t : target) t = {1, 0};
}

/// A ray in a thousand or so begins beyond the wall of an edge and meets a back.
bool is_noise(double absorbed, int ray_count) {
  return absorbed * ray_count < 1.5;
}

}  // namespace

std::vector<double> row_sums(const ViewFactors& factors) {
  std::vector<double> sum(factors.size(), 0.0);
  for (std::size_t i = 0; i < sum.size(); ++i) {
    for (std::uint64_t k = factors.row_begin[i]; k < factors.row_begin[i + 1]; ++k) {
      sum[i] += factors.factor[k];
    }
  }
  return sum;
}

ViewFactors compute_view_factors(const Facets& facets, const ViewFactorSettings& settings,
                                 const Progress& progress) {
  check_facets(facets);
  const FormFactorSettings rays = with_quality(settings.quality, {.seed = settings.seed});
  const FacetPatches patches = make_facet_patches(facets, kLeastPatches);
  const RayTracer tracer = make_surface_tracer(patches.model.mesh);
  const PatchGeometry geometry(patches.model, tracer);
  const FacetSums sums(patches, geometry.areas(), facets.size());
  RawExchange raw =
      compute_raw_exchange(patches.model, ShadowRays(geometry, rays.seed, rays.kernel_tolerance),
                           tracer, rays, progress);

  ViewFactors factors;
  for (std::size_t k = 0; k < facets.size(); ++k) {
    factors.area.push_back(glm::length(facets.vector_area(k)));
  }
  for (Escape& escape : raw.escape) {
    if (is_noise(escape.absorbed, rays.hemisphere_rays)) escape.absorbed = 0;
  }
  const std::vector<double> raw_sum = row_sums(raw.rows, sums.patch_area());
  factors.raw_row_sum = sums.mean([&](std::size_t i) { return raw_sum[i]; });
  factors.raw_sky = sums.mean([&](std::size_t i) { return raw.escape[i].sky; });
  factors.raw_blocked = sums.mean([&](std::size_t i) { return raw.escape[i].absorbed; });
  factors.patch_count = patches.patch_facet.size();
  factors.ray_count = raw.ray_count;
  factors.pair_count = raw.pair_count;

  if (settings.closed) close_targets(raw, sums, raw.target);
  enforce_closure(raw.rows, sums.patch_area(), raw.target);
  fill_rows(sums.add_up(raw.rows), factors);

  // What a row of facets lacks escapes, in the proportions measured.
  const std::vector<double> sum = row_sums(factors);
  for (std::size_t k = 0; k < facets.size(); ++k) {
    const double rest = facets.exchanges(k) ? std::max(0.0, 1 - sum[k]) : 0;
    const double lost = factors.raw_sky[k] + factors.raw_blocked[k];
    const double sky = settings.closed || !(lost > 0) ? 0 : rest * factors.raw_sky[k] / lost;
    factors.sky.push_back(sky);
    factors.blocked.push_back(settings.closed || !(lost > 0) ? 0 : rest - sky);
  }
  return factors;
}

DroppedFactors drop_small_factors(ViewFactors& factors, double threshold, double most_of_row) {
  struct Pair {
    double larger;
    std::uint32_t row, column;
    std::uint64_t place;
  };
  std::vector<Pair> small;
  const auto place_of = [&](std::uint32_t row, std::uint32_t column) {
    const auto begin = factors.column.begin() + static_cast<std::ptrdiff_t>(factors.row_begin[row]);
    const auto end =
        factors.column.begin() + static_cast<std::ptrdiff_t>(factors.row_begin[row + 1]);
    return static_cast<std::uint64_t>(std::lower_bound(begin, end, column) -
                                      factors.column.begin());
  };
  for (std::uint32_t i = 0; i < factors.size(); ++i) {
    for (std::uint64_t k = factors.row_begin[i]; k < factors.row_begin[i + 1]; ++k) {
      const std::uint32_t j = factors.column[k];
      if (j <= i || factors.factor[k] >= threshold) continue;
      const double back = factors.factor[k] * factors.area[i] / factors.area[j];
      if (back < threshold) small.push_back({std::max(factors.factor[k], back), i, j, k});
    }
  }
  std::ranges::stable_sort(small, {}, &Pair::larger);

  DroppedFactors dropped;
  std::vector<double> loss(factors.size(), 0.0);
  for (const Pair& pair : small) {
    const std::uint64_t back = place_of(pair.column, pair.row);
    const double of_row = loss[pair.row] + factors.factor[pair.place];
    const double of_column = loss[pair.column] + factors.factor[back];
    if (std::max(of_row, of_column) > most_of_row) continue;
    loss[pair.row] = of_row;
    loss[pair.column] = of_column;
    factors.factor[pair.place] = factors.factor[back] = 0;
    ++dropped.pair_count;
    dropped.largest_row_loss = std::max({dropped.largest_row_loss, of_row, of_column});
  }
  std::uint64_t kept = 0;
  for (std::size_t i = 0, begin = 0; i < factors.size(); ++i) {
    const std::uint64_t end = factors.row_begin[i + 1];
    for (std::uint64_t k = begin; k < end; ++k) {
      if (factors.factor[k] == 0) continue;
      factors.factor[kept] = factors.factor[k];
      factors.column[kept++] = factors.column[k];
    }
    begin = end;
    factors.row_begin[i + 1] = kept;
  }
  factors.column.resize(kept);
  factors.factor.resize(kept);
  return dropped;
}

}  // namespace rebounce
