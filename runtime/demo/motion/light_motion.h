#pragma once

#include <cstdint>
#include <vector>

#include "transfer/data/scene_description.h"

namespace rebounce {

/// How a lamp, or a sphere that it lights, moves by itself.
struct LightMotion {
  enum class Kind : std::uint8_t {
    kStill,
    kCircle,  ///< around `center` in the plane that `axis` stands on, at even speed
    kSwing,   ///< between `from` and `to` and back, as a pendulum does
    kKeys,    ///< from key to key in straight lines, then again from the first
  };

  /// What the lamp is at a time.
  struct Key {
    float time = 0;              ///< seconds, >= 0
    Float3 position{0, 0, 0};    ///< metres
    Float3 direction{0, -1, 0};  ///< any length but 0
    Float3 color{1, 1, 1};       ///< as in Light
    float intensity = 1;         ///< as in Light
  };

  Kind kind = Kind::kStill;
  float period = 4;         ///< seconds for one round (circle, swing), > 0
  Float3 center{0, 0, 0};   ///< circle, metres
  Float3 axis{0, 1, 0};     ///< circle, any length but 0
  float radius = 0.5F;      ///< circle, metres, >= 0
  Float3 from{0, 0, 0};     ///< swing, metres
  Float3 to{0, 0, 0};       ///< swing, metres
  std::vector<Key> keys{};  ///< keys, by ascending time; not empty
};

/// Where something that rests at `position` is `time` seconds after the motion began. `time` >= 0.
Float3 moved(const Float3& position, const LightMotion& motion, float time);

/// `light` as it is `time` seconds after the motion began. `time` >= 0.
Light moved(const Light& light, const LightMotion& motion, float time);

}  // namespace rebounce
