#include "precompute/exchange/links/link_refinement.h"

#include <omp.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "precompute/base/ranks.h"
#include "rebounce/error.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

// The points of a plane are off it by less than this fraction of its size.
constexpr double kPlane = 1e-7;

// Pairs of a generation that one rank decides before the next rank's turn.
constexpr std::size_t kPairsInTurn = 64;

// A pair that faces in part may get a link if all of it is below this fraction of the allowed
// error.
constexpr double kNegligible = 0.1;

bool is_plane(const LinkNode& node) {
  return node.is_flat() && node.highest - node.lowest <= kPlane * node.radius;
}

}  // namespace

struct LinkRefinement::Scratch {
  PairKernel kernel;
  LinkRays::Scratch rays;
  std::uint64_t ray_count = 0;
};

LinkRefinement::LinkRefinement(const LinkTree& tree, const ShadowRays& shadow_rays,
                               const RayTracer& tracer, const FormFactorSettings& settings)
    : tree_(tree),
      shadow_rays_(shadow_rays),
      settings_(settings),
      rays_(tree, shadow_rays, tracer, settings.seed) {}

void LinkRefinement::run(const Progress& progress) {
  links_.clear();
  done_ = 0;
  refine({{0, 0, View::kUnknown}}, progress);
}

std::size_t LinkRefinement::revise(const std::vector<bool>& doubtful, const Progress& progress) {
  const auto nodes = tree_.nodes();
  doubtful_.assign(nodes.size(), 0);
  for (std::size_t k = nodes.size(); k-- > 0;) {
    const LinkNode& node = nodes[k];
    doubtful_[k] = node.is_leaf() ? doubtful[tree_.leaf_patch(node)]
                                  : doubtful_[node.first_child] | doubtful_[node.first_child + 1];
  }
  std::vector<Candidate> again;
  std::erase_if(links_, [&](const Link& link) {
    if (!is_doubtful(link.a) && !is_doubtful(link.b)) return false;
    again.push_back({link.a, link.b, View::kUnknown});
    done_ -= (link.a == link.b ? 1 : 2) * tree_[link.a].area * tree_[link.b].area /
             (tree_[0].area * tree_[0].area);
    return true;
  });
  const std::size_t kept = links_.size();
  refine(std::move(again), progress);
  return kept;
}

void LinkRefinement::refine(std::vector<Candidate> generation, const Progress& progress) {
  std::vector<Outcome> outcomes;
  while (!generation.empty()) {
    outcomes.assign(generation.size(), {});
    decide(generation, outcomes, progress);
    generation = merge(generation, outcomes);
  }
}

void LinkRefinement::decide(const std::vector<Candidate>& generation,
                            std::vector<Outcome>& outcomes, const Progress& progress) {
  const Ranks ranks;
  std::atomic<bool> stop = false;
  std::uint64_t rays = 0;
#pragma omp parallel reduction(+ : rays)
  {
    Scratch scratch{PairKernel(tree_, shadow_rays_), {}};
#pragma omp for schedule(dynamic, 64)
    for (std::size_t k = 0; k < generation.size(); ++k) {
      if (stop || !ranks.makes(k, kPairsInTurn)) continue;
      outcomes[k] = decide(generation[k], scratch);
      const bool tells = progress && omp_get_thread_num() == 0 && k % 64 == 0;
      if (tells && !progress(std::clamp(done_, 0.0, 1.0))) stop = true;
    }
    rays += scratch.ray_count;
  }
  if (stop) throw Cancelled();
  ranks.share(std::span(outcomes), kPairsInTurn);
  ranks.add_up(std::span(&rays, 1));
  ray_count_ += rays;
  candidate_count_ += generation.size();
}

LinkRefinement::Outcome LinkRefinement::decide(const Candidate& pair, Scratch& scratch) const {
  const LinkNode &a = tree_[pair.a], &b = tree_[pair.b];
  if (pair.a == pair.b && !a.is_leaf())
    return is_plane(a) ? Outcome{} : split(pair, View::kUnknown);
  if (pair.a == pair.b && shadow_rays_.geometry().bounds(tree_.leaf_patch(a)).is_flat()) return {};
  if (pair.a != pair.b && cannot_exchange(a, b)) return {};
  if (a.is_leaf() && b.is_leaf()) return link_patches(pair);
  if (!scratch.kernel.estimate(pair.a, pair.b)) return split(pair, pair.view);
  return link_nodes(pair, scratch);
}

LinkRefinement::Outcome LinkRefinement::link_patches(const Candidate& pair) const {
  const std::uint32_t i = tree_.leaf_patch(tree_[pair.a]), j = tree_.leaf_patch(tree_[pair.b]);
  const PatchGeometry& geometry = shadow_rays_.geometry();
  const double most = is_coarse_pair(geometry, i, j)
                          ? std::min(geometry.area(i), geometry.area(j))
                          : shadow_rays_.unoccluded(std::min(i, j), std::max(i, j));
  if (most <= 0) return {};
  return {.kind = Outcome::Kind::kLink,
          .view = View::kUnknown,
          .link = {.a = pair.a,
                   .b = pair.b,
                   .exchange_area = 0,
                   .unoccluded_area = static_cast<float>(most),
                   .gradient_a = {},
                   .gradient_b = {}}};
}

bool LinkRefinement::needs_all_rays(const Candidate& pair) const {
  return pair.view == View::kMixed || is_doubtful(pair.a) || is_doubtful(pair.b);
}

