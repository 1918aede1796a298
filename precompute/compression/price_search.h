#pragma once

#include <limits>
#include <vector>

namespace rebounce {

/// Searches for the price that gives the smallest operator within an error, which grows with it, to
/// a few per cent of its size: another trial takes as long as those before.
///
/// Works on the logarithms of both, where the error is nearly a straight line: outwards along the
/// line through the nearest two trials until the wanted error lies between two of them, then by the
/// secant between those (regula falsi, kept off the ends of the bracket). The curve may change from
/// one trial to the next, as weights that follow the errors make it: older trials that no curve
/// through the newest could have given are forgotten. Sizes fall along lines of their own.
class PriceSearch {
 public:
  /// Errors to `most` are good; `aim`, a little less, is steered for.
  struct Range {
    double aim = 0, most = 0;
  };

  /// What a trial is hoped to save of the size, or it is not made.
  static constexpr double kLeastSaving = 0.03;

  PriceSearch(double first_price, Range wanted) : price_(first_price), wanted_(wanted) {}

  /// What to try next.
  double price() const { return price_; }

  /// Takes what price() gave, the error, >= 0, and the size, > 0, and moves on to the next price.
  void report(double error, double size);

  /// True once some error was good and the next price is not expected to save enough, or the
  /// bracket is too narrow for more.
  bool done() const { return done_; }

 private:
  struct Trial {
    double price, error, size;  ///< their logarithms
  };

  /// The logarithms of the price to try next, and of the size where the error is as wanted.
  struct Next {
    double price, size;
  };

  static bool contradicts(const Trial& trial, const Trial& old);
  static double size_at(double price, const Trial& from, const Trial& to);
  Next inside(const Trial& low, const Trial& high) const;
  Next outside(const Trial& nearest) const;

  double price_;
  Range wanted_;
  std::vector<Trial> trials_;                                  ///< by price, ascending
  double smallest_ = std::numeric_limits<double>::infinity();  ///< logarithm, of what is good
  std::size_t forgotten_ = 0;
  bool done_ = false;
};

}  // namespace rebounce
