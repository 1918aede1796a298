#pragma once

// All kernels for one instruction set. The file of the set includes this; `V` is its vector of
// floats (vector_load.h), `N` its vector of integers (integer_kernels_impl.h).

#include "transfer/kernels/block_kernels_impl.h"
#include "transfer/kernels/dense_kernels_impl.h"
#include "transfer/kernels/gather_kernels_impl.h"
#include "transfer/kernels/kernels.h"
#include "transfer/kernels/link_gather.h"

namespace rebounce {
namespace {

template <typename V, typename N>
constexpr KernelSet make_kernels(const char* instruction_set, const GatherKernels& gather,
                                 GatherAlongLinks<ColorLanes> gather_along_links_of_one) {
  return {
      instruction_set,
      make_dense_kernels<V>(),
      make_block_kernels<V, N>(),
      gather,
      {gather_along_links_of_one, gather_along_links<ManyFloats>, gather_along_links<ManyDoubles>}};
}

}  // namespace
}  // namespace rebounce
