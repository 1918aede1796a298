#pragma once

// What a build takes, and what it has done.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace rebounce {

/// The size of the correction that makes rows of F add up (closure).
struct ClosureReport {
  /// Largest |sum over j of F(i,j) - target| before the correction.
  double row_sum_error_before = 0;
  double row_sum_error_after = 0;  ///< the same after it, over rows with a certain target
  double relative_change = 0;      ///< |S' - S| / |S|, Frobenius
};

/// Relative area-weighted L2 errors of gathered light, F B. Lights of which less than a millionth
/// arrives anywhere have no error.
struct FormFactorError {
  double mean = 0;
  double max = 0;
  int light_count = 0;  ///< lights that have an error
  int dark_count = 0;   ///< lights from which nothing arrives
};

/// An estimate of errors by rays. With 95 % confidence the mean lies within `mean_confidence` of
/// `mean`, and the error of the light that errs most within `max_confidence` of `max`.
struct SampledError {
  double mean = 0, mean_confidence = 0;
  double max = 0, max_confidence = 0;
};

/// Relative area-weighted L2 errors of the indirect irradiance under point lights against exact
/// form factors, where the operator is made from links.
struct WholeError {
  SampledError links;  ///< of the light that the links give
  SampledError whole;  ///< of the operator: links and compression
  int light_count = 0;
};

/// What the expensive part, or what is left of it, will take.
struct CostEstimate {
  std::size_t patch_count = 0;
  std::size_t receiver_count = 0, source_count = 0;
  std::size_t link_count = 0;  ///< 0 until links are known, or if there are none
  /// Of the whole process. As long as links are not known, by a forecast of their number.
  std::uint64_t peak_bytes = 0;
  /// With pairs, what form factors and the dense inverse will take with the threads that there are,
  /// by short samples of either: rough. 0: no sample was taken.
  double form_factor_seconds = 0, inverse_seconds = 0;
};

struct BuildReport {
  std::size_t triangle_count = 0;  ///< of the scene, without degenerate ones
  std::size_t degenerate_triangle_count = 0;
  std::vector<std::string> mesh_names;  ///< of meshes, or nodes that place one, each once
  std::size_t display_triangle_count = 0;
  std::size_t patch_count = 0;
  std::size_t sliver_count = 0;  ///< triangles thinner than the offset of rays, left out
  /// Sides of triangles without a patch: those that see no other surface, lie on another surface,
  /// stop no light, or lie inside of a solid.
  std::size_t unlit_side_count = 0, covered_side_count = 0, opening_side_count = 0,
              buried_side_count = 0;
  float patch_size_min = 0, patch_size_median = 0, patch_size_max = 0;  ///< sqrt(area), metres
  std::vector<std::string> warnings;
  std::vector<std::pair<std::string, double>> seconds;  ///< by phase, in order
  /// Rays that form factors took, pairs of patches that may see each other, and form factors that
  /// are not 0.
  std::uint64_t ray_count = 0, pair_count = 0, form_factor_count = 0;
  std::size_t link_count = 0;  ///< that are stored
  ClosureReport closure;
  /// Vectors that an operator from links was solved for. One for each patch and each channel whose
  /// reflectances differ from those of the others would be all columns of Y.
  std::size_t solve_count = 0;
  /// Of the compressed form factors: relative area-weighted L2 error of F B under lights that they
  /// were not fitted to.
  std::optional<FormFactorError> form_factor_error;
  std::optional<WholeError> whole_error;  ///< of an operator from links
  double form_factor_tolerance = 0;       ///< that they were compressed to
  /// Relative error of what vertices show by their weights alone, if rows of their own depend on it
  /// (ReceiverRowSettings::least_error).
  std::optional<double> error_without_rows;
  CostEstimate estimate;
  std::optional<CostEstimate> estimate_after_links;  ///< of what is left then
};

/// Called when a phase begins, during it and at its end; returning false stops the build. It must
/// not throw: it is called on threads of loops.
using BuildProgress = std::function<bool(std::string_view phase, double fraction)>;

/// Called once patches are known and before form factors are begun, and where an operator is made
/// from links again when these are found, with what is left.
using EstimateListener = std::function<void(const CostEstimate&)>;

}  // namespace rebounce
