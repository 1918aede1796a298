#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "precompute/compression/hierarchical_settings.h"
#include "precompute/exchange/pairs/form_factor_settings.h"
#include "precompute/outputs/light_probes.h"
#include "precompute/outputs/lightmap.h"
#include "precompute/outputs/surface_harmonics.h"
#include "precompute/patches/subdivision.h"
#include "transfer/base/precision.h"

namespace rebounce {

enum class OperatorKind : std::uint8_t {
  kDense,         ///< exact to rounding, with n² values a channel
  kHierarchical,  ///< to a tolerance, in a small part of the bytes and the time
  kLowRank,       ///< one rank for the whole scene: low_rank_operator.h
  kNoOperator,    ///< nothing is made or checked: for who solves with the form factors
};

/// What the operator is made from.
enum class ExchangeSource : std::uint8_t {
  kAutomatic,  ///< links above kPairsPatchCount patches or where pairs are over the memory limit
  kPairs,      ///< all pairs of patches, up to n² / 4 of them, and a dense inverse
  kLinks,      ///< links (links.h): nothing grows with n²
};

/// Above this, memory in proportion to n² is no longer asked for.
inline constexpr std::size_t kPairsPatchCount = 20000;

struct BuildSettings {
  double scale = 1;  ///< metres per unit of the scene file, > 0
  SubdivisionSettings subdivision;
  FormFactorSettings form_factors;
  /// kPairs: link_epsilon is 0.
  /// kLinks: link_epsilon 0 stands for kLinkEpsilon, and the operator is hierarchical or none.
  ExchangeSource exchange_source = ExchangeSource::kAutomatic;
  /// Store links too, for hierarchical radiosity: fitted to the form factors of all pairs, or to
  /// the links that were found instead.
  bool store_links = false;
  ProbeSettings probes;                       ///< by default none
  LightmapSettings lightmap;                  ///< by default none
  SurfaceHarmonicSettings surface_harmonics;  ///< by default none
  OperatorKind operator_kind = OperatorKind::kHierarchical;
  double tolerance = kDefaultTolerance;  ///< of the hierarchical operator: see HierarchicalSettings
  std::size_t rank = 256;                ///< of kLowRank: see LowRankSettings
  /// By default kF32 for a dense operator, kQ8 for a hierarchical one, kF16 (half the bytes, an
  /// error of some 1e-4) for others.
  std::optional<Precision> precision;
  /// Keep the form factors of all pairs, for iterative solvers, comparisons and export. Not with
  /// kLinks, which has none.
  bool store_form_factors = false;
  /// Error of F B, relative and area-weighted L2, in the mean, at which the form factors are
  /// compressed and kept, for the same. Less: more bytes, fewer errors. 0: they are not kept; where
  /// the operator is made from them (kLinks), they have a fifth of its tolerance, less where little
  /// light reaches the receivers.
  double form_factor_tolerance = 0;
  /// Whose indirect light is wanted, and what lamps shine on: entries of PatchSelection, or none
  /// for all patches. Only what the light of sources does to receivers is compressed, checked and
  /// stored, and from links solved for; light goes by way of all patches nevertheless. What emits
  /// is a source, named or not. The operator is then hierarchical.
  std::vector<std::string> receivers, sources;
  /// Refuses to start what needs more, bytes; 0: half of the machine's memory. With links, a lower
  /// limit means that less of the operator is made at a time: slower, with the same bits.
  std::uint64_t memory_limit_bytes = 0;
  /// With kLinks: folder that what is done of the operator is kept in, so that a build that was
  /// killed has that done when it is started again with the same scene and settings. It stays
  /// behind. Empty: none.
  std::filesystem::path checkpoint;
};

}  // namespace rebounce
