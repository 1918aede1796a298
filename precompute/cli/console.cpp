#include "console.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdio>

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

}  // namespace

void install_interrupt_handler() {
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
}

bool interrupted() {
  return interrupt_seen != 0;
}

ProgressBar::ProgressBar(bool enabled) : enabled_(enabled && isatty(STDERR_FILENO) != 0) {}

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
  const std::chrono::duration<double> since_drawn = now - last_drawn_;
  if (fraction >= 1) {
    clear();
  } else if (since_drawn.count() > 0.1) {
    draw(fraction, std::chrono::duration<double>(now - phase_begin_).count());
    last_drawn_ = now;
  }
  return !interrupted();
}

void ProgressBar::draw(double fraction, double seconds) {
  constexpr int kWidth = 30;
  const int filled = static_cast<int>(fraction * kWidth);
  std::string left;
  if (fraction > 0.02 && seconds > 0.5) {
    left = ", " + readable_time(seconds * (1 - fraction) / fraction) + " left";
  }
  fmt::print(stderr, "\r\033[K{:<13} [{}{}] {:3.0f} %{}", phase_, std::string(filled, '#'),
             std::string(kWidth - filled, '.'), 100 * fraction, left);
  std::fflush(stderr);
  drawn_ = true;
}

void ProgressBar::clear() {
  if (drawn_) fmt::print(stderr, "\r\033[K");
  std::fflush(stderr);
  drawn_ = false;
}

void print_note(const CommonOptions& options, const std::string& line) {
  if (!options.quiet) fmt::print(stderr, "{}\n", line);
}

}  // namespace rebounce::cli
