#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bench/report/accuracy.h"

namespace rebounce::bench {

/// One way to the light of the picture: its file and that of its difference from the reference.
struct DrawnMethod {
  std::string name;
  int sweeps = 0;
  double error = 0;                     ///< of H, relative, area-weighted L2
  std::string picture{}, difference{};  ///< file names
};

struct Pictures {
  std::string reference;  ///< file name
  std::vector<DrawnMethod> methods;
  double time = 0;  ///< microseconds that the first method takes, and the others have
};

/// How many times stronger than they are differences are drawn.
inline constexpr float kDifferenceGain = 10;

/// Draws the scene under a key light that was switched on in this frame, into `folder`, files named
/// after `name`: by the reference, by the first hierarchical operator, and by Gauss-Seidel (on the
/// compressed F that gets nearest) with the sweeps that fit into the operator's time, at least one,
/// and one gather more that is not counted. Throws Error if a file cannot be written, Cancelled if
/// asked to stop.
Pictures draw_pictures(const Contenders& contenders, const std::vector<Contestant>& contestants,
                       const std::vector<RunTime>& times, const ReportSettings& settings,
                       const std::filesystem::path& folder, const std::string& name,
                       const ReportProgress& progress);

}  // namespace rebounce::bench
