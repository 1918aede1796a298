#pragma once

// Frame after frame of one engine, as a game that runs for hours sees them: lamps jump, switch, lie
// inside of walls, and now and then are no lamps at all.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <tuple>
#include <utility>
#include <vector>

#include "rebounce/engine.h"
#include "rebounce/error.h"
#include "runtime/rays/box.h"
#include "tests/support/allocation_counter.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::test {

/// Processor time of the calling thread: what a frame takes whoever else is at work, if OpenMP has
/// one thread.
inline double thread_microseconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e6 * static_cast<double>(time.tv_sec) + 1e-3 * static_cast<double>(time.tv_nsec);
}

/// How long frames took, in classes of a sixteenth of an octave.
class FrameTimes {
 public:
  static constexpr std::size_t kEnough = 100;  ///< frames of which the median says something

  void add(double microseconds) {
    const double place = 16 * std::log2(std::max(1.0, microseconds));
    ++frames_[std::min<std::size_t>(frames_.size() - 1, static_cast<std::size_t>(place))];
    ++count_;
    largest_ = std::max(largest_, microseconds);
  }

  /// Whether a time is far above those that there are so far.
  bool is_slow(double microseconds) const {
    return count_ >= kEnough ? microseconds > 4 * median() : microseconds > 30;
  }

  std::size_t count() const { return count_; }
  double largest() const { return largest_; }  ///< microseconds

  double median() const {
    std::size_t below = 0, place = 0;
    while (below + frames_[place] <= count_ / 2) below += frames_[place++];
    return std::exp2((static_cast<double>(place) + 0.5) / 16);
  }

 private:
  std::array<std::uint32_t, 400> frames_{};
  std::size_t count_ = 0;
  double largest_ = 0;
};

/// Frames with a light state that changes at random: four lamps in the mean, now and then 256, of
/// all kinds in turn, anywhere in the box of the scene and a little beyond it.
class LongRun {
 public:
  static constexpr std::size_t kMostLamps = 256, kUsualLamps = 8, kKinds = 6;
  static constexpr std::size_t kCompared = 1000;  ///< every so many frames, a fresh engine

  LongRun(std::shared_ptr<const TransferData> data, std::uint64_t seed)
      : data_(std::move(data)),
        settings_{.direct_lighting = {.light_capacity = kMostLamps}},
        engine_(data_, settings_),
        box_(box_around(data_->mesh.position)),
        random_(seed) {
    lamps_.reserve(kMostLamps);
    traced_.reserve(kMostLamps);
    for (std::size_t k = 0; k < 4; ++k) add_lamp();
  }

  void frame() {
    const std::vector<Light> last_lamps = lamps_;
    const Sky last_sky = sky_;
    change_lamps();
    int allocations = 0;
    double time = timed_frame(allocations);
    if (frames_ > 0) allocations_ += allocations;
    FrameTimes& times = times_[key(last_lamps)];
    // An interrupt may take more than a frame: what a slow one takes itself is what it takes again.
    for (int k = 0; k < kRepeats && times.is_slow(time); ++k) {
      engine_.relight(last_lamps, last_sky);
      time = std::min(time, timed_frame(allocations));
      if (k == 0) ++repeated_;
    }
    times.add(time);
    if (uniform() < 0.002) refuse();
    if (++frames_ % kCompared == 0) compare();
  }

  /// The largest time of a frame over the median of frames with as many lamps of which as many of
  /// each kind are traced; of a hundred such frames at least.
  double largest_over_median() const {
    double largest = 0;
    for (const auto& [key, times] : times_) {
      if (times.count() >= FrameTimes::kEnough) {
        largest = std::max(largest, times.largest() / times.median());
      }
    }
    return largest;
  }

  std::size_t frames() const { return frames_; }
  std::size_t repeated() const { return repeated_; }    ///< frames that seemed slow
  std::size_t compared() const { return compared_; }    ///< frames beside a fresh engine
  std::size_t different() const { return different_; }  ///< of these, with other bits
  std::size_t refused() const { return refused_; }      ///< frames with a lamp that is none
  std::size_t mistaken() const { return mistaken_; }    ///< taken, or with another frame after it
  std::size_t crowded() const { return crowded_; }      ///< frames with all lamps there are
  long allocations() const { return allocations_; }     ///< after the first frame

  /// Prints the frames by what was traced, slowest first in parts of the median.
  void print_times() const {
    std::vector<std::pair<double, Key>> rows;
    for (const auto& [key, times] : times_) {
      if (times.count() >= FrameTimes::kEnough)
        rows.emplace_back(times.largest() / times.median(), key);
    }
    std::ranges::sort(rows, std::greater<>());
    std::printf(
        "largest/median  lamps  traced by kind  other light  frames   median us  largest us\n");
    for (const auto& [ratio, key] : rows) {
      const FrameTimes& times = times_.at(key);
      std::printf("%14.1f %6zu ", ratio, std::get<0>(key));
      for (const std::uint8_t n : std::get<1>(key)) std::printf(" %3d", n);
      std::printf(" %6s %8zu %10.0f %10.0f\n", std::get<2>(key) ? "yes" : "no", times.count(),
                  times.median(), times.largest());
    }
  }

