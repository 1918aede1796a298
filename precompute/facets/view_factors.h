#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/facets/facets.h"
#include "rebounce/build_settings.h"

namespace rebounce {

struct ViewFactorSettings {
  FormFactorQuality quality = FormFactorQuality::kDefault;
  std::uint64_t seed = 1;  ///< of the sample points
  /// The facets are an enclosure: rows add up to 1 without a sky.
  bool closed = false;
};

/// View factors between given facets: F(i, j) is the fraction of the light that leaves i and
/// arrives at j. All facets have a row, those that only obstruct an empty one.
///
/// 0 <= F(i, j) <= 1, area(i) F(i, j) = area(j) F(j, i) to rounding, and the sum of a row, its sky
/// and what is blocked are 1.
struct ViewFactors {
  std::vector<double> area;  ///< [n] in squares of the unit of length of the facets
  // Rows as in a compressed sparse row matrix, columns ascending.
  std::vector<std::uint64_t> row_begin;  ///< [n + 1]
  std::vector<std::uint32_t> column;
  std::vector<double> factor;
  std::vector<double> sky;      ///< [n] fraction that meets nothing
  std::vector<double> blocked;  ///< [n] fraction that meets backs and what only obstructs

  // Before the correction that takes account of both: [n] the sum of a row by kernels and shadow
  // rays, and the fraction that hemisphere rays lose to sky and to backs.
  std::vector<double> raw_row_sum, raw_sky, raw_blocked;

  std::size_t patch_count = 0;  ///< pieces that facets were cut to
  std::uint64_t ray_count = 0;
  std::uint64_t pair_count = 0;  ///< pairs of pieces that face each other

  std::size_t size() const { return area.size(); }
};

/// The sums of the rows [n].
std::vector<double> row_sums(const ViewFactors& factors);

/// Computes the view factors of facets, with closed forms where nothing stands between and rays
/// elsewhere (form_factors.h). Large facets are cut inside, and their parts summed up again.
///
/// The bits do not depend on the number of threads. Throws Error if the facets cannot be used
/// (check_facets(), make_facet_patches()), or are to be closed and more than a hundredth of the
/// light of one of them gets out; Cancelled if `progress` asks to stop.
ViewFactors compute_view_factors(const Facets& facets, const ViewFactorSettings& settings = {},
                                 const Progress& progress = {});

/// What drop_small_factors() has removed.
struct DroppedFactors {
  std::uint64_t pair_count = 0;
  double largest_row_loss = 0;  ///< largest sum of what a row loses
};

/// Removes pairs both of whose factors are below `threshold`, in both directions, the smallest
/// first, as long as no row loses more than `most_of_row`. Nothing makes up for what a row loses.
DroppedFactors drop_small_factors(ViewFactors& factors, double threshold,
                                  double most_of_row = 5e-4);

}  // namespace rebounce
