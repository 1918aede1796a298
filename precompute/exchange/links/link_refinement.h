#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/exchange/links/link.h"
#include "precompute/exchange/links/link_rays.h"
#include "precompute/exchange/links/link_tree.h"
#include "precompute/exchange/links/pair_kernel.h"
#include "precompute/exchange/pairs/form_factor_settings.h"
#include "precompute/exchange/pairs/shadow_rays.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// Hierarchical refinement (P. Hanrahan, D. Salzman and L. Aupperle, "A rapid hierarchical
/// radiosity algorithm", SIGGRAPH 1991): a pair of nodes gets a link if the approximation is close
/// enough, otherwise the node that looks larger from the other is split.
///
/// There are these differences. The kernel is affine over both nodes instead of constant, so that
/// fewer links are enough. The error of a link is that of all its entries in the Frobenius norm,
///   sqrt(area_a area_b variance of (kernel x visibility) about the approximation),
/// estimated from the kernel between the cells of the nodes. What cells cannot show, patches of one
/// cell that face different ways, counts as error. Rays between stratified points measure the
/// visibility. A pair gets more rays the more light it exchanges, so that the light that rays may
/// miss is below link_epsilon too; pairs without any visible light end there. Parts of a pair whose
/// rays disagree get all rays, because few rays mostly miss the little light that passes a door.
/// Links between two patches are left to be measured (leaf_links.h).
///
/// Links that are near enough for a smaller epsilon too stay as they are when it falls: only the
/// others are examined again.
///
/// Pairs are refined in generations. OpenMP threads share each generation; the bits do not depend
/// on their number. Throws Cancelled if `progress` asks to stop.
class LinkRefinement {
 public:
  /// All arguments but the values of the settings must outlive the object.
  LinkRefinement(const LinkTree& tree, const ShadowRays& shadow_rays, const RayTracer& tracer,
                 const FormFactorSettings& settings);

  /// Refines from the root, and when called again from the links that are there, to an `epsilon`
  /// that is smaller than the last. Drops the links that add() has added.
  void refine(double epsilon, const Progress& progress);

  /// Examines every link of a patch that is `doubtful` [n] for the first time again, with all rays.
  /// Where the rays disagree, the link is split down to that patch, then and later.
  void revise(const std::vector<bool>& doubtful, const Progress& progress);

  /// The number of links that refine() makes, without those between nodes that are hidden from
  /// each other: from `sample` pairs of each generation, spread over it. Changes no links.
  double forecast(double epsilon, std::size_t sample, const Progress& progress);

  /// Adds links between single patches, which must be in no other link that exchanges light.
  void add(std::span<const std::pair<std::uint32_t, std::uint32_t>> leaves);

  /// Every pair of patches that can exchange light is in at most one link. Links with an exchange
  /// area of 0 are pairs that are hidden from each other.
  std::span<const Link> links() const { return links_; }
  std::span<Link> links() { return links_; }
  /// Pairs of nodes that were examined.
  std::uint64_t candidate_count() const { return candidate_count_; }
  std::uint64_t ray_count() const { return ray_count_; }
  std::uint64_t held_bytes() const {
    return links_.size() * sizeof(Link) + empty_.size() * sizeof(Candidate);
  }

 private:
  using View = LinkView;
  struct Candidate {
    std::uint32_t a, b;
    View view;
  };
  struct Outcome {
    enum class Kind : std::uint8_t { kNothing, kLink, kSplitA, kSplitB };
    Kind kind = Kind::kNothing;
    View view = View::kUnknown;  ///< of the node pair that is split
    Link link;
  };
  struct Scratch;
  /// What refinement does, from samples.
  struct Forecast {
    double links = 0, work = 0;
  };

  Forecast forecast(std::vector<Candidate> generation, std::size_t sample,
                    const Progress& progress);
  /// Grows with the time that has been taken.
  std::uint64_t work() const { return candidate_count_ + ray_count_; }
  void refine(std::vector<Candidate> generation, const Progress& progress);
  template <typename Again>
  std::vector<Candidate> take(const Again& again);
  std::vector<std::uint8_t> nodes_with(const std::vector<bool>& patches) const;
  void append(std::vector<std::vector<Link>> made);
  void decide(std::span<const Candidate> generation, std::vector<Outcome>& outcomes,
              const Progress& progress, double done);
  Outcome decide(const Candidate& pair, Scratch& scratch) const;
  Outcome link_patches(const Candidate& pair) const;
  LinkRays::Visibility trace(const Candidate& pair, int count, LinkRays::Wanted wanted,
                             Scratch& scratch) const;
  Outcome link_nodes(const Candidate& pair, Scratch& scratch) const;
  Outcome link_mixed(const Candidate& pair, const PairKernel& kernel,
                     const LinkRays::Visibility& visible, double least_squared) const;
  Outcome make_link(const Candidate& pair, const PairKernel& kernel,
                    const LinkRays::Visibility& visible, double least_squared) const;
  Outcome split(const Candidate& pair, View view) const;
  double allowed_squared() const { return epsilon_ * epsilon_; }
  void merge(std::span<const Candidate> generation, const std::vector<Outcome>& outcomes,
             std::vector<Link>& links, std::vector<Candidate>& next);
  void append_children(const Candidate& pair, const Outcome& outcome,
                       std::vector<Candidate>& next) const;
  bool needs_all_rays(const Candidate& pair) const;
  bool is_doubtful(std::uint32_t node) const { return !doubtful_.empty() && doubtful_[node] != 0; }

  const LinkTree& tree_;
  const ShadowRays& shadow_rays_;
  const FormFactorSettings settings_;
  const LinkRays rays_;
  double epsilon_ = 0;
  std::vector<Link> links_;
  /// Pairs of nodes between which nothing was found to exchange light, for the last epsilon.
  std::vector<Candidate> empty_;
  /// [nodes] nonzero if a node holds a doubtful patch; empty if none does.
  std::vector<std::uint8_t> doubtful_;
  std::uint64_t candidate_count_ = 0, ray_count_ = 0;
};

}  // namespace rebounce
