#pragma once

#include <cstddef>
#include <vector>

namespace rebounce {

/// The reference of errors at receivers. It is the light that arrives at receivers or, if that is
/// more, the usual share of the light that arrives anywhere: the root mean square of that share
/// over all lights. A lamp in another room therefore counts as it does among all patches, unless
/// all lamps are in other rooms. If all patches are receivers, it is the light that arrives.
class ErrorReference {
 public:
  /// Adds a light: the area norms of what arrives at receivers and at all patches.
  void add(double received, double all);

  /// Adds light k of another.
  void append(const ErrorReference& other, std::size_t k);

  /// The reference of a light, numbered in the order of adding.
  double reference(std::size_t light) const;

  /// The error of a light: `distance`, the area norm of what the values at receivers are off,
  /// divided by the reference. 0 if both are 0; infinite if only the reference is 0.
  double error(std::size_t light, double distance) const;

  /// The geometric mean of the references over the lights, as a fraction of all that arrives.
  double part() const;

 private:
  struct Norms {
    double received, all;
  };

  std::vector<Norms> lights_;
  double squares_ = 0;  ///< sum of the squared fractions
};

}  // namespace rebounce
