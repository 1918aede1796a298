#pragma once

#include <span>
#include <vector>

#include "transfer/base/types.h"

namespace rebounce {

/// What errors at receivers are relative to: what arrives there of a light or, where that is more,
/// what usually does, the same part of all that arrives of it as of other lights (their root mean
/// square). So a lamp in another room counts as it does among all patches, unless all lamps are in
/// other rooms. Where all patches are receivers it is what arrives.
class ReceivedLight {
 public:
  /// Of the next light: the area norms of what arrives at receivers and at all patches.
  void add(double received, double all);

  /// That of a light, in the order of adding.
  double reference(std::size_t light) const;

  /// The geometric mean over the lights of their references, in parts of all that arrives.
  double part() const;

 private:
  struct Norms {
    double received, all;
  };

  std::vector<Norms> lights_;
  double squares_ = 0;  ///< sum of the squares of the parts
};

/// The area norm of values - truth over `reference`; the relative difference where that is the norm
/// of the truth.
double received_error(std::span<const Float3> values, std::span<const Float3> truth,
                      std::span<const float> area, double reference);

}  // namespace rebounce
