#pragma once

#include <chrono>
#include <string>
#include <string_view>

namespace rebounce::cli {

/// Options that every sub-command has.
struct CommonOptions {
  bool json = false;  ///< a machine-readable summary on standard output, all else on standard error
  bool quiet = false;  ///< no progress, no summary
  int threads = 0;     ///< OpenMP threads; 0: all processors
};

/// Turns the first Ctrl-C into a request to stop at the next convenient place, and the second into
/// an immediate end.
void install_interrupt_handler();
bool interrupted();

/// A progress bar with time left on standard error: drawn only on a terminal, at most ten times a
/// second. Always reports whether to go on, so that it can serve as a progress function.
class ProgressBar {
 public:
  explicit ProgressBar(bool enabled);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// Shows that `fraction` of `phase` is done; false once Ctrl-C was pressed.
  bool update(std::string_view phase, double fraction);

 private:
  using Clock = std::chrono::steady_clock;

  void draw(double fraction, double seconds);
  void clear();

  bool enabled_;
  bool drawn_ = false;
  std::string phase_;
  Clock::time_point phase_begin_{}, last_drawn_{};
};

/// Prints `line` on standard error unless `quiet`.
void print_note(const CommonOptions& options, const std::string& line);

}  // namespace rebounce::cli
