#include "transfer/exchange/linked_form_factors.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <string>
#include <type_traits>

#include "rebounce/error.h"
#include "transfer/base/argument_check.h"
#include "transfer/kernels/kernels.h"
#include "transfer/kernels/link_gather.h"

namespace rebounce {
namespace {

[[noreturn]] void refuse(const std::string& reason) {
  throw Error("links: " + reason + "; make them again");
}

// Nodes per task of pull and push, and of gathering.
constexpr std::size_t kNodesPerTask = 2048, kGatheredPerTask = 128;

// Lists of links, of which a node has one for each kind of gradients, per task of sorting.
constexpr std::size_t kSortedPerTask = 512;

/// to += factor * from, lane by lane.
template <typename Lanes>
void add_scaled(Lanes& to, float factor, const Lanes& from) {
  for (std::size_t lane = 0; lane < to.size(); ++lane) to[lane] += factor * from[lane];
}

/// The fastest function that gathers `Columns` along links on this processor.
template <typename Columns>
GatherAlongLinks<Columns> fastest_gather() {
  if constexpr (std::is_same_v<Columns, ManyFloats>) {
    return kernels().link.gather_floats;
  } else if constexpr (std::is_same_v<Columns, ManyDoubles>) {
    return kernels().link.gather_doubles;
  } else {
    return gather_along_links<Columns>;
  }
}

/// The links in the arrays of `links`, which must outlive what is returned.
GiveLinks each_of(const FormFactorLinks& links) {
  return [&links](const std::function<void(const NodeLink&)>& take) {
    for (std::size_t k = 0; k < links.pair.size(); ++k) {
      const auto& g = links.gradient[k];
      take({links.pair[k][0], links.pair[k][1], links.exchange_area[k],
            to_bfloat16(g[0], g[1], g[2]), to_bfloat16(g[3], g[4], g[5])});
    }
  };
}

/// Calls `visit`(node, link) for each link and each of its nodes.
template <typename Visit>
void for_each_incoming(const GiveLinks& give, const Visit& visit) {
  give([&](const NodeLink& link) {
    visit(link.a, IncomingLink{link.gradient_b, link.gradient_a, link.b, link.exchange_area});
    if (link.a == link.b) return;
    visit(link.b, IncomingLink{link.gradient_a, link.gradient_b, link.a, link.exchange_area});
  });
}

/// Sorts lists of links, one after the other, each of which has an `end`, by the first position of
/// where they lead.
template <typename Link>
void sort_lists(std::span<const std::uint64_t> end, std::span<const std::uint32_t> first_position,
                std::vector<Link>& links) {
  const auto at = [&](std::uint64_t k) { return links.begin() + static_cast<std::ptrdiff_t>(k); };
  parallel_for_pieces({}, end.size() - 1, kSortedPerTask, [&](std::size_t k) {
    std::ranges::sort(at(k == 0 ? 0 : end[k - 1]), at(end[k]), {},
                      [&](const Link& link) { return first_position[link.from]; });
  });
}

/// Checks that the nodes are in order of levels, that siblings are neighbours, and that the
/// children of a node together have as many patches as the node.
void check_tree(const LinkedNodes& nodes, std::size_t n) {
  const std::size_t m = nodes.first_child.size();
  if (n == 0 || m != 2 * n - 1 || nodes.count.size() != m || nodes.count[0] != n) {
    refuse("the nodes are not a binary tree over the patches");
  }
  std::size_t next = 1;
  for (std::size_t k = 0; k < m; ++k) {
    const std::uint32_t child = nodes.first_child[k];
    if (child == kNone) {
      if (nodes.count[k] != 1) refuse("a leaf is not one patch");
      continue;
    }
    if (child != next || child <= k || next + 2 > m) refuse("the nodes are not in order of levels");
    const std::uint64_t both =
        static_cast<std::uint64_t>(nodes.count[child]) + nodes.count[child + 1];
    if (both != nodes.count[k]) refuse("children are not as large as their parent");
    next += 2;
  }
  if (next != m) refuse("a node has no parent");
}

void check_permutation(const LinkedNodes& nodes, std::size_t n) {
  std::vector<bool> there(n, false);
  for (const std::uint32_t patch : nodes.patch) {
    if (patch >= n || there[patch]) refuse("a patch is not in exactly one leaf");
    there[patch] = true;
  }
}

void check_nodes(const LinkedNodes& nodes, std::size_t patch_count) {
  if (nodes.patch.size() != patch_count || nodes.scale.size() != patch_count) {
    refuse("they are for another number of patches");
  }
  check_tree(nodes, patch_count);
  check_permutation(nodes, patch_count);
  for (const float s : nodes.scale) {
    if (!(s >= 0) || !std::isfinite(s)) refuse("a scale is not finite and >= 0");
  }
}

void check_values(const FormFactorLinks& links) {
  const auto is_finite = [](float x) { return std::isfinite(x); };
  const std::size_t m = links.first_child.size();
  for (const auto& [a, b] : links.pair) {
    if (a >= m || b >= m) refuse("a link joins a node that does not exist");
  }
  for (const float s : links.exchange_area) {
    if (!(s >= 0) || !is_finite(s)) refuse("an exchange area is not finite and >= 0");
  }
  for (const auto& g : links.gradient) {
    if (!std::ranges::all_of(g, is_finite)) refuse("a gradient is not finite");
  }
}

/// The links, once they are checked.
const FormFactorLinks& checked(const FormFactorLinks& links, std::size_t patch_count) {
  check_links(links, patch_count);
  return links;
}

}  // namespace

void check_links(const FormFactorLinks& links, std::size_t patch_count) {
  const std::size_t l = links.pair.size();
  check_nodes(links, patch_count);
  if (links.exchange_area.size() != l || links.gradient.size() != l) {
    refuse("their arrays differ in size");
  }
  check_values(links);
}

std::vector<std::uint32_t> first_positions(const LinkedNodes& nodes) {
  std::vector<std::uint32_t> begin(nodes.first_child.size(), 0);
  for (std::size_t k = 0; k < begin.size(); ++k) {
    const std::uint32_t child = nodes.first_child[k];
    if (child == kNone) continue;
    begin[child] = begin[k];
    begin[child + 1] = begin[k] + nodes.count[child];
  }
  return begin;
}

/// The nodes and their links, in the order in which a gather visits them.
class LinkedFormFactors::Tree {
 public:
  Tree(LinkedNodes nodes, const GiveLinks& give, std::span<const float> area,
       std::span<const Float3> centroid);

