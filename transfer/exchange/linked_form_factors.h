#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "transfer/base/bfloat16.h"
#include "transfer/base/incoming_link.h"
#include "transfer/exchange/form_factor_operator.h"

namespace rebounce {

/// A binary tree of patches, whose nodes links join.
struct LinkedNodes {
  std::vector<std::uint32_t> patch;        ///< [n] patch at each position
  std::vector<std::uint32_t> first_child;  ///< [m] kNone for a leaf; the second child is the next
  std::vector<std::uint32_t> count;        ///< [m] patches of a node
  /// [n] F(i,j) is that of the links times scale(i) scale(j), which corrects the row sums; 0 for a
  /// patch that exchanges nothing.
  std::vector<float> scale;

  bool empty() const { return patch.empty(); }
};

/// Form factors as links between nodes of a binary tree of patches, in flat arrays, as files have
/// them.
///
/// A link (a, b) stands for all pairs of a patch of a and a patch of b. Between points x of a and y
/// of b it approximates the kernel by
///   (exchange_area + gradient_a . (x - center_a) + gradient_b . (y - center_b)) / (area_a area_b),
/// where the centre of a node is the area-weighted mean of its patches' centroids. A link works in
/// both directions.
struct FormFactorLinks : LinkedNodes {
  std::vector<std::array<std::uint32_t, 2>> pair;  ///< [l] nodes a and b
  std::vector<float> exchange_area;                ///< [l] m²
  std::vector<std::array<float, 6>> gradient;      ///< [l] m: gradient_a, gradient_b
};

/// One of the links of FormFactorLinks, with gradients as LinkedFormFactors stores them.
struct NodeLink {
  std::uint32_t a, b;
  float exchange_area;                ///< m²
  BFloat16x3 gradient_a, gradient_b;  ///< m
};

/// Calls its argument for each link, for the same ones in the same order whenever it is called.
using GiveLinks = std::function<void(const std::function<void(const NodeLink&)>&)>;

/// Throws Error if `links` are not a tree whose leaves are `patch_count` patches, level by level,
/// or if a link does not join two nodes of it.
void check_links(const FormFactorLinks& links, std::size_t patch_count);

/// [m] position of the first patch of each node. The nodes must be valid (check_links).
std::vector<std::uint32_t> first_positions(const LinkedNodes& nodes);

/// Several lights before and after a gather. `Columns` is an array of 3 or 24 floats or doubles:
/// the channels of one or of eight lights. One object for many gathers: in new memory a gather
/// takes half as long again.
template <typename Columns>
struct GatheredLights {
  std::vector<Columns> in, out;    ///< [n]
  std::vector<Columns> workspace;  ///< as large as a gather makes it
};

/// Gathers with links: pulls light up the tree, gathers it at every level along the links, and
/// pushes what arrived down again (P. Hanrahan, D. Salzman, L. Aupperle, "A rapid hierarchical
/// radiosity algorithm", SIGGRAPH 1991). In addition to the paper, each node has first moments of
/// its light. The cost grows with the number of links, not of pairs of patches. Area times F is
/// symmetric.
class LinkedFormFactors final : public FormFactorOperator {
 public:
  /// `area` [n] in m², `centroid` [n] in metres. Throws Error if `links` are not a tree over n
  /// patches with links between its nodes.
  LinkedFormFactors(const FormFactorLinks& links, std::span<const float> area,
                    std::span<const Float3> centroid);

  /// The same with links that are in no arrays: `give` is called in the constructor. Exchange areas
  /// and gradients must be finite.
  LinkedFormFactors(LinkedNodes nodes, const GiveLinks& give, std::span<const float> area,
                    std::span<const Float3> centroid);

  std::size_t patch_count() const override;
  std::size_t node_count() const;
  std::size_t link_count() const;
  std::size_t bytes() const override;
  std::size_t workspace_size() const override;

  const LinkedNodes& nodes() const;
  /// [m] position of the first patch of each node.
  std::span<const std::uint32_t> first_positions() const;

  /// The links of a node without gradients, by the first position of the nodes that they lead to,
  /// and those with gradients, by these (gradients_of) and then likewise.
  std::span<const PlainLink> plain_links(std::uint32_t node) const;
  std::span<const IncomingLink> affine_links(std::uint32_t node) const;

  /// Calls `visit`(link) for each link of a node, as an IncomingLink.
  template <typename Visit>
  void for_each_link(std::uint32_t node, const Visit& visit) const {
    for (const PlainLink& link : plain_links(node)) visit(affine(link));
    for (const IncomingLink& link : affine_links(node)) visit(link);
  }

  using FormFactorOperator::gather;

  /// Gathers lights.in, [n], into lights.out. Sums have the type of the columns. Throws Error if
  /// the light is that of another number of patches.
  template <typename Columns>
  void gather(GatheredLights<Columns>& lights) const;

 private:
  void do_gather(std::span<const Float3> in, std::span<Float3> out, std::span<float> workspace,
                 const Scheduler& scheduler) const override;

  class Tree;
  std::shared_ptr<const Tree> tree_;
};

/// The same form factors in flat arrays. Links are in the order of their first nodes, which come
/// before the second ones; LinkedFormFactors of them has the same bits.
FormFactorLinks flat_links(const LinkedFormFactors& form_factors);

}  // namespace rebounce
