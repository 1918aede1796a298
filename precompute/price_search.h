#pragma once

#include <vector>

namespace rebounce {

/// Searches for the price at which the error, which grows with it, falls into a range.
///
/// Works on the logarithms of both, where the error is nearly a straight line: outwards along the
/// line through the nearest two trials until the wanted error lies between two of them, then by the
/// secant between those (regula falsi, kept off the ends of the bracket). The curve may change from
/// one trial to the next, as weights that follow the errors make it: older trials that no curve
/// through the newest could have given are forgotten.
class PriceSearch {
 public:
  /// Errors in [least, most] are good, and `aim` between them is steered for.
  struct Range {
    double least = 0, aim = 0, most = 0;
  };

  PriceSearch(double first_price, Range wanted) : price_(first_price), wanted_(wanted) {}

  /// What to try next.
  double price() const { return price_; }

  /// Takes the error that price() gave, >= 0, and moves on to the next price.
  void report(double error);

  /// True once the last error reported was good, or the bracket is too narrow for more.
  bool done() const { return done_; }

 private:
  struct Trial {
    double price, error;  ///< their logarithms
  };

  static bool contradicts(const Trial& trial, const Trial& old);
  double inside(const Trial& low, const Trial& high) const;
  double outside(const Trial& nearest) const;

  double price_;
  Range wanted_;
  std::vector<Trial> trials_;  ///< by price, ascending
  std::size_t forgotten_ = 0;
  bool done_ = false;
};

}  // namespace rebounce