  const LinkedNodes& nodes() const { return nodes_; }
  std::span<const std::uint32_t> first_positions() const { return first_position_; }
  std::size_t patch_count() const { return nodes_.patch.size(); }
  std::size_t node_count() const { return node_.size(); }
  std::size_t link_count() const { return link_count_; }
  std::size_t bytes() const;
  std::span<const PlainLink> plain_links(std::size_t node) const {
    return std::span(plain_).subspan(plain_begin_[node],
                                     plain_begin_[node + 1] - plain_begin_[node]);
  }
  std::span<const IncomingLink> affine_links(std::size_t node) const {
    return std::span(affine_).subspan(affine_begin_[node],
                                      affine_begin_[node + 1] - affine_begin_[node]);
  }

  /// Pulls, gathers and pushes; `light` and `arrived` are workspace [m].
  template <typename Columns, typename Lanes>
  void gather(std::span<const Columns> in, std::span<Columns> out, LinkLightOf<Lanes>* light,
              LinkLightOf<Lanes>* arrived, GatherAlongLinks<Lanes> gather_node,
              const Scheduler& scheduler) const;

 private:
  struct Node {
    float area = 0;
    float part = 1;        ///< fraction of the parent's area
    Float3 from_parent{};  ///< centre minus the parent's centre, metres
  };

  bool is_leaf(std::size_t node) const { return nodes_.first_child[node] == kNone; }
  std::uint32_t leaf_patch(std::size_t node) const { return nodes_.patch[first_position_[node]]; }

  void build_tree(std::span<const float> area, std::span<const Float3> centroid);
  void place_children(std::span<const std::array<double, 4>> sum);
  void find_levels();
  void sort_links(const GiveLinks& give);

  template <typename Columns, typename Lanes>
  void pull(std::span<const Columns> in, const NodeLights<Lanes>& light,
            const Scheduler& scheduler) const;
  template <typename Lanes, typename Columns>
  void push(LinkLightOf<Lanes>* arrived, std::span<Columns> out, const Scheduler& scheduler) const;