double LinkRefinement::allowed_squared(const LinkNode& a, const LinkNode& b) const {
  const double weight_squared = 0.5 * (a.weight * a.weight + b.weight * b.weight);
  return settings_.link_epsilon * settings_.link_epsilon / weight_squared;
}

LinkRefinement::Outcome LinkRefinement::link_nodes(const Candidate& pair, Scratch& scratch) const {
  const LinkNode &a = tree_[pair.a], &b = tree_[pair.b];
  const double allowed = allowed_squared(a, b);
  const bool smooth = scratch.kernel.residual_squared() < allowed &&
                      !(scratch.kernel.faces_in_part() &&
                        scratch.kernel.norm_squared() > kNegligible * kNegligible * allowed);
  if (smooth && scratch.kernel.unoccluded() == 0) return {};
  // If k rays agree, a fraction of about 1 / (k + 2) may not: rule of succession.
  const double enough = std::sqrt(scratch.kernel.norm_squared() / allowed) - 2;
  if (!(enough < LinkRays::kMostRays) || (!smooth && pair.view == View::kClear))
    return split(pair, pair.view);
  int count = needs_all_rays(pair) ? settings_.full_rays : settings_.probe_rays;
  while (count < enough) count *= 2;
  count = std::min(count, LinkRays::kMostRays);

  LinkRays::Visibility visible = rays_.trace(pair.a, pair.b, count, scratch.rays);
  scratch.ray_count += count;
  if (!visible.mixed && visible.part == 0) return make_link(pair, scratch.kernel, visible);
  if (!smooth) return split(pair, visible.mixed ? View::kMixed : View::kClear);
  if (!visible.mixed) return make_link(pair, scratch.kernel, visible);
  if (count < settings_.full_rays) {
    visible = rays_.trace(pair.a, pair.b, settings_.full_rays, scratch.rays);
    scratch.ray_count += settings_.full_rays;
  }
  return link_mixed(pair, scratch.kernel, visible);
}

LinkRefinement::Outcome LinkRefinement::link_mixed(const Candidate& pair, const PairKernel& kernel,
                                                   const LinkRays::Visibility& visible) const {
  const LinkNode &a = tree_[pair.a], &b = tree_[pair.b];
  if (is_doubtful(pair.a) && !a.is_leaf()) return {Outcome::Kind::kSplitA, View::kMixed, {}};
  if (is_doubtful(pair.b) && !b.is_leaf()) return {Outcome::Kind::kSplitB, View::kMixed, {}};
  const double error_squared = visible.part * visible.part * kernel.residual_squared() +
                               visible.spread * kernel.norm_squared();
  // If some children see each other and others do not, a wall may be between them, and light would
  // leak through it.
  if (visible.divided || !(error_squared < allowed_squared(a, b))) {
    return split(pair, View::kMixed);
  }
  return make_link(pair, kernel, visible);
}

LinkRefinement::Outcome LinkRefinement::make_link(const Candidate& pair, const PairKernel& kernel,
                                                  const LinkRays::Visibility& visible) const {
  return {.kind = Outcome::Kind::kLink,
          .view = View::kUnknown,
          .link = {.a = pair.a,
                   .b = pair.b,
                   .exchange_area = static_cast<float>(visible.part * kernel.unoccluded()),
                   .unoccluded_area = static_cast<float>(kernel.unoccluded()),
                   .gradient_a = to_float3(visible.part * kernel.gradient_a()),
                   .gradient_b = to_float3(visible.part * kernel.gradient_b())}};
}

/// Splits the node that looks larger from the other: the distance is the same for both.
LinkRefinement::Outcome LinkRefinement::split(const Candidate& pair, View view) const {
  const LinkNode &a = tree_[pair.a], &b = tree_[pair.b];
  const bool first = b.is_leaf() || (!a.is_leaf() && a.radius >= b.radius);
  return {first ? Outcome::Kind::kSplitA : Outcome::Kind::kSplitB, view, {}};
}

/// Merges the outcomes in order; pairs that are split make the next generation.
std::vector<LinkRefinement::Candidate> LinkRefinement::merge(
    const std::vector<Candidate>& generation, const std::vector<Outcome>& outcomes) {
  std::vector<Candidate> next;
  const double whole = tree_[0].area * tree_[0].area;
  for (std::size_t k = 0; k < generation.size(); ++k) {
    const Candidate& pair = generation[k];
    const Outcome& outcome = outcomes[k];
    if (outcome.kind == Outcome::Kind::kSplitA || outcome.kind == Outcome::Kind::kSplitB) {
      append_children(pair, outcome, next);
      continue;
    }
    if (outcome.kind == Outcome::Kind::kLink && outcome.link.unoccluded_area > 0) {
      links_.push_back(outcome.link);
    }
    done_ += (pair.a == pair.b ? 1 : 2) * tree_[pair.a].area * tree_[pair.b].area / whole;
  }
  return next;
}

void LinkRefinement::append_children(const Candidate& pair, const Outcome& outcome,
                                     std::vector<Candidate>& next) const {
  const std::uint32_t a = tree_[pair.a].first_child, b = tree_[pair.b].first_child;
  if (pair.a == pair.b) {
    next.push_back({a, a, outcome.view});
    next.push_back({a, a + 1, outcome.view});
    next.push_back({a + 1, a + 1, outcome.view});
    return;
  }
  for (std::uint32_t child = 0; child < 2; ++child) {
    next.push_back(outcome.kind == Outcome::Kind::kSplitA
                       ? Candidate{a + child, pair.b, outcome.view}
                       : Candidate{pair.a, b + child, outcome.view});
  }
}

}  // namespace rebounce
