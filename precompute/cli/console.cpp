#include "precompute/cli/console.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdio>
#include <string>

#include "precompute/base/json_text.h"

namespace rebounce::cli {
namespace {

volatile std::sig_atomic_t interrupt_seen = 0;

extern "C" void on_interrupt(int signal_number) {
  interrupt_seen = 1;
  std::signal(signal_number, SIG_DFL);
}

std::string readable_time(double seconds) {
  const auto whole = std::lround(seconds);
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

/// Prints what it can: a log that cannot be written to ends no build.
void write_text(std::FILE* to, const std::string& text) {
  std::fwrite(text.data(), 1, text.size(), to);
  std::fflush(to);
}

/// Empty as long as it would be a guess.
std::string time_left(double fraction, double seconds) {
  if (fraction <= 0.02 || seconds <= 0.5) return "";
  return ", " + readable_time(seconds * (1 - fraction) / fraction) + " left";
}

}  // namespace

void install_interrupt_handler() {
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
}

bool interrupted() {
  return interrupt_seen != 0;
}

ProgressBar::ProgressBar(bool enabled, std::FILE* to, std::chrono::duration<double> line_interval)
    : enabled_(enabled),
      on_terminal_(isatty(fileno(to)) != 0),
      to_(to),
      line_interval_(line_interval),
      last_shown_(Clock::now()) {}

ProgressBar::~ProgressBar() {
  clear();
}

bool ProgressBar::update(std::string_view phase, double fraction) {
  if (!enabled_) return !interrupted();
  const Clock::time_point now = Clock::now();
  if (phase != phase_) {
    phase_ = phase;
    phase_begin_ = now;
  }
  const std::chrono::duration<double> drawn_at_least(0.1);
  if (fraction >= 1) {
    clear();
  } else if (now - last_shown_ >= (on_terminal_ ? drawn_at_least : line_interval_)) {
    const std::chrono::duration<double> since_begin = now - phase_begin_;
    on_terminal_ ? draw(fraction, since_begin.count()) : print_line(fraction, since_begin.count());
    last_shown_ = now;
  }
  return !interrupted();
}

void ProgressBar::draw(double fraction, double seconds) {
  constexpr int kWidth = 30;
  const int filled = static_cast<int>(fraction * kWidth);
  write_text(to_, fmt::format("\r\033[K{:<13} [{}{}] {:3.0f} %{}", phase_, std::string(filled, '#'),
                              std::string(kWidth - filled, '.'), 100 * fraction,
                              time_left(fraction, seconds)));
  drawn_ = true;
}

void ProgressBar::print_line(double fraction, double seconds) {
  write_text(to_,
             fmt::format("{}: {:.0f} %{}\n", phase_, 100 * fraction, time_left(fraction, seconds)));
}

void ProgressBar::clear() {
  if (drawn_) write_text(to_, "\r\033[K");
  drawn_ = false;
}

void print_note(const CommonOptions& options, const std::string& line) {
  if (!options.quiet) write_text(stderr, line + "\n");
}

void print_json(const nlohmann::json& summary) {
  fmt::print("{}\n", json_text(summary, 2));
}

}  // namespace rebounce::cli
