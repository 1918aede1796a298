#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "runtime/rays/sampling.h"

namespace rebounce {

/// Sobol's sequence in four dimensions (direction numbers: S. Joe and F. Y. Kuo, "Constructing
/// Sobol sequences with better two-dimensional projections", 2008), shifted digit by digit
/// (exclusive or) by random bits. Every point is uniform over [0, 1)^4, and the points of each
/// aligned block of 2^k are as well spread as unshifted ones. Points are made in blocks, so that
/// the compiler computes several at once.
class SobolBlocks {
 public:
  static constexpr int kDimensions = 4;
  static constexpr std::size_t kSize = 64;  ///< points of a block

  /// The coordinates of the points of a block, dimension by dimension.
  using Block = std::array<std::array<float, kSize>, kDimensions>;

  /// Equal `bits` give equal shifts.
  explicit SobolBlocks(std::uint64_t bits) {
    const std::uint64_t first = mix_bits(bits), second = mix_bits(first);
    shift_ = {high(first), low(first), high(second), low(second)};
  }

  /// Writes the first `count` <= kSize points of the block `number` to `block`.
  void fill(std::uint32_t number, std::size_t count, Block& block) const {
    for (int d = 0; d < kDimensions; ++d) {
      const std::uint32_t shift = shift_[d] ^ coordinate(d, number * kSize);
      const std::array<std::uint32_t, kSize>& first = kFirstBlock[d];
      for (std::size_t k = 0; k < count; ++k) {
        // The conversion goes through signed integers, because that is one instruction.
        block[d][k] =
            static_cast<float>(static_cast<std::int32_t>((first[k] ^ shift) >> 8)) * 0x1p-24F;
      }
    }
  }

 private:
  static constexpr int kBits = 32;
  using Directions = std::array<std::array<std::uint32_t, kBits>, kDimensions>;
  using FirstBlock = std::array<std::array<std::uint32_t, kSize>, kDimensions>;

  static std::uint32_t high(std::uint64_t bits) { return static_cast<std::uint32_t>(bits >> 32); }
  static std::uint32_t low(std::uint64_t bits) { return static_cast<std::uint32_t>(bits); }

  static constexpr Directions make_directions() {
    // Degree and inner coefficients of a primitive polynomial, and its first direction numbers.
    struct Polynomial {
      int degree;
      std::uint32_t coefficients;
      std::array<std::uint32_t, 3> first;
    };
    constexpr std::array<Polynomial, kDimensions - 1> kPolynomials = {
        Polynomial{1, 0, {1, 0, 0}}, {2, 1, {1, 3, 0}}, {3, 1, {1, 3, 1}}};
    Directions directions{};
    for (int bit = 0; bit < kBits; ++bit) directions[0][bit] = 1U << (kBits - 1 - bit);
    for (int d = 1; d < kDimensions; ++d) {
      const auto& [degree, coefficients, first] = kPolynomials[d - 1];
      std::array<std::uint32_t, kBits>& v = directions[d];
      for (int bit = 0; bit < degree; ++bit) v[bit] = first[bit] << (kBits - 1 - bit);
      for (int bit = degree; bit < kBits; ++bit) {
        v[bit] = v[bit - degree] ^ (v[bit - degree] >> degree);
        for (int k = 1; k < degree; ++k) {
          if ((coefficients >> (degree - 1 - k) & 1U) != 0) v[bit] ^= v[bit - k];
        }
      }
    }
    return directions;
  }

  static constexpr std::uint32_t coordinate(int dimension, std::uint32_t index) {
    std::uint32_t x = 0;
    for (int bit = 0; index != 0; ++bit, index >>= 1) {
      if ((index & 1U) != 0) x ^= kDirections[dimension][bit];
    }
    return x;
  }

  static constexpr FirstBlock make_first_block() {
    FirstBlock block{};
    for (int d = 0; d < kDimensions; ++d) {
      for (std::uint32_t k = 0; k < kSize; ++k) block[d][k] = coordinate(d, k);
    }
    return block;
  }

  static const Directions kDirections;
  static const FirstBlock kFirstBlock;

  std::array<std::uint32_t, kDimensions> shift_;
};

inline constexpr SobolBlocks::Directions SobolBlocks::kDirections = SobolBlocks::make_directions();
inline constexpr SobolBlocks::FirstBlock SobolBlocks::kFirstBlock = SobolBlocks::make_first_block();

}  // namespace rebounce
