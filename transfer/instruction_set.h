#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace rebounce {

/// Instruction sets that kernels are compiled for.
enum class InstructionSet : std::uint8_t {
  kPortable,
  kAvx2,    ///< with FMA and F16C
  kAvx512,  ///< AVX-512F, BW, VL and VNNI: since Cascade Lake and Zen 4
};

/// The widest that this processor has.
InstructionSet widest_instruction_set();

/// Of kernels for each instruction set, in their order, those that this processor runs.
template <typename Kernels, std::size_t kCount>
std::span<const Kernels* const> runnable(const std::array<const Kernels*, kCount>& kernels) {
  const std::size_t count = static_cast<std::size_t>(widest_instruction_set()) + 1;
  return std::span(kernels).first(std::min(count, kCount));
}

}  // namespace rebounce
