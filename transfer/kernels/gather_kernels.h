#pragma once

#include <cstddef>
#include <cstdint>

#include "transfer/format/form_factor_block.h"

namespace rebounce {

/// Products with one row of F in blocks, for one instruction set. The `count` blocks of the row
/// begin at `values`; block k holds the columns from kFormFactorBlock x position[k] on. Vectors are
/// three planes, `stride` floats apart.
struct GatherKernels {
  /// sum[c] = sum over the columns j of F(j) x_c(j).
  void (*gather)(const FormFactorBlock* values, const std::uint32_t* position, std::size_t count,
                 const float* x, std::size_t stride, float* sum);

  /// sum[c] = sum over the columns j of F(j) x_c(j), and y_c(j) += value[c] F(j): a row of a
  /// symmetric matrix and the column that mirrors it.
  void (*gather_and_spread)(const FormFactorBlock* values, const std::uint32_t* position,
                            std::size_t count, const float* value, const float* x, float* y,
                            std::size_t stride, float* sum);

  /// y_c(j) += value[c] F(j) alone.
  void (*spread)(const FormFactorBlock* values, const std::uint32_t* position, std::size_t count,
                 const float* value, float* y, std::size_t stride);
};

/// AVX-512 uses these too. For each block a gather loads 32 bytes of F and 96 bytes of the vector;
/// at two loads a cycle this is 16 bytes of F a cycle, several times what memory delivers.
extern const GatherKernels kGatherKernelsAvx2;

}  // namespace rebounce
