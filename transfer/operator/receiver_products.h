#pragma once

#include <array>
#include <span>
#include <vector>

#include "rebounce/scene_data.h"
#include "transfer/base/parallel.h"

namespace rebounce {

/// Adds to light at vertices what rows of receivers do. Allocates when it is made, and not after.
/// `rows` must outlive it.
class ReceiverProducts {
 public:
  ReceiverProducts(const ReceiverRows& rows, std::span<const float> area);

  /// Adds what rows of patches of `radiosity` [n] in lx receive to `irradiance` [v] in lx; vertices
  /// without rows stay as they are. `difference` [n K] in lx is what each part of a patch shines
  /// more than its patch; empty: nothing. The same bits for any `scheduler` and instruction set.
  void add(std::span<const Float3> radiosity, std::span<const Float3> difference,
           std::span<Float3> irradiance, const Scheduler& scheduler = {});

 private:
  void average_sets(std::span<const Float3> radiosity, std::span<const Float3> difference,
                    const Scheduler& scheduler);
  void add_group(std::size_t group, std::span<Float3> irradiance) const;

  const ReceiverRows* rows_;
  struct Part {
    std::uint32_t patch;
    double area;  ///< m²
  };
  std::vector<Part> part_;                                   ///< [n K] at each position
  std::vector<double> inverse_area_;                         ///< [m] of each set
  std::vector<std::array<double, kChannelCount>> flux_;      ///< [n K + 1] of the parts before
  std::vector<std::array<float, kChannelCount>> set_light_;  ///< [m]
};

}  // namespace rebounce
