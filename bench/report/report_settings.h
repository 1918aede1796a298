#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bench/reference/compare.h"
#include "precompute/compression/hierarchical_settings.h"
#include "transfer/base/precision.h"

namespace rebounce::bench {

/// A hierarchical operator that takes part.
struct OperatorChoice {
  double tolerance = kDefaultTolerance;
  Precision precision = Precision::kQ8;
};

/// What is measured on one scene with one number of patches. More of anything takes longer.
struct ReportSettings {
  std::size_t patch_count = 1000;
  std::uint64_t seed = 1;

  /// Hierarchical operators; the first is the one that pictures, truth and refinement use.
  std::vector<OperatorChoice> operators = {
      {0.005, Precision::kQ8}, {0.02, Precision::kQ8},   {0.002, Precision::kQ8},
      {0.001, Precision::kQ8}, {0.0003, Precision::kQ8}, {0.005, Precision::kF16},
  };
  /// At which form factors are compressed; the first is what refinement has beside exact ones.
  std::vector<double> form_factor_tolerances = {0.0003, 0.001, 0.003, 0.01};
  std::vector<std::size_t> ranks = {64, 256, 512};  ///< of low-rank operators
  bool links = true;                                ///< hierarchical radiosity takes part

  int lamp_count = 4;  ///< lamps over which errors are averaged
  /// Parts of the scene's diagonal by which a lamp is moved, each in (0, 0.2].
  std::vector<double> motions = {0.0003, 0.001, 0.003, 0.01, 0.05, 0.2};
  /// Sweeps after which an iteration is looked at, ascending.
  std::vector<int> sweeps = {1,  2,  3,  4,  5,  6,  7,  8,  9,  10, 11,
                             12, 13, 14, 15, 16, 18, 20, 24, 32, 48, 64};
  int repeats = 7;        ///< timings of each thing
  int solve_threads = 1;  ///< OpenMP threads while relighting is timed; building has all

  int frame_count = 300;                                 ///< of each light path
  std::vector<double> budgets = {250, 500, 1000, 2000};  ///< microseconds a frame

  /// From so many patches on, a scene is large, or huge.
  static constexpr std::size_t kLarge = 3000, kHuge = 10000;

  bool truth = true;  ///< compare with the path tracer
  /// Shadow rays of the form factors that others are held against; FormFactorSettings::probe_rays.
  int truth_probe_rays = 64;
  reference::PatchComparisonSettings patch_comparison;
  std::size_t truth_point_count = 8000;
  std::uint32_t truth_samples = 256;

  int picture_width = 480, picture_height = 360;  ///< pixels; 0: no pictures

  /// The same on a small part of it: some seconds at 1,000 patches.
  void make_quick();

  /// What is left out of many patches, so that they take minutes and not hours.
  void make_large();

  /// The same of so many that they take tens of minutes: after make_large.
  void make_huge();
};

}  // namespace rebounce::bench
