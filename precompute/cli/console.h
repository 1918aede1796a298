#pragma once

#include <chrono>
#include <cstdio>
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

/// How far long work is, with time left, on `to`: on a terminal a bar, drawn ten times a second at
/// most; elsewhere, as in a log, a line whenever `line_interval` has gone by. Always reports
/// whether to go on, so that it can serve as a progress function.
class ProgressBar {
 public:
  explicit ProgressBar(bool enabled, std::FILE* to = stderr,
                       std::chrono::duration<double> line_interval = std::chrono::minutes(1));
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// Shows that `fraction` of `phase` is done; false once Ctrl-C was pressed.
  bool update(std::string_view phase, double fraction);

 private:
  using Clock = std::chrono::steady_clock;

  void draw(double fraction, double seconds);
  void print_line(double fraction, double seconds);
  void clear();

  bool enabled_, on_terminal_;
  std::FILE* to_;
  std::chrono::duration<double> line_interval_;
  bool drawn_ = false;
  std::string phase_;
  Clock::time_point phase_begin_{}, last_shown_;
};

/// Prints `line` on standard error unless `quiet`.
void print_note(const CommonOptions& options, const std::string& line);

}  // namespace rebounce::cli
