#pragma once

#include <cstddef>
#include <vector>

namespace rebounce::bench {

/// The ceiling for the dense algebra: one large dgemm per thread at the same time, each on one BLAS
/// thread and on matrices of its own.
class BlasPeak {
 public:
  /// Makes the matrices for as many threads as OpenMP uses now.
  BlasPeak();

  void run();

  /// Of one run: 2 per multiply-add.
  double flops() const;

 private:
  static constexpr std::size_t kSize = 2048;

  struct Operands {
    std::vector<double> a, b, c;  ///< [kSize][kSize]
  };
  std::vector<Operands> operands_;  ///< one per thread
};

}  // namespace rebounce::bench
