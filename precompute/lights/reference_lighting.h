#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "precompute/base/symmetric_matrix.h"
#include "precompute/lights/received_light.h"
#include "transfer/operator/transfer_operator.h"

namespace rebounce {

/// The products of a matrix, in its plain form, with `lights` [n each]: for Y, what arrives in lx
/// of initial exitances. The same bits for any number of threads.
std::vector<std::vector<Float3>> products(const SymmetricMatrix& matrix,
                                          std::span<const std::vector<Float3>> lights);

/// Lights, and what a matrix, taken as exact, makes of them: what operators that are made from it
/// are judged by. Of the lights what its sources give off, and of the truth what arrives at its
/// receivers.
class ReferenceLighting {
 public:
  /// `lights`: what the matrix multiplies, initial exitances [n] in lx. Those from
  /// which nothing arrives anywhere are left out.
  ReferenceLighting(const SymmetricMatrix& matrix, std::span<const std::vector<Float3>> lights);

  std::size_t light_count() const { return lights_.size(); }

  const ReceivedLight& received() const { return received_; }

  /// The relative area-weighted L2 error of `transfer`, which has the roles of the matrix, under
  /// each light (received_light.h).
  std::vector<double> errors(const TransferOperator& transfer) const;

  /// The lights in the coordinates of the symmetric form, A^1/2 M0 averaged over the channels,
  /// [positions][light count], patch[k] at position k and zero beyond; each so strong that its
  /// errors are relative to 1.
  Eigen::MatrixXd normalised_lights(std::span<const std::uint32_t> patch,
                                    std::size_t position_count) const;

 private:
  /// Puts out what arrives at other patches than receivers.
  void keep_received(const PatchRoles& roles);

  void leave_out_dark();

  std::vector<float> area_;
  std::vector<std::vector<Float3>> lights_, truths_;
  ReceivedLight received_;
};

}  // namespace rebounce
