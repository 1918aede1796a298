#pragma once

#include <array>
#include <span>
#include <vector>

#include "rebounce/scene_data.h"
#include "transfer/base/parallel.h"

namespace rebounce {

/// Adds to light at receivers what their rows do. Allocates when it is made, and not after.
/// `rows` and `area` [n] must outlive it.
class ReceiverProducts {
 public:
  ReceiverProducts(const ReceiverRows& rows, std::span<const float> area);

  /// Adds the rows' part of patches of `radiosity` [n] in lx to `irradiance` in lx, one of each
  /// receiver; those without rows stay as they are. The same bits for any `scheduler` and
  /// instruction set.
  void add(std::span<const Float3> radiosity, std::span<Float3> irradiance,
           const Scheduler& scheduler = {});

 private:
  void average_sets(std::span<const Float3> radiosity, const Scheduler& scheduler);
  void add_group(std::size_t group, std::span<Float3> irradiance) const;

  const ReceiverRows* rows_;
  std::span<const float> area_;
  std::vector<double> inverse_area_;                         ///< [m] of each set
  std::vector<std::array<double, kChannelCount>> flux_;      ///< [n + 1] of the patches before
  std::vector<std::array<float, kChannelCount>> set_light_;  ///< [m]
};

}  // namespace rebounce
