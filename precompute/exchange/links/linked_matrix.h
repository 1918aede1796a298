#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "precompute/base/symmetric_matrix.h"
#include "transfer/exchange/linked_form_factors.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// G = A^1/2 F A^-1/2 from links between sets of patches: one matrix for all channels. Entries are
/// those that the links stand for; the pairs themselves are not stored. A pair of patches is in one
/// link at most.
class LinkedMatrix final : public SymmetricMatrix {
 public:
  /// The patches must outlive the object; `group`: SymmetricMatrix::group. Throws Error if the
  /// links are not of these patches.
  LinkedMatrix(std::shared_ptr<const LinkedFormFactors> links, const PatchTable& patches,
               std::vector<std::uint8_t> group = {});

  std::span<const float> area() const override { return patches_.area; }
  void entries(std::uint32_t matrix, std::span<const std::uint32_t> rows,
               std::span<const std::uint32_t> columns,
               Eigen::Ref<Eigen::MatrixXf> entries) const override;
  bool is_zero(std::span<const std::uint32_t> rows,
               std::span<const std::uint32_t> columns) const override;
  Eigen::MatrixXf multiply(std::uint32_t matrix, const Eigen::MatrixXf& x) const override;

 private:
  struct Node {
    std::uint32_t begin = 0, count = 0;  ///< range of positions in the order of the links
    double area = 0;                     ///< m²
    Float3 center{};                     ///< area-weighted, metres
  };
  class LinksBetween;
  class Filler;

  void measure_nodes();

  /// Writes the products with `Columns`::size() columns of `x` from `begin` on, or as many as are
  /// left. `lights` are workspace.
  template <typename Columns>
  void multiply_some(const Eigen::MatrixXf& x, Eigen::Index begin, GatheredLights<Columns>& lights,
                     Eigen::MatrixXf& result) const;

  const PatchTable& patches_;
  std::shared_ptr<const LinkedFormFactors> links_;
  std::vector<std::uint32_t> position_;  ///< [n] position of each patch
  std::vector<Node> nodes_;              ///< [m]
};

}  // namespace rebounce
