#pragma once

#include <cstdint>

namespace rebounce {

/// Instruction sets that kernels are compiled for.
enum class InstructionSet : std::uint8_t {
  kPortable,
  kAvx2,    ///< with FMA and F16C
  kAvx512,  ///< AVX-512F, BW, VL and VNNI: since Cascade Lake and Zen 4
};

/// The widest that this processor has.
InstructionSet widest_instruction_set();

}  // namespace rebounce
