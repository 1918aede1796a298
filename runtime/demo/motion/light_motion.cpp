#include "runtime/demo/motion/light_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"

namespace rebounce {
namespace {

constexpr float kTurn = 2 * std::numbers::pi_v<float>;

Float3 on_circle(const LightMotion& motion, float time) {
  const glm::dmat3 frame = frame_around(glm::normalize(to_dvec3(motion.axis)));
  const double angle = kTurn * std::fmod(time / motion.period, 1.0F);
  const glm::dvec3 arm = std::cos(angle) * frame[0] + std::sin(angle) * frame[1];
  return to_float3(to_dvec3(motion.center) + static_cast<double>(motion.radius) * arm);
}

Float3 on_swing(const LightMotion& motion, float time) {
  const float way = 0.5F - 0.5F * std::cos(kTurn * std::fmod(time / motion.period, 1.0F));
  return to_float3(glm::mix(to_glm(motion.from), to_glm(motion.to), way));
}

Float3 mixed(const Float3& a, const Float3& b, float way) {
  return to_float3(glm::mix(to_glm(a), to_glm(b), way));
}

Float3 unit_or(const Float3& v, const Float3& otherwise) {
  const float length = glm::length(to_glm(v));
  return length > 1e-6F ? to_float3(to_glm(v) / length) : otherwise;
}

// The keys before and after a time, and the fraction of the way between them.
struct BetweenKeys {
  const LightMotion::Key &a, &b;
  float way;
};

BetweenKeys find_keys(const std::vector<LightMotion::Key>& keys, float time) {
  const float end = keys.back().time;
  if (end > 0) time = std::fmod(time, end);
  const auto next = std::ranges::upper_bound(keys, time, {}, &LightMotion::Key::time);
  const auto& b = next == keys.end() ? keys.back() : *next;
  const auto& a = next == keys.begin() ? b : *(next - 1);
  return {a, b, b.time > a.time ? (time - a.time) / (b.time - a.time) : 0};
}

}  // namespace

Float3 moved(const Float3& position, const LightMotion& motion, float time) {
  switch (motion.kind) {
    case LightMotion::Kind::kCircle:
      return on_circle(motion, time);
    case LightMotion::Kind::kSwing:
      return on_swing(motion, time);
    case LightMotion::Kind::kKeys: {
      const auto [a, b, way] = find_keys(motion.keys, time);
      return mixed(a.position, b.position, way);
    }
    case LightMotion::Kind::kStill:
      break;
  }
  return position;
}

Light moved(const Light& light, const LightMotion& motion, float time) {
  Light now = light;
  now.position = moved(light.position, motion, time);
  if (motion.kind != LightMotion::Kind::kKeys) return now;
  const auto [a, b, way] = find_keys(motion.keys, time);
  now.direction = unit_or(mixed(a.direction, b.direction, way), light.direction);
  now.color = mixed(a.color, b.color, way);
  now.intensity = a.intensity + way * (b.intensity - a.intensity);
  return now;
}

}  // namespace rebounce
