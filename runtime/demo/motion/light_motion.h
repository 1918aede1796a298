#pragma once

#include <cstdint>
#include <vector>

#include "rebounce/lights.h"

namespace rebounce {

/// The motion of a lamp, or of a lit sphere.
struct LightMotion {
  enum class Kind : std::uint8_t {
    kStill,
    kCircle,  ///< around `center` in the plane perpendicular to `axis`, at constant speed
    kSwing,   ///< between `from` and `to` and back, like a pendulum
    kKeys,    ///< from key to key in straight lines, then again from the first
  };

  /// The state of the lamp at one time.
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

/// The position, `time` >= 0 seconds after the start, of an object that rests at `position`.
Float3 moved(const Float3& position, const LightMotion& motion, float time);

/// The state of `light`, `time` >= 0 seconds after the start.
Light moved(const Light& light, const LightMotion& motion, float time);

}  // namespace rebounce
