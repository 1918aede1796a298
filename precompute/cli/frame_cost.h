#pragma once

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "rebounce/engine.h"

namespace rebounce::cli {

/// The microseconds that `work` takes.
template <typename Work>
double microseconds_of(const Work& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  const std::chrono::duration<double, std::micro> time = std::chrono::steady_clock::now() - begin;
  return time.count();
}

/// Median of the microseconds that `work` returns, repeated for about half a second but at least
/// three times.
template <typename Work>
double median_microseconds(const Work& work) {
  std::vector<double> times;
  double total = 0;
  while (times.size() < 3 || (total < 5e5 && times.size() < 1000)) {
    times.push_back(work());
    total += times.back();
  }
  std::ranges::nth_element(times, times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2));
  return times[times.size() / 2];
}

/// The light on all patches of a frame, in lumens.
struct FrameFlux {
  double direct = 0;    ///< that arrives straight from lamps and sky
  double emitted = 0;   ///< that surfaces emit
  double indirect = 0;  ///< that arrives from other patches, after any number of bounces
};

/// The light of the last frame, with this indirect irradiance [n] in lx.
FrameFlux flux_of(const Engine& engine, std::span<const Float3> indirect_irradiance);

/// The flux in a line for people, and for --json.
std::string described(const FrameFlux& flux);
nlohmann::json as_json(const FrameFlux& flux);

/// What the stages of a frame take on this machine, in microseconds.
struct FrameTimes {
  double direct = 0;   ///< direct light
  double product = 0;  ///< indirect light
};

/// Engine::relight, timed. The first frame of an engine traces all lamps anew.
FrameTimes relight_timed(Engine& engine, std::span<const Light> lights, const Sky& sky);

/// The medians of frames of one point lamp that moves. The engine then has another light than
/// before.
FrameTimes typical_times(Engine& engine);

}  // namespace rebounce::cli
