#pragma once

#include <limits>
#include <vector>

namespace rebounce {

/// Searches for the multiplier that gives the smallest operator within an error, which grows with
/// it, to a few per cent of its size: another trial takes as long as those before.
///
/// Works on the logarithms of both, where the error is nearly a straight line: outwards along the
/// line through the nearest two trials until the wanted error lies between two of them, then by the
/// secant between those (regula falsi, kept off the ends of the bracket). The curve may change from
/// one trial to the next, as weights that follow the errors make it: older trials that no curve
/// through the newest could have given are forgotten. Sizes fall along lines of their own.
class MultiplierSearch {
 public:
  /// Errors to `most` are good; `aim`, a little less, is steered for.
  struct Range {
    double aim = 0, most = 0;
  };

  /// What a trial is hoped to save of the size, or it is not made.
  static constexpr double kLeastSaving = 0.03;

  MultiplierSearch(double initial_multiplier, Range wanted)
      : multiplier_(initial_multiplier), wanted_(wanted) {}

  /// What to try next.
  double multiplier() const { return multiplier_; }

  /// Takes what multiplier() gave, the error, >= 0, and the size, > 0, and moves on to the next
  /// multiplier.
  void report(double error, double size);

  /// True once some error was good and the next multiplier is not expected to save enough, or the
  /// bracket is too narrow for more.
  bool done() const { return done_; }

 private:
  struct Trial {
    double multiplier, error, size;  ///< their logarithms
  };

  /// The logarithms of the multiplier to try next, and of the size where the error is as wanted.
  struct Next {
    double multiplier, size;
  };

  static bool contradicts(const Trial& trial, const Trial& old);
  static double size_at(double multiplier, const Trial& from, const Trial& to);
  Next inside(const Trial& low, const Trial& high) const;
  Next outside(const Trial& nearest) const;

  double multiplier_;
  Range wanted_;
  std::vector<Trial> trials_;                                  ///< by multiplier, ascending
  double smallest_ = std::numeric_limits<double>::infinity();  ///< logarithm, of what is good
  std::size_t forgotten_ = 0;
  bool done_ = false;
};

}  // namespace rebounce
