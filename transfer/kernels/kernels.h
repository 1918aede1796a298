#pragma once

#include <span>

#include "transfer/kernels/block_kernels.h"
#include "transfer/kernels/dense_kernels.h"
#include "transfer/kernels/gather_kernels.h"
#include "transfer/kernels/link_kernels.h"

namespace rebounce {

/// All kernels for one instruction set. Each set has a file of its own, the only one that is
/// compiled for these instructions.
struct KernelSet {
  const char* instruction_set;  ///< "portable", "avx2", "avx512"
  DenseKernels dense;
  BlockKernels blocks;
  const GatherKernels& gather;
  LinkKernels link;
};

extern const KernelSet kKernelsPortable;
extern const KernelSet kKernelsAvx2;  ///< with FMA and F16C
extern const KernelSet
    kKernelsAvx512;  ///< AVX-512 F, BW, VL and VNNI: Cascade Lake, Zen 4 and later

/// The sets of this build that this processor can run, narrowest first; kernels() is the widest.
std::span<const KernelSet* const> kernel_sets();
const KernelSet& kernels();

}  // namespace rebounce
