#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "rebounce/transfer/form_factor_blocks.h"

namespace rebounce {

/// Products with one row of F in blocks, for one instruction set. The row's `count` blocks begin at
/// `values`; block k stands for the columns from kFormFactorBlock x position[k] on. Vectors are
/// three planes, `stride` floats apart.
struct GatherKernels {
  const char* instruction_set;

  /// sum[c] = sum over the columns j of F(j) x_c(j).
  void (*gather)(const FormFactorBlock* values, const std::uint32_t* position, std::size_t count,
                 const float* x, std::size_t stride, float* sum);

  /// sum[c] = sum over the columns j of F(j) x_c(j), and y_c(j) += value[c] F(j): a row of a
  /// symmetric matrix and the column that is its mirror image.
  void (*gather_and_spread)(const FormFactorBlock* values, const std::uint32_t* position,
                            std::size_t count, const float* value, const float* x, float* y,
                            std::size_t stride, float* sum);

  /// The second half of that: y_c(j) += value[c] F(j).
  void (*spread)(const FormFactorBlock* values, const std::uint32_t* position, std::size_t count,
                 const float* value, float* y, std::size_t stride);
};

extern const GatherKernels kGatherKernelsPortable;
extern const GatherKernels kGatherKernelsAvx2;

/// The kernels that this processor runs, narrowest first, and the widest of them.
std::span<const GatherKernels* const> gather_kernel_sets();
const GatherKernels& gather_kernels();

}  // namespace rebounce
