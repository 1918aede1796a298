#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "precompute/base/symmetric_matrix.h"
#include "precompute/lights/error_reference.h"
#include "precompute/lights/sparse_light.h"
#include "transfer/operator/transfer_operator.h"

namespace rebounce {

/// The products of a matrix, in its plain form, with `lights` [n each]: for Y, the indirect
/// irradiances in lx of initial exitances. The bits do not depend on the number of threads.
std::vector<std::vector<Float3>> products(const SymmetricMatrix& matrix,
                                          std::span<const std::vector<Float3>> lights);

/// Lights and their products with a matrix that counts as exact: the reference for operators that
/// are compressed from the matrix. Lights are cut to sources, their products to receivers.
class ReferenceLighting {
 public:
  /// `lights` are the vectors that the matrix multiplies, such as initial exitances [n] in lx.
  /// Lights from which nothing arrives anywhere are left out.
  ReferenceLighting(const SymmetricMatrix& matrix, std::vector<std::vector<Float3>> lights);

  std::size_t light_count() const { return lights_.size(); }

  /// Takes over light k of another, of the same matrix.
  void append(const ReferenceLighting& other, std::size_t k);

  const ErrorReference& received() const { return received_; }

  /// The relative area-weighted L2 error of `transfer` under each light (error_reference.h). It has
  /// the roles of the matrix.
  std::vector<double> errors(const TransferOperator& transfer) const;

  /// The lights in the coordinates of the symmetric form, A^1/2 M0 averaged over the channels,
  /// [positions][light count], with patch[k] at position k and zeros beyond. Each is scaled so that
  /// its errors are relative to 1.
  Eigen::MatrixXd normalised_lights(std::span<const std::uint32_t> patch,
                                    std::size_t position_count) const;

  /// Light k alone, in the same way.
  Eigen::VectorXd normalised_light(std::size_t k, std::span<const std::uint32_t> patch,
                                   std::size_t position_count) const;

 private:
  /// Sets the products at patches that are no receivers to 0.
  void keep_received(const PatchRoles& roles);

  void leave_out_dark();

  std::vector<float> area_;
  std::vector<SparseLight> lights_;
  std::vector<std::vector<Float3>> truths_;
  ErrorReference received_;
};

}  // namespace rebounce
