#pragma once

// All block kernels for one instruction set. The file of the set includes this; `V` is its vector
// of floats (vector_load.h), `N` its vector of integers (integer_kernels_impl.h).

#include <cstdint>

#include "transfer/kernels/basis_kernels_impl.h"
#include "transfer/kernels/block_kernels.h"
#include "transfer/kernels/coupling_kernels_impl.h"
#include "transfer/kernels/dense_block_kernels_impl.h"
#include "transfer/kernels/integer_kernels_impl.h"

namespace rebounce {
namespace {

template <typename V, typename Value>
constexpr BasisKernels<Value> make_basis_kernels() {
  return {project<V, Value>, expand<V, Value>};
}

template <typename V, typename N>
constexpr BlockKernels make_block_kernels() {
  return {make_basis_kernels<V, float>(),
          make_basis_kernels<V, std::uint16_t>(),
          {project_integers<N>, expand_integers<N>},
          {multiply_couplings<V, float>, multiply_dense<V, float>, add_products<V>,
           add_dense<V, float>},
          {multiply_couplings<V, std::uint16_t>, multiply_dense<V, std::uint16_t>, add_products<V>,
           add_dense<V, std::uint16_t>},
          measure_light<N>};
}

}  // namespace
}  // namespace rebounce
