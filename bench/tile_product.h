#pragma once

#include <span>
#include <vector>

#include "transfer/kernels/dense_kernels.h"
#include "transfer/operator/dense_operator.h"

namespace rebounce::bench {

/// The product of a dense operator's tiles with one vector, by kernels of one's choice: what
/// apply() would take with another instruction set, without its fixed number of slots and their
/// sum.
class TileProduct {
 public:
  /// `transfer` must outlive the object. Makes room for as many threads as OpenMP uses now.
  TileProduct(const DenseOperator& transfer, const DenseKernels& kernels,
              std::span<const Float3> initial_exitance);

  void run();

  /// The indirect irradiance [n] in lx that the last run amounts to.
  std::vector<Float3> indirect_irradiance() const;

 private:
  template <typename Value>
  void run(const TileKernels<Value>& kernels, const Value* tiles);

  const DenseOperator& transfer_;
  const DenseKernels& kernels_;
  std::size_t side_;            ///< tiles per row
  std::vector<float> x_;        ///< [3][side x kTile]
  std::vector<float> partial_;  ///< [threads][3][side x kTile]
};

}  // namespace rebounce::bench
