#pragma once

// The random numbers of a path.

#include <cstdint>
#include <glm/glm.hpp>

#include "runtime/rays/sampling.h"

namespace rebounce::reference {

/// The numbers in [0, 1) that one vertex of a path takes.
struct VertexNumbers {
  glm::dvec2 direction;      ///< of the ray onwards
  glm::dvec2 emitter_point;  ///< on the emitter that is looked at
  double emitter;            ///< which emitter
  double lamp;               ///< which lamp
  double survival;           ///< whether the path goes on
};

/// Random numbers, the next four 32-bit words at a time: splitmix64 from `state` on.
inline VertexNumbers random_numbers(std::uint64_t& state) {
  const auto next = [&state] {
    const glm::dvec2 pair = unit_square(mix_bits(state));
    state += 0x9E3779B97F4A7C15ULL;
    return pair;
  };
  const glm::dvec2 direction = next(), emitter_point = next(), choices = next();
  return {direction, emitter_point, choices.x, choices.y, next().x};
}

/// Point k of the three-dimensional sequence after the same idea as the R2 sequence (M. Roberts
/// 2018), shifted by `shift` modulo 1.
inline glm::dvec3 r3_point(std::uint32_t k, const glm::dvec3& shift) {
  constexpr double kG = 1.22074408460575947536;
  return glm::fract(shift + (k + 0.5) * glm::dvec3(1 / kG, 1 / (kG * kG), 1 / (kG * kG * kG)));
}

/// Well spread numbers for the first vertex of path `k` of a replicate: those that one integral
/// takes together come from one sequence.
inline VertexNumbers stratified_numbers(std::uint32_t k, std::uint64_t replicate_key) {
  const glm::dvec2 direction = r2_point(k, unit_square(mix_bits(replicate_key)));
  const glm::dvec2 shift = unit_square(mix_bits(replicate_key + 1));
  const glm::dvec3 emitter = r3_point(k, {shift, unit_square(mix_bits(replicate_key + 2)).x});
  return {direction, {emitter.x, emitter.y}, emitter.z, 0, 0};
}

}  // namespace rebounce::reference
