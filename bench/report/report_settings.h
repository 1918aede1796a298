#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bench/reference/compare.h"
#include "rebounce/build_settings.h"

namespace rebounce::bench {

/// What is measured on one scene with one number of patches. More of anything takes longer.
struct ReportSettings {
  std::size_t patch_count = 1000;
  std::uint64_t seed = 1;

  /// At which both sides compress their matrix: the hierarchical operators and the form factors
  /// have the same menu, ascending. kDefaultTolerance, which pictures and truth use, is one of it.
  std::vector<double> tolerances = {0.0003, 0.0005, 0.001, 0.002, kDefaultTolerance, 0.01, 0.02};
  /// Of the operators that refinement begins from; each with every form of F that is finer.
  std::vector<double> refined_tolerances = {kDefaultTolerance, 0.02};
  std::vector<std::size_t> ranks = {64, 256, 512};  ///< of low-rank operators
  bool links = true;                                ///< hierarchical radiosity takes part

  int lamp_count = 20;  ///< over which errors are averaged; of all kinds of kLampTypes in turns
  /// Parts of the scene's diagonal by which a lamp is moved, each in (0, 0.2].
  std::vector<double> motions = {0.0003, 0.001, 0.003, 0.01, 0.05, 0.2};
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
