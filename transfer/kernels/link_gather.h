#pragma once

#include "transfer/base/bfloat16.h"
#include "transfer/kernels/link_kernels.h"
#include "transfer/kernels/vector_load.h"

namespace rebounce {

// These functions are static: each file compiles its own copy for its instruction set.

namespace {

/// A sum over links, lane by lane. Lanes of many lights stay in registers while links are added.
/// Their bits do not depend on the instruction set.
template <typename Lanes>
class LaneSum {
  using Value = typename Lanes::value_type;

 public:
  REBOUNCE_INLINE void set(Value factor, const Lanes& from) {
    unroll<kVectors>([&](auto k) REBOUNCE_INLINE {
      load(from, k, sum_[k]);
      sum_[k] *= factor;
    });
  }

  REBOUNCE_INLINE void add(Value factor, const Lanes& from) {
    unroll<kVectors>([&](auto k) REBOUNCE_INLINE {
      Vector vector;
      load(from, k, vector);
      sum_[k] += factor * vector;
    });
  }

  REBOUNCE_INLINE void add(const LaneSum& other) {
    unroll<kVectors>([&](auto k) REBOUNCE_INLINE { sum_[k] += other.sum_[k]; });
  }

  REBOUNCE_INLINE void store(Lanes& to) const {
    unroll<kVectors>([&](auto k) REBOUNCE_INLINE {
      __builtin_memcpy(to.data() + k * kWidth, &sum_[k], sizeof(Vector));
    });
  }

 private:
#ifdef __AVX512F__
  static constexpr std::size_t kRegister = 64;
#else
  static constexpr std::size_t kRegister = 32;
#endif

  /// The largest size of a vector that divides the lanes.
  static constexpr std::size_t vector_bytes() {
    for (std::size_t bytes = kRegister; bytes > sizeof(Value); bytes /= 2) {
      if (sizeof(Lanes) % bytes == 0) return bytes;
    }
    return sizeof(Value);
  }
  static constexpr std::size_t kBytes = vector_bytes();
  static constexpr std::size_t kWidth = kBytes / sizeof(Value), kVectors = sizeof(Lanes) / kBytes;
  using Vector __attribute__((vector_size(kBytes))) = Value;

  REBOUNCE_INLINE static void load(const Lanes& from, std::size_t k, Vector& vector) {
    __builtin_memcpy(&vector, from.data() + k * kWidth, sizeof(Vector));
  }

  Vector sum_[kVectors] = {};
};

}  // namespace

/// Adds the flux that arrives along links without gradients.
template <typename Lanes>
REBOUNCE_INLINE static inline void add_plain_links(const LinksOfNode& links,
                                                   const NodeLights<Lanes>& light,
                                                   LaneSum<Lanes>& flux) {
  for (std::size_t l = 0; l < links.plain_count; ++l) {
    flux.add(links.plain[l].exchange_area, light.mean_of(links.plain[l].from));
  }
}

/// GatherAlongLinks in plain C++, for any number type and number of channels. Moments of many
/// channels come from memory, so they are left alone where a single patch, which has none, is at
/// one end; links of the same kind are next to each other.
template <typename Lanes>
static inline LinkLightOf<Lanes> gather_along_links(const LinksOfNode& links,
                                                    const NodeLights<Lanes>& light) {
  LaneSum<Lanes> mean, first[3];
  add_plain_links(links, light, mean);
  for (std::size_t l = 0; l < links.affine_count; ++l) {
    const IncomingLink& link = links.affine[l];
    const Lanes& from = light.mean_of(link.from);
    LaneSum<Lanes> flux;  // its terms apart, so that links do not wait for each other
    flux.set(link.exchange_area, from);
    if (has_gradient(link.gradient_from)) {
      const std::array<Lanes, 3>& moments = light.first_of(link.from);
      unroll<3>([&](auto axis) REBOUNCE_INLINE {
        flux.add(bfloat16_to_float(link.gradient_from[axis]), moments[axis]);
      });
    }
    mean.add(flux);
    if (has_gradient(link.gradient_to)) {
      unroll<3>([&](auto axis) REBOUNCE_INLINE {
        first[axis].add(bfloat16_to_float(link.gradient_to[axis]), from);
      });
    }
  }
  LinkLightOf<Lanes> sum;
  mean.store(sum.mean);
  unroll<3>([&](auto axis) REBOUNCE_INLINE { first[axis].store(sum.first[axis]); });
  return sum;
}

}  // namespace rebounce
