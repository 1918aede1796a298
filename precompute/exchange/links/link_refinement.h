#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/exchange/links/link_rays.h"
#include "precompute/exchange/links/link_tree.h"
#include "precompute/exchange/links/pair_kernel.h"
#include "precompute/exchange/pairs/form_factor_settings.h"
#include "precompute/exchange/pairs/shadow_rays.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// The exchange of two nodes of a LinkTree, for all pairs of their patches at once: between a point
/// x of a and a point y of b the kernel is taken as
///   (exchange_area + gradient_a . (x - center_a) + gradient_b . (y - center_b)) / (area_a area_b).
struct Link {
  std::uint32_t a, b;
  float exchange_area;        ///< m²
  float unoccluded_area;      ///< m²: what it would be with nothing between; the most it can be
  float visibility_variance;  ///< of exchange_area / unoccluded_area
  Float3 gradient_a, gradient_b;  ///< m
};

/// Hierarchical refinement (P. Hanrahan, D. Salzman, L. Aupperle, "A rapid hierarchical radiosity
/// algorithm", SIGGRAPH 1991): a pair of nodes is linked where what it is taken for is near enough
/// to what it is, and otherwise the node that is larger as seen from the other is split.
///
/// What differs. The kernel is taken as affine over either node and not as constant, so that
/// fewer links do. Its error is that of all its entries in the sense of Frobenius,
///   sqrt(area_a area_b variance of (kernel x visibility) about what it is taken for),
/// found from the kernel between the nodes' cells; what cannot be told from cells, that patches in
/// one cell face different ways, counts as error. Rays between stratified points find the
/// visibility; a pair gets the more rays the more it exchanges, so that what they may have missed
/// is below link_epsilon too, and pairs of which nothing is seen end there. Parts of a pair whose
/// rays disagree get all rays: few would mostly miss what little is seen through a door. Pairs of
/// patches have the kernel and the rays that they have when all pairs are looked at.
///
/// Pairs are refined in generations, each shared out among OpenMP threads; the bits do not depend
/// on how many there are. Throws Cancelled when a `progress` says so.
class LinkRefinement {
 public:
  /// Refers to all but the settings' values, which must outlive it.
  LinkRefinement(const LinkTree& tree, const ShadowRays& shadow_rays, const RayTracer& tracer,
                 const FormFactorSettings& settings);

  /// Refines from the root.
  void run(const Progress& progress);

  /// Looks again at every link of a patch that is `doubtful` [n]: with all rays, and where these
  /// disagree from that patch alone instead of from a node that it is in.
  void revise(const std::vector<bool>& doubtful, const Progress& progress);

  /// Every pair of patches that can exchange light is in one link or in none. Links whose
  /// exchange area is 0 are pairs that are hidden from each other.
  std::span<const Link> links() const { return links_; }
  std::uint64_t candidate_count() const { return candidate_count_; }  ///< pairs of nodes looked at
  std::uint64_t ray_count() const { return ray_count_; }

 private:
  /// What the last rays between ancestors of a pair found.
  enum class View : std::uint8_t { kUnknown, kClear, kMixed };
  struct Candidate {
    std::uint32_t a, b;
    View view;
  };
  struct Outcome {
    enum class Kind : std::uint8_t { kNothing, kLink, kSplitA, kSplitB };
    Kind kind = Kind::kNothing;
    View view = View::kUnknown;  ///< of what is split
    Link link;
  };
  struct Scratch;

  void refine(std::vector<Candidate> generation, const Progress& progress);
  void decide(const std::vector<Candidate>& generation, std::vector<Outcome>& outcomes,
              const Progress& progress);
  Outcome decide(const Candidate& pair, Scratch& scratch) const;
  Outcome link_patches(const Candidate& pair, Scratch& scratch) const;
  Outcome link_nodes(const Candidate& pair, Scratch& scratch) const;
  Outcome link_mixed(const Candidate& pair, const PairKernel& kernel,
                     const LinkRays::Visibility& visible) const;
  Outcome make_link(const Candidate& pair, const PairKernel& kernel,
                    const LinkRays::Visibility& visible) const;
  Outcome split(const Candidate& pair, View view) const;
  double allowed_squared(const LinkNode& a, const LinkNode& b) const;
  std::vector<Candidate> take(const std::vector<Candidate>& generation,
                              const std::vector<Outcome>& outcomes);
  void append_children(const Candidate& pair, const Outcome& outcome,
                       std::vector<Candidate>& next) const;
  bool needs_all_rays(const Candidate& pair) const;
  bool is_doubtful(std::uint32_t node) const { return !doubtful_.empty() && doubtful_[node] != 0; }

  const LinkTree& tree_;
  const ShadowRays& shadow_rays_;
  const FormFactorSettings settings_;
  const LinkRays rays_;
  std::vector<Link> links_;
  std::vector<std::uint8_t> doubtful_;  ///< [nodes] holds a doubtful patch; empty: none does
  double done_ = 0;                     ///< of all pairs of points, the part that is settled
  std::uint64_t candidate_count_ = 0, ray_count_ = 0;
};

}  // namespace rebounce
