#include "bench/report/light_paths.h"

#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <numbers>

#include "bench/support/light_changes.h"
#include "runtime/demo/motion/light_motion.h"
#include "runtime/rays/box.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce::bench {
namespace {

constexpr float kFramesPerSecond = 60;
constexpr int kPlaces = 256;          // that lamps are taken to
constexpr int kWalkStops = 64;        // more than the fast walk reaches
constexpr double kLeastLeg = 0.1;     // of the scene's diagonal: the way from stop to stop
constexpr int kSwitchFrames = 30;     // from one switch to the next
constexpr float kNightLight = 0.05F;  // of the lamp that is switched
constexpr int kManyLamps = 16;
constexpr float kColorPeriod = 5, kSwingPeriod = 2;  // seconds

/// Places of lamps, and which of them see each other.
class Places {
 public:
  Places(const TransferData& data, const RayTracer& tracer, std::uint64_t seed)
      : tracer_(tracer),
        lamps_(lamps_in_the_open(data, tracer, kPlaces, seed)),
        diagonal_(box_around(data.mesh.position).diagonal()) {}

  const Light& lamp(std::size_t k) const { return lamps_[k % lamps_.size()]; }
  double diagonal() const { return diagonal_; }

  /// The next place, counted from `from`, that lies free before it and not too near; itself if
  /// there is none.
  std::size_t next_from(std::size_t from) const {
    for (std::size_t step = 1; step < lamps_.size(); ++step) {
      const std::size_t to = (from + step) % lamps_.size();
      if (sees(lamp(from).position, lamp(to).position)) return to;
    }
    return from;
  }

 private:
  bool sees(const Float3& a, const Float3& b) const {
    return glm::distance(to_dvec3(a), to_dvec3(b)) > kLeastLeg * diagonal_ &&
           free_way(tracer_, a, b);
  }

  const RayTracer& tracer_;
  std::vector<Light> lamps_;
  double diagonal_;
};

/// From stop to stop at an even speed, a part of the diagonal for each frame.
LightMotion walk(const Places& places, std::size_t first, double diagonals_per_frame) {
  LightMotion motion{.kind = LightMotion::Kind::kKeys};
  const double speed = diagonals_per_frame * places.diagonal() * kFramesPerSecond;
  double time = 0;
  std::size_t at = first;
  for (int stop = 0; stop < kWalkStops; ++stop) {
    const Light& lamp = places.lamp(at);
    motion.keys.push_back({.time = static_cast<float>(time), .position = lamp.position});
    at = places.next_from(at);
    time += glm::distance(to_dvec3(lamp.position), to_dvec3(places.lamp(at).position)) / speed;
  }
  return motion;
}

LightMotion swing(const Places& places, std::size_t first, float period) {
  return {.kind = LightMotion::Kind::kSwing,
          .period = period,
          .from = places.lamp(first).position,
          .to = places.lamp(places.next_from(first)).position};
}

/// Lamps that move by themselves.
LightPath moving(const std::string& name, const std::vector<Light>& lamps,
                 const std::vector<LightMotion>& motions, int frame_count) {
  LightPath path{.name = name};
  for (int frame = 0; frame < frame_count; ++frame) {
    std::vector<Light>& now = path.frames.emplace_back();
    for (std::size_t k = 0; k < lamps.size(); ++k) {
      now.push_back(moved(lamps[k], motions[k], static_cast<float>(frame) / kFramesPerSecond));
    }
  }
  return path;
}

LightPath switching(const Places& places, int frame_count) {
  LightPath path{.name = "switching"};
  Light night = places.lamp(1);
  night.intensity = kNightLight;
  for (int frame = 0; frame < frame_count; ++frame) {
    Light lamp = places.lamp(0);
    if (frame / kSwitchFrames % 2 == 1) lamp.intensity = 0;
    path.frames.push_back({lamp, night});
    if (frame > 0 && frame % kSwitchFrames == 0) path.switches.push_back(frame);
  }
  return path;
}

LightPath color_cycle(const Places& places, int frame_count) {
  LightPath path{.name = "colour cycle"};
  for (int frame = 0; frame < frame_count; ++frame) {
    Light lamp = places.lamp(0);
    const float turn = static_cast<float>(frame) / kFramesPerSecond / kColorPeriod;
    for (int c = 0; c < kChannelCount; ++c) {
      const float phase = 2 * std::numbers::pi_v<float> * (turn - static_cast<float>(c) / 3);
      lamp.color[c] = 0.5F + 0.5F * std::cos(phase);
    }
    path.frames.push_back({lamp, places.lamp(1)});
  }
  return path;
}

LightPath sixteen(const Places& places, int frame_count) {
  std::vector<Light> lamps;
  std::vector<LightMotion> motions;
  for (std::size_t k = 0; k < kManyLamps; ++k) {
    const Light& target = places.lamp(places.next_from(k));
    lamps.push_back(lamp_of_type(kLampTypes[k % kLampTypes.size()], places.lamp(k), target.position,
                                 places.diagonal()));
    motions.push_back(swing(places, k, kSwingPeriod * (1 + 0.25F * static_cast<float>(k))));
  }
  return moving("sixteen lamps", lamps, motions, frame_count);
}

}  // namespace

std::vector<LightPath> make_light_paths(const TransferData& data, const RayTracer& tracer,
                                        int frame_count, std::uint64_t seed) {
  const Places places(data, tracer, seed);
  const std::vector<Light> one = {places.lamp(0)};
  return {moving("slow walk", one, {walk(places, 0, 0.001)}, frame_count),
          moving("fast walk", one, {walk(places, 0, 0.01)}, frame_count),
          moving("swinging lamp", one, {swing(places, 0, kSwingPeriod)}, frame_count),
          switching(places, frame_count),
          color_cycle(places, frame_count),
          sixteen(places, frame_count)};
}

}  // namespace rebounce::bench
