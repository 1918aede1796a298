#include "instruction_sets.h"

namespace rebounce::bench {

std::vector<const DenseKernels*> available_kernels() {
  std::vector<const DenseKernels*> sets = {&kDenseKernelsPortable};
  const DenseKernels* widest = &dense_kernels();
#if defined(__x86_64__)
  if (widest == &kDenseKernelsAvx512) sets.push_back(&kDenseKernelsAvx2);
#endif
  if (widest != sets.front()) sets.push_back(widest);
  return sets;
}

}  // namespace rebounce::bench