  LinkedNodes nodes_;
  std::vector<std::uint32_t> first_position_;  ///< [m]
  std::vector<Node> node_;                     ///< level by level
  std::vector<std::uint32_t> level_begin_;  ///< first node of each level, then the number of nodes
  // Every link twice, sorted by the node that gathers.
  std::vector<std::uint64_t> plain_begin_, affine_begin_;  ///< [m + 1]
  std::vector<PlainLink> plain_;
  std::vector<IncomingLink> affine_;
  std::size_t link_count_ = 0;
};

LinkedFormFactors::Tree::Tree(LinkedNodes nodes, const GiveLinks& give, std::span<const float> area,
                              std::span<const Float3> centroid)
    : nodes_(std::move(nodes)) {
  check_nodes(nodes_, area.size());
  if (centroid.size() != area.size()) refuse("centroids and areas differ in number");
  first_position_ = rebounce::first_positions(nodes_);
  build_tree(area, centroid);
  sort_links(give);
}

/// Sets areas and centres of the nodes, and their levels.
void LinkedFormFactors::Tree::build_tree(std::span<const float> area,
                                         std::span<const Float3> centroid) {
  const std::size_t m = nodes_.first_child.size();
  node_.resize(m);
  std::vector<std::array<double, 4>> sum(m);  // area times centroid; area
  for (std::size_t k = m; k-- > 0;) {
    if (is_leaf(k)) {
      const Float3& c = centroid[leaf_patch(k)];
      const double a = area[leaf_patch(k)];
      sum[k] = {a * c[0], a * c[1], a * c[2], a};
    } else {
      const std::uint32_t child = nodes_.first_child[k];
      for (int axis = 0; axis < 4; ++axis) sum[k][axis] = sum[child][axis] + sum[child + 1][axis];
    }
    node_[k].area = static_cast<float>(sum[k][3]);
  }
  place_children(sum);
  find_levels();
}

/// Sets the children's positions relative to their parent. `sum` [m] has the area times the centre
/// of each node, then the area.
void LinkedFormFactors::Tree::place_children(std::span<const std::array<double, 4>> sum) {
  for (std::size_t k = 0; k < node_.size(); ++k) {
    if (is_leaf(k)) continue;
    const std::uint32_t child = nodes_.first_child[k];
    for (std::uint32_t c = child; c < child + 2; ++c) {
      node_[c].part = static_cast<float>(sum[c][3] / sum[k][3]);
      for (int axis = 0; axis < 3; ++axis) {
        node_[c].from_parent[axis] =
            static_cast<float>(sum[c][axis] / sum[c][3] - sum[k][axis] / sum[k][3]);
      }
    }
  }
}

/// Finds the first node of each level.
void LinkedFormFactors::Tree::find_levels() {
  level_begin_ = {0, 1};
  while (level_begin_.back() < node_.size()) {
    const std::uint32_t begin = level_begin_[level_begin_.size() - 2], end = level_begin_.back();
    std::uint32_t next_end = end;
    for (std::uint32_t k = begin; k < end; ++k) {
      if (!is_leaf(k)) next_end += 2;
    }
    level_begin_.push_back(next_end);
  }
}

/// Places the links by the node that gathers, each link once for each of its two nodes, and those
/// of a node by the gradients that they have: counts them first, so that each has its place. Then
/// sorts the links of a node that have the same gradients by the first position of where they lead.
void LinkedFormFactors::Tree::sort_links(const GiveLinks& give) {
  const std::size_t m = node_.size();
  std::vector<std::uint64_t> plain(m + 1, 0), affine((kGradientKinds - 1) * m + 1, 0);
  const auto place = [&](std::uint32_t node, unsigned gradients) -> std::uint64_t* {
    return gradients == 0 ? &plain[node]
                          : &affine[(kGradientKinds - 1) * std::size_t{node} + gradients - 1];
  };
  for_each_incoming(give, [&](std::uint32_t node, const IncomingLink& link) {
    if (node >= m) refuse("a link joins a node that does not exist");
    ++place(node, gradients_of(link))[1];
    if (node <= link.from) ++link_count_;
  });
  std::partial_sum(plain.begin(), plain.end(), plain.begin());
  std::partial_sum(affine.begin(), affine.end(), affine.begin());
  plain_begin_ = plain;
  for (std::size_t k = 0; k <= m; ++k) affine_begin_.push_back(affine[(kGradientKinds - 1) * k]);
  plain_.resize(plain.back());
  affine_.resize(affine.back());
  for_each_incoming(give, [&](std::uint32_t node, const IncomingLink& link) {
    const unsigned gradients = gradients_of(link);
    const std::uint64_t next = (*place(node, gradients))++;
    if (gradients == 0) {
      plain_[next] = {link.from, link.exchange_area};
    } else {
      affine_[next] = link;
    }
  });
  // Each place has moved to the end of its links.
  sort_lists(plain, first_position_, plain_);
  sort_lists(affine, first_position_, affine_);
}

std::size_t LinkedFormFactors::Tree::bytes() const {
  return plain_.size() * sizeof(PlainLink) + affine_.size() * sizeof(IncomingLink) +
         2 * plain_begin_.size() * sizeof(std::uint64_t) +
         node_.size() * (sizeof(Node) + 3 * sizeof(std::uint32_t)) +
         patch_count() * (sizeof(std::uint32_t) + sizeof(float));
}

template <typename Columns, typename Lanes>
void LinkedFormFactors::Tree::gather(std::span<const Columns> in, std::span<Columns> out,
                                     LinkLightOf<Lanes>* light, LinkLightOf<Lanes>* arrived,
                                     GatherAlongLinks<Lanes> gather_node,
                                     const Scheduler& scheduler) const {
  assert(in.size() == patch_count() && out.size() == patch_count());
  const NodeLights<Lanes> sent(light, node_.size());
  pull(in, sent, scheduler);
  parallel_for_pieces(scheduler, node_.size(), kGatheredPerTask, [&](std::size_t k) {
    const auto plain = plain_links(k);
    const auto affine = affine_links(k);
    arrived[k] = gather_node({plain.data(), plain.size(), affine.data(), affine.size()}, sent);
  });
  push(arrived, out, scheduler);
}

template <typename Columns, typename Lanes>
void LinkedFormFactors::Tree::pull(std::span<const Columns> in, const NodeLights<Lanes>& light,
                                   const Scheduler& scheduler) const {
  for (std::size_t level = level_begin_.size() - 1; level-- > 0;) {
    const std::uint32_t begin = level_begin_[level], count = level_begin_[level + 1] - begin;
    parallel_for_pieces(scheduler, count, kNodesPerTask, [&](std::size_t of_level) {
      const std::size_t k = begin + of_level;
      LinkLightOf<Lanes> sum{};
      if (is_leaf(k)) {
        const std::uint32_t patch = leaf_patch(k);
        const Columns& x = in[patch];
        for (std::size_t c = 0; c < x.size(); ++c) sum.mean[c] = nodes_.scale[patch] * x[c];
      } else {
        const std::uint32_t first = nodes_.first_child[k];
        for (std::uint32_t c = first; c < first + 2; ++c) {
          const Node& child = node_[c];
          const Lanes& mean = light.mean_of(c);
          add_scaled(sum.mean, child.part, mean);
          for (int axis = 0; axis < 3; ++axis) {
            add_scaled(sum.first[axis], child.part, light.first_of(c)[axis]);
            add_scaled(sum.first[axis], child.part * child.from_parent[axis], mean);
          }
        }
      }
      light.mean_of(k) = sum.mean;
      light.first_of(k) = sum.first;
    });
  }
}

template <typename Lanes, typename Columns>
void LinkedFormFactors::Tree::push(LinkLightOf<Lanes>* arrived, std::span<Columns> out,
                                   const Scheduler& scheduler) const {
  for (std::size_t level = 0; level + 1 < level_begin_.size(); ++level) {
    const std::uint32_t begin = level_begin_[level], count = level_begin_[level + 1] - begin;
    parallel_for_pieces(scheduler, count, kNodesPerTask, [&](std::size_t of_level) {
      const std::size_t k = begin + of_level;
      const LinkLightOf<Lanes>& here = arrived[k];
      if (is_leaf(k)) {
        const std::uint32_t patch = leaf_patch(k);
        const typename Lanes::value_type scale = nodes_.scale[patch],
                                         factor = scale / node_[k].area;
        Columns& y = out[patch];
        for (std::size_t c = 0; c < y.size(); ++c) y[c] = factor * here.mean[c];
        return;
      }
      const std::uint32_t first = nodes_.first_child[k];
      for (std::uint32_t c = first; c < first + 2; ++c) {
        const Node& child = node_[c];
        add_scaled(arrived[c].mean, child.part, here.mean);
        for (int axis = 0; axis < 3; ++axis) {
          add_scaled(arrived[c].mean, child.part * child.from_parent[axis], here.first[axis]);
          add_scaled(arrived[c].first[axis], child.part, here.first[axis]);
        }
      }
    });
  }
}

LinkedFormFactors::LinkedFormFactors(const FormFactorLinks& links, std::span<const float> area,
                                     std::span<const Float3> centroid)
    : LinkedFormFactors(LinkedNodes(checked(links, area.size())), each_of(links), area, centroid) {}

LinkedFormFactors::LinkedFormFactors(LinkedNodes nodes, const GiveLinks& give,
                                     std::span<const float> area, std::span<const Float3> centroid)
    : tree_(std::make_shared<const Tree>(std::move(nodes), give, area, centroid)) {}

std::size_t LinkedFormFactors::patch_count() const {
  return tree_->patch_count();
}

std::size_t LinkedFormFactors::node_count() const {
  return tree_->node_count();
}

std::size_t LinkedFormFactors::link_count() const {
  return tree_->link_count();
}

std::size_t LinkedFormFactors::bytes() const {
  return tree_->bytes();
}

const LinkedNodes& LinkedFormFactors::nodes() const {
  return tree_->nodes();
}

std::span<const std::uint32_t> LinkedFormFactors::first_positions() const {
  return tree_->first_positions();
}

std::span<const PlainLink> LinkedFormFactors::plain_links(std::uint32_t node) const {
  return tree_->plain_links(node);
}

std::span<const IncomingLink> LinkedFormFactors::affine_links(std::uint32_t node) const {
  return tree_->affine_links(node);
}

std::size_t LinkedFormFactors::workspace_size() const {
  return 2 * node_count() * sizeof(LinkLight) / sizeof(float);
}

void LinkedFormFactors::do_gather(std::span<const Float3> in, std::span<Float3> out,
                                  std::span<float> workspace, const Scheduler& scheduler) const {
  auto* light = reinterpret_cast<LinkLight*>(workspace.data());
  tree_->gather(in, out, light, light + node_count(), kernels().link.gather, scheduler);
}

template <typename Columns>
void LinkedFormFactors::gather(GatheredLights<Columns>& lights) const {
  using NodeLight = LinkLightOf<Columns>;
  check_size("links: light", lights.in.size(), patch_count());
  lights.out.resize(patch_count());
  lights.workspace.resize(2 * node_count() * (sizeof(NodeLight) / sizeof(Columns)));
  auto* light = reinterpret_cast<NodeLight*>(lights.workspace.data());
  tree_->gather(std::span<const Columns>(lights.in), std::span(lights.out), light,
                light + node_count(), fastest_gather<Columns>(), {});
}

template void LinkedFormFactors::gather(GatheredLights<std::array<float, 3>>&) const;
template void LinkedFormFactors::gather(GatheredLights<ManyFloats>&) const;
template void LinkedFormFactors::gather(GatheredLights<std::array<double, 3>>&) const;
template void LinkedFormFactors::gather(GatheredLights<ManyDoubles>&) const;

FormFactorLinks flat_links(const LinkedFormFactors& form_factors) {
  FormFactorLinks links{form_factors.nodes(), {}, {}, {}};
  const std::size_t count = form_factors.link_count();
  links.pair.reserve(count);
  links.exchange_area.reserve(count);
  links.gradient.reserve(count);
  for (std::uint32_t node = 0; node < form_factors.node_count(); ++node) {
    form_factors.for_each_link(node, [&](const IncomingLink& link) {
      if (link.from < node) return;
      const Float3 g = to_floats(link.gradient_to), h = to_floats(link.gradient_from);
      links.pair.push_back({node, link.from});
      links.exchange_area.push_back(link.exchange_area);
      links.gradient.push_back({g[0], g[1], g[2], h[0], h[1], h[2]});
    });
  }
  return links;
}

}  // namespace rebounce
