#pragma once

// The offline stage from end to end: scene file in, transfer data out.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "rebounce/precompute/form_factor_compression.h"
#include "rebounce/precompute/form_factors.h"
#include "rebounce/precompute/light_probes.h"
#include "rebounce/precompute/lightmap.h"
#include "rebounce/precompute/scene.h"
#include "rebounce/precompute/subdivision.h"
#include "rebounce/precompute/surface_harmonics.h"
#include "rebounce/transfer/dense_operator.h"
#include "rebounce/transfer/transfer_data.h"

namespace rebounce {

enum class OperatorKind : std::uint8_t {
  kAutomatic,  ///< dense up to kDensePatchCount patches, hierarchical above
  kDense,
  kHierarchical,
  kLowRank,      ///< one rank for the whole scene: low_rank_operator.h
  kFirstBounce,  ///< the same after a first bounce through F
  kNoOperator,   ///< nothing is made or checked: for who solves with the form factors
};

/// Up to this many patches the dense operator, which is exact to rounding, is small enough to have
/// (at 5,000: 150 MB) for who has not said what error may be.
inline constexpr std::size_t kDensePatchCount = 5000;

/// What the operator is made from.
enum class FormFactorKind : std::uint8_t {
  kAutomatic,  ///< links above kPairsPatchCount patches or where pairs are over the memory limit
  kPairs,      ///< all pairs of patches, up to n² / 4 of them, and a dense inverse
  kLinks,      ///< links (links.h): nothing grows with n²; the file holds F compressed only
};

/// Above this, memory in proportion to n² is no longer asked for.
inline constexpr std::size_t kPairsPatchCount = 20000;

struct BuildSettings {
  double scale = 1;  ///< metres per unit of the scene file, > 0
  SubdivisionSettings subdivision;
  FormFactorSettings form_factors;
  /// kLinks: link_epsilon 0 stands for kLinkEpsilon, and the operator is hierarchical or none.
  FormFactorKind form_factor_kind = FormFactorKind::kAutomatic;
  /// Store links too, for hierarchical radiosity: fitted to the form factors of all pairs, or to the
  /// links that were found instead.
  bool store_links = false;
  /// With kLinks, store those that were found, some 2.5 times as many as fitted ones: what the
  /// operator is made from and its error is of.
  bool store_all_links = false;
  ProbeSettings probes;                       ///< by default none
  LightmapSettings lightmap;                  ///< by default none
  SurfaceHarmonicSettings surface_harmonics;  ///< by default none
  OperatorKind operator_kind = OperatorKind::kAutomatic;
  double tolerance = 0.005;  ///< of the hierarchical operator: see HierarchicalSettings
  std::size_t rank = 256;    ///< of kLowRank and kFirstBounce: see LowRankSettings
  /// By default kF32 for a dense operator, kQ8 for a hierarchical one, kF16 (half the bytes, an
  /// error of some 1e-4) for others.
  std::optional<Precision> precision;
  /// Error of F B, relative and area-weighted L2, in the mean, at which the form factors are
  /// compressed for iterative solvers; 0: they are not, or, where the operator is made from them
  /// (kLinks), to a fifth of its tolerance, less where little light reaches the receivers. Less:
  /// more bytes, fewer errors.
  double form_factor_tolerance = 0;
  /// Whose indirect light is wanted, and what lamps shine on: entries of PatchSelection, or none
  /// for all patches. Only what the light of sources does to receivers is compressed, checked and
  /// stored, and from links solved for; light goes by way of all patches nevertheless. What emits
  /// is a source, named or not. The operator is then hierarchical.
  std::vector<std::string> receivers, sources;
  /// Refuse to start what needs more; 0: half the machine's. With kLinks, less of the operator is
  /// made at a time where it is short: slower, with the same bits.
  std::uint64_t memory_limit_bytes = 0;
  /// With kLinks: folder that what is done of the operator is kept in, so that a build that was
  /// killed has that done when it is started again with the same scene and settings. It stays
  /// behind. Empty: none.
  std::filesystem::path checkpoint;
};

/// What the expensive part, or what is left of it, will take with the threads that there are.
struct CostEstimate {
  std::size_t patch_count = 0;
  std::size_t receiver_count = 0, source_count = 0;
  std::size_t link_count = 0;  ///< 0: not known yet, or there are none
  std::uint64_t peak_bytes = 0;
  /// Rough. As long as links are not known, they are taken to be as many as in a furnished room,
  /// for the least as in a bare one. Afterwards both are the same, and follow from their number and
  /// from how long it took to find them.
  double seconds = 0, least_seconds = 0;
  /// Of `seconds`, what all patches take whatever receivers and sources there are: form factors,
  /// the dense inverse, lights and their truths.
  double whole_seconds = 0;
};

struct BuildReport {
  std::size_t triangle_count = 0;  ///< of the scene, without degenerate ones
  std::size_t degenerate_triangle_count = 0;
  std::size_t display_triangle_count = 0;
  std::size_t patch_count = 0;
  std::size_t sliver_count = 0;
  std::size_t unlit_side_count = 0, covered_side_count = 0, opening_side_count = 0,
              buried_side_count = 0;
  float patch_size_min = 0, patch_size_median = 0, patch_size_max = 0;  ///< sqrt(area), metres
  std::vector<std::string> warnings;
  std::vector<std::pair<std::string, double>> seconds;  ///< by phase, in order
  std::uint64_t ray_count = 0, pair_count = 0, form_factor_count = 0;
  std::size_t link_count = 0;  ///< that are stored
  ClosureReport closure;
  /// Of the compressed form factors: relative area-weighted L2 error of F B under lights that they
  /// were not fitted to.
  std::optional<FormFactorError> form_factor_error;
  double form_factor_tolerance = 0;  ///< that they were compressed to
  CostEstimate estimate;
  std::optional<CostEstimate> estimate_after_links;  ///< of what is left then
};

/// Called when a phase begins, during it and at its end; returning false stops the build.
using BuildProgress = std::function<bool(std::string_view phase, double fraction)>;

/// Called once patches are known and before form factors are begun, and where an operator is made
/// from links again when these are found, with what is left.
using EstimateListener = std::function<void(const CostEstimate&)>;

/// The scene of a file as the offline stage takes it: pieces that are plainly seen from behind are
/// double-sided (find_inside_out). Throws Error as import_gltf does.
Scene import_usable(const std::filesystem::path& path, double scale);

/// Runs the offline stage. Throws Error if the scene cannot be used or what it needs is over the
/// memory limit (before the expensive part), Cancelled if asked to stop.
TransferData build_transfer_data(const std::filesystem::path& scene_path,
                                 const BuildSettings& settings, BuildReport& report,
                                 const BuildProgress& progress = {},
                                 const EstimateListener& on_estimate = {});

}  // namespace rebounce
