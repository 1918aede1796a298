#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "precompute/base/symmetric_matrix.h"
#include "transfer/base/grouped.h"
#include "transfer/exchange/linked_form_factors.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// G = A^1/2 F A^-1/2 from links between sets of patches: one matrix for all channels. Entries are
/// those that the links stand for; the pairs themselves are not stored. A pair of patches is in one
/// link at most.
class LinkedMatrix final : public SymmetricMatrix {
 public:
  /// Links and patches must outlive the object. Throws Error if the links are not of these patches.
  LinkedMatrix(const FormFactorLinks& links, const PatchTable& patches);

  /// `product` is a gathering operator of the same links that the caller shares; null where only
  /// entries are asked for.
  LinkedMatrix(const FormFactorLinks& links, std::shared_ptr<const LinkedFormFactors> product,
               const PatchTable& patches);

  std::span<const float> area() const override { return patches_.area; }
  void entries(std::uint32_t matrix, std::span<const std::uint32_t> rows,
               std::span<const std::uint32_t> columns,
               Eigen::Ref<Eigen::MatrixXf> entries) const override;
  Eigen::MatrixXf multiply(std::uint32_t matrix, const Eigen::MatrixXf& x) const override;

 private:
  struct Node {
    std::uint32_t begin = 0, count = 0;  ///< range of positions in the order of the links
    double area = 0;                     ///< m²
    Float3 center{};                     ///< area-weighted, metres
  };
  class Filler;

  void measure_nodes();
  void sort_links();

  /// The node that a link of `node` leads to.
  const Node& other_end(std::uint32_t link, std::uint32_t node) const {
    const auto& [a, b] = links_.pair[link];
    return nodes_[a == node ? b : a];
  }

  /// Writes the products with `Columns`::size() columns of `x` from `begin` on, or as many as are
  /// left.
  template <typename Columns>
  void multiply_some(const Eigen::MatrixXf& x, Eigen::Index begin, Eigen::MatrixXf& result) const;

  const FormFactorLinks& links_;
  const PatchTable& patches_;
  std::shared_ptr<const LinkedFormFactors> product_;
  std::vector<std::uint32_t> position_;   ///< [n] position of each patch
  std::vector<Node> nodes_;               ///< [m]
  Grouped<std::uint64_t> links_of_node_;  ///< of each node, by where they lead
};

}  // namespace rebounce
