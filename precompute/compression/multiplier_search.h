#pragma once

#include <limits>
#include <vector>

namespace rebounce {

/// Searches for the Lagrange multiplier that gives the smallest operator within an error. The error
/// grows with the multiplier. The search stops within a few per cent of the smallest size, because
/// every trial takes long.
///
/// It works on the logarithms of multiplier and error, where the curve is nearly straight. It steps
/// outwards along the line through the two nearest trials until the wanted error lies between two
/// trials, then uses the secant between those (regula falsi, kept off the ends of the bracket). The
/// curve may change from one trial to the next, because weights follow the errors: older trials
/// that do not fit a curve through the newest are dropped. Sizes follow lines of their own.
class MultiplierSearch {
 public:
  /// Errors up to `most` are accepted; the search aims at `aim`, a little less.
  struct Range {
    double aim = 0, most = 0;
  };

  /// What is known before the first trial.
  struct Expected {
    /// Slope of the logarithm of the error over that of the multiplier.
    double slope = 0;
    /// The least fraction of the size that a further trial is expected to save.
    double least_saving = 0;
  };

  MultiplierSearch(double initial_multiplier, Range wanted, Expected expected)
      : multiplier_(initial_multiplier), wanted_(wanted), expected_(expected) {}

  /// The multiplier of the next trial.
  double multiplier() const { return multiplier_; }

  /// Reports the error, >= 0, and the size, > 0, of the trial at multiplier(), and chooses the next
  /// multiplier.
  void report(double error, double size);

  /// True once an error was accepted and the next trial is not expected to save enough, or the
  /// bracket is too narrow for another.
  bool done() const { return done_; }

 private:
  struct Trial {
    double multiplier, error, size;  ///< logarithms
  };

  /// The logarithms of the next multiplier, and of the size where the error is the aim.
  struct Next {
    double multiplier, size;
  };

  static bool contradicts(const Trial& trial, const Trial& old);
  static double size_at(double multiplier, const Trial& from, const Trial& to);
  Next inside(const Trial& low, const Trial& high) const;
  Next outside(const Trial& nearest) const;

  double multiplier_;
  Range wanted_;
  Expected expected_;
  std::vector<Trial> trials_;  ///< by multiplier, ascending
  /// Logarithm of the smallest accepted size.
  double smallest_ = std::numeric_limits<double>::infinity();
  std::size_t forgotten_ = 0;
  bool done_ = false;
};

}  // namespace rebounce
