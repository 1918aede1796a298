#pragma once

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace rebounce::bench {

/// Wall-clock seconds by phase, in the order of their beginnings: what a measurement takes itself.
class PhaseSeconds {
 public:
  void enter(std::string_view phase) {
    const auto now = std::chrono::steady_clock::now();
    if (phase_ < seconds_.size()) {
      if (seconds_[phase_].first == phase) return;
      add_until(now);
    }
    begin_ = now;
    const auto found = std::ranges::find(seconds_, phase, &Seconds::first);
    phase_ = static_cast<std::size_t>(found - seconds_.begin());
    if (found == seconds_.end()) seconds_.emplace_back(phase, 0.0);
  }

  nlohmann::ordered_json finish() {
    add_until(std::chrono::steady_clock::now());
    nlohmann::ordered_json json;
    for (const auto& [phase, seconds] : seconds_) json[phase] = seconds;
    return json;
  }

 private:
  using Seconds = std::pair<std::string, double>;

  void add_until(std::chrono::steady_clock::time_point now) {
    const std::chrono::duration<double> passed = now - begin_;
    if (phase_ < seconds_.size()) seconds_[phase_].second += passed.count();
  }

  std::vector<Seconds> seconds_;
  std::size_t phase_ = 0;
  std::chrono::steady_clock::time_point begin_;
};

}  // namespace rebounce::bench