 private:
  static constexpr int kRepeats = 5;

  using Key = std::tuple<std::size_t, std::array<std::uint8_t, kKinds>, bool>;

  double timed_frame(int& allocations) {
    const double start = thread_microseconds();
    allocations = count_allocations([&] { engine_.relight(lamps_, sky_); });
    return thread_microseconds() - start;
  }

  double uniform() { return std::uniform_real_distribution<double>(0, 1)(random_); }

  Float3 place() {
    Float3 p;
    for (int c = 0; c < 3; ++c) {
      p[c] = box_.low[c] + box_.extent()[c] * static_cast<float>(1.2 * uniform() - 0.1);
    }
    return p;
  }

  void move(std::size_t k) {
    lamps_[k].position = place();
    const auto angle = static_cast<float>(6.28 * uniform());
    lamps_[k].direction = {0.6F * std::cos(angle), -0.8F, 0.6F * std::sin(angle)};
    traced_[k] = 1;
  }

  void add_lamp() {
    Light lamp;
    lamp.type = static_cast<LightType>(lamps_.size() % kKinds);
    lamp.radius = 0.02F * static_cast<float>(box_.diagonal());
    lamp.size = {lamp.radius, 2 * lamp.radius};
    lamp.intensity = 10;
    lamps_.push_back(lamp);
    traced_.push_back(0);
    move(lamps_.size() - 1);
  }

  void change_lamps() {
    for (std::size_t k = 0; k < lamps_.size(); ++k) {
      if (lamps_[k].intensity > 0) traced_[k] = 0;
    }
    if (frames_ % 5000 == 400) {  // a crowd, for twenty frames
      while (lamps_.size() < kMostLamps) add_lamp();
      for (std::size_t k = 0; k < kMostLamps; ++k) move(k);
    } else if (frames_ % 5000 == 420) {
      lamps_.resize(4);
      traced_.resize(4);
    }
    if (lamps_.size() == kMostLamps) ++crowded_;
    if (lamps_.size() <= kUsualLamps && uniform() < 0.02) {
      const bool more = lamps_.empty() || (lamps_.size() < kUsualLamps && uniform() < 0.5);
      if (more) {
        add_lamp();
      } else {
        lamps_.pop_back();
        traced_.pop_back();
      }
    }
    sky_.luminance = uniform() < 0.5 ? 0.0F : 3.0F;
    if (lamps_.empty()) return;
    const std::size_t k = random_() % lamps_.size();
    if (uniform() < 0.3) move(k);
    if (uniform() < 0.1) lamps_[k].intensity = lamps_[k].intensity > 0 ? 0.0F : 20.0F;
    if (uniform() < 0.1) lamps_[k].color = {static_cast<float>(uniform()), 1, 0.3F};
  }

  /// A frame with a lamp that is none must be refused, and the last frame stay.
  void refuse() {
    if (lamps_.empty()) return;
    const std::vector<Float3> before(engine_.radiosity().begin(), engine_.radiosity().end());
    std::vector<Light> bad = lamps_;
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    Light& lamp = bad[random_() % bad.size()];
    (uniform() < 0.5 ? lamp.intensity : lamp.color[1]) = kNan;
    ++refused_;
    try {
      engine_.relight(bad, sky_);
      ++mistaken_;
    } catch (const Error&) {
      if (!std::ranges::equal(before, engine_.radiosity())) ++mistaken_;
    }
  }

  void compare() {
    Engine fresh(data_, settings_);
    fresh.relight(lamps_, sky_);
    ++compared_;
    const bool same =
        std::ranges::equal(fresh.direct_irradiance(), engine_.direct_irradiance()) &&
        std::ranges::equal(fresh.indirect_irradiance(), engine_.indirect_irradiance()) &&
        std::ranges::equal(fresh.radiosity(), engine_.radiosity());
    if (!same) ++different_;
  }

  /// What decides how long a frame takes: lamps, of each kind those that are traced, and whether
  /// any shines otherwise than in the last frame. The scene is closed: skies change nothing.
  Key key(const std::vector<Light>& last_lamps) const {
    const auto same = [](const Light& a, const Light& b) {
      return a.intensity == b.intensity && a.color == b.color && a.position == b.position;
    };
    const bool changed = !std::ranges::equal(lamps_, last_lamps, same);
    Key key{lamps_.size(), {}, changed};
    for (std::size_t k = 0; k < lamps_.size(); ++k) {
      if (traced_[k] != 0 && lamps_[k].intensity > 0) ++std::get<1>(key)[k % kKinds];
    }
    return key;
  }

  std::shared_ptr<const TransferData> data_;
  EngineSettings settings_;
  Engine engine_;
  Box box_;
  std::mt19937_64 random_;
  std::vector<Light> lamps_;
  std::vector<std::uint8_t> traced_;  ///< [lamps] moved since they were last traced
  Sky sky_;
  std::map<Key, FrameTimes> times_;
  std::size_t frames_ = 0, compared_ = 0, different_ = 0, refused_ = 0, mistaken_ = 0, crowded_ = 0,
              repeated_ = 0;
  long allocations_ = 0;
};

}  // namespace rebounce::test
