#include "rebounce/demo/light_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rebounce/runtime/float3_glm.h"
#include "rebounce/runtime/sampling.h"

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

void follow_keys(Light& light, const std::vector<LightMotion::Key>& keys, float time) {
  const float end = keys.back().time;
  if (end > 0) time = std::fmod(time, end);
  const auto next = std::ranges::upper_bound(keys, time, {}, &LightMotion::Key::time);
  const auto& b = next == keys.end() ? keys.back() : *next;
  const auto& a = next == keys.begin() ? b : *(next - 1);
  const float way = b.time > a.time ? (time - a.time) / (b.time - a.time) : 0;
  light.position = mixed(a.position, b.position, way);
  light.direction = unit_or(mixed(a.direction, b.direction, way), light.direction);
  light.color = mixed(a.color, b.color, way);
  light.intensity = a.intensity + way * (b.intensity - a.intensity);
}

}  // namespace

Light moved(const Light& light, const LightMotion& motion, float time) {
  Light now = light;
  switch (motion.kind) {
    case LightMotion::Kind::kStill:
      break;
    case LightMotion::Kind::kCircle:
      now.position = on_circle(motion, time);
      break;
    case LightMotion::Kind::kSwing:
      now.position = on_swing(motion, time);
      break;
    case LightMotion::Kind::kKeys:
      follow_keys(now, motion.keys, time);
      break;
  }
  return now;
}

}  // namespace rebounce
