#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace rebounce::cli {

/// Options of every sub-command.
struct CommonOptions {
  /// A machine-readable summary on standard output; all other text goes to standard error.
  bool json = false;
  bool quiet = false;  ///< no progress, no summary
  int threads = 0;     ///< OpenMP threads; 0: all processors
};

/// The first Ctrl-C requests a stop at the next convenient place, the second ends the program at
/// once.
void install_interrupt_handler();
bool interrupted();

/// Shows the progress of long work on `to`, with the time left: on a terminal a bar, drawn at most
/// ten times a second; elsewhere, as in a log, a line after every `line_interval`. It reports
/// whether to continue, so that it can be used as a progress function.
class ProgressBar {
 public:
  explicit ProgressBar(bool enabled, std::FILE* to = stderr,
                       std::chrono::duration<double> line_interval = std::chrono::minutes(1));
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// Shows that `fraction` of `phase` is done. Returns false after Ctrl-C.
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

/// Prints the summary that --json asks for on standard output.
void print_json(const nlohmann::json& summary);

}  // namespace rebounce::cli
