#include "precompute/exchange/links/link_refinement.h"

#include <omp.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include "precompute/base/parallel_loop.h"
#include "precompute/base/ranks.h"
#include "rebounce/error.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

// The points of a plane are off it by less than this fraction of its size.
constexpr double kPlane = 1e-7;

// Links have indices of 32 bits.
constexpr std::size_t kMostLinks = std::numeric_limits<std::uint32_t>::max();

// Pairs of a generation that one rank decides before the next rank's turn.
constexpr std::size_t kPairsInTurn = 64;

// Pairs whose outcomes are held at a time.
constexpr std::size_t kPairsAtOnce = 1 << 16;

// To know how much is to be done, one pair for so many nodes is examined of each generation.
constexpr std::size_t kNodesPerSample = 32;

// A pair that faces in part may get a link if all of it is below this fraction of the allowed
// error.
constexpr double kNegligible = 0.1;

BFloat16x3 stored(const glm::dvec3& gradient) {
  const Float3 g = to_float3(gradient);
  return to_bfloat16(g[0], g[1], g[2]);
}

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
      rays_(tree, shadow_rays, tracer, settings.seed) {
  if (tree.nodes().size() > Link::kMostNodes) throw Error("links: too many patches");
}

/// Takes out the links for which `again`(link) is true, as candidates.
template <typename Again>
std::vector<LinkRefinement::Candidate> LinkRefinement::take(const Again& again) {
  std::vector<Candidate> taken;
  std::erase_if(links_, [&](const Link& link) {
    if (!again(link)) return false;
    taken.push_back({link.a(), link.b(), link.view()});
    return true;
  });
  return taken;
}

void LinkRefinement::refine(double epsilon, const Progress& progress) {
  const bool first = epsilon_ == 0;
  epsilon_ = epsilon;
  std::erase_if(links_, [](const Link& link) { return link.is_added(); });
  if (first) return refine(std::vector<Candidate>{{0, 0, View::kUnknown}}, progress);
  std::vector<Candidate> again =
      take([&](const Link& link) { return link.of_nodes().least_epsilon >= epsilon; });
  again.insert(again.end(), empty_.begin(), empty_.end());
  empty_.clear();
  refine(std::move(again), progress);
}

/// [nodes] nonzero for nodes that hold one of the `patches` [n].
std::vector<std::uint8_t> LinkRefinement::nodes_with(const std::vector<bool>& patches) const {
  const auto nodes = tree_.nodes();
  std::vector<std::uint8_t> with(nodes.size());
  for (std::size_t k = nodes.size(); k-- > 0;) {
    const LinkNode& node = nodes[k];
    with[k] = node.is_leaf() ? patches[tree_.leaf_patch(node)]
                             : with[node.first_child] | with[node.first_child + 1];
  }
  return with;
}

void LinkRefinement::revise(const std::vector<bool>& doubtful, const Progress& progress) {
  std::vector<std::uint8_t> with = nodes_with(doubtful);
  std::vector<bool> is_new = doubtful;
  for (std::uint32_t k = 0; k < doubtful_.size(); ++k) {
    const LinkNode& node = tree_[k];
    if (node.is_leaf() && doubtful_[k] != 0) is_new[tree_.leaf_patch(node)] = false;
  }
  const std::vector<std::uint8_t> with_new = nodes_with(is_new);
  doubtful_.resize(with.size(), 0);
  for (std::size_t k = 0; k < with.size(); ++k) doubtful_[k] |= with[k];
  refine(take([&](const Link& link) {
           return !link.joins_patches() && (with_new[link.a()] != 0 || with_new[link.b()] != 0);
         }),
         progress);
}

double LinkRefinement::forecast(double epsilon, std::size_t sample, const Progress& progress) {
  const double kept_epsilon = std::exchange(epsilon_, epsilon);
  const double links = forecast({{0, 0, View::kUnknown}}, sample, progress).links;
  epsilon_ = kept_epsilon;
  return links;
}

LinkRefinement::Forecast LinkRefinement::forecast(std::vector<Candidate> generation,
                                                  std::size_t sample, const Progress& progress) {
  const std::uint64_t pairs = candidate_count_, rays = ray_count_;
  Forecast found;
  double weight = 1;
  std::vector<Outcome> outcomes;
  while (!generation.empty()) {
    if (generation.size() > sample) {
      const double step = static_cast<double>(generation.size()) / static_cast<double>(sample);
      for (std::size_t k = 0; k < sample; ++k) {
        generation[k] = generation[static_cast<std::size_t>((static_cast<double>(k) + 0.5) * step)];
      }
      generation.resize(sample);
      weight *= step;
    }
    outcomes.assign(generation.size(), {});
    const std::uint64_t before = work();
    decide(generation, outcomes, progress, 0);
    found.work += weight * static_cast<double>(work() - before);
    std::vector<Candidate> next;
    for (std::size_t k = 0; k < generation.size(); ++k) {
      const Outcome& outcome = outcomes[k];
      if (outcome.kind == Outcome::Kind::kLink) {
        const Link& link = outcome.link;
        if (link.joins_patches() || link.exchange_area > 0) found.links += weight;
      } else if (outcome.kind != Outcome::Kind::kNothing) {
        append_children(generation[k], outcome, next);
      }
    }
    generation = std::move(next);
  }
  candidate_count_ = pairs;
  ray_count_ = rays;
  return found;
}

void LinkRefinement::add(std::span<const std::pair<std::uint32_t, std::uint32_t>> leaves) {
  std::vector<Candidate> candidates;
  for (const auto& [a, b] : leaves) candidates.push_back({a, b, View::kUnknown});
  const std::size_t known = links_.size();
  refine(std::move(candidates), {});
  for (Link& link : links().subspan(known)) link.set_added();
}

void LinkRefinement::refine(std::vector<Candidate> generation, const Progress& progress) {
  const std::size_t sample = std::max<std::size_t>(tree_.nodes().size() / kNodesPerSample, 1);
  const double expected = forecast(generation, sample, progress).work;
  const std::uint64_t before = work();
  std::vector<Outcome> outcomes;
  std::vector<std::vector<Link>> made;
  while (!generation.empty()) {
    std::vector<Candidate> next;
    std::vector<Link>& links = made.emplace_back();
    for (std::size_t begin = 0; begin < generation.size(); begin += kPairsAtOnce) {
      const std::span some =
          std::span(generation).subspan(begin, std::min(kPairsAtOnce, generation.size() - begin));
      outcomes.assign(some.size(), {});
      decide(some, outcomes, progress, static_cast<double>(work() - before) / expected);
      merge(some, outcomes, links, next);
    }
    generation = std::move(next);
  }
  append(std::move(made));
}

/// Appends the links of all generations, and leaves room for those of a smaller epsilon: memory
/// that nothing is written to takes none.
void LinkRefinement::append(std::vector<std::vector<Link>> made) {
  std::size_t count = links_.size();
  for (const std::vector<Link>& links : made) count += links.size();
  if (count > kMostLinks) throw Error("links: too many; ask for a larger link_epsilon");
  if (count > links_.capacity()) links_.reserve(2 * count);
  for (std::vector<Link>& links : made) {
    links_.insert(links_.end(), links.begin(), links.end());
    links = {};
  }
}

/// Decides what becomes of the pairs, and tells `progress` what fraction of the work was done
/// before.
void LinkRefinement::decide(std::span<const Candidate> generation, std::vector<Outcome>& outcomes,
                            const Progress& progress, double done) {
  const Ranks ranks;
  std::atomic<bool> stop = false;
  std::atomic<std::uint64_t> traced = 0;
  parallel_loop(
      generation.size(), 64,
      [&] {
        return Scratch{PairKernel(tree_, shadow_rays_), {}};
      },
      [&](std::size_t k, Scratch& scratch) {
        if (stop || !ranks.makes(k, kPairsInTurn)) return;
        outcomes[k] = decide(generation[k], scratch);
        if (scratch.ray_count > 0) traced += std::exchange(scratch.ray_count, 0);
        const bool tells = progress && omp_get_thread_num() == 0 && k % 64 == 0;
        if (tells && !progress(std::min(done, 1.0))) stop = true;
      });
  if (stop) throw Cancelled();
  std::uint64_t rays = traced;
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
  Link link(pair.a, pair.b);
  link.unoccluded_area = static_cast<float>(most);
  return {Outcome::Kind::kLink, View::kUnknown, link};
}

bool LinkRefinement::needs_all_rays(const Candidate& pair) const {
  return pair.view == View::kMixed || is_doubtful(pair.a) || is_doubtful(pair.b);
}

LinkRays::Visibility LinkRefinement::trace(const Candidate& pair, int count,
                                           LinkRays::Wanted wanted, Scratch& scratch) const {
  const LinkRays::Visibility visible = rays_.trace(pair.a, pair.b, count, wanted, scratch.rays);
  scratch.ray_count += scratch.rays.rays.size();
  return visible;
}

LinkRefinement::Outcome LinkRefinement::link_nodes(const Candidate& pair, Scratch& scratch) const {
  const PairKernel& kernel = scratch.kernel;
  const double allowed = allowed_squared();
  const double least =
      kernel.faces_in_part()
          ? std::max(kernel.residual_squared(), kernel.norm_squared() / (kNegligible * kNegligible))
          : kernel.residual_squared();
  const bool smooth = least < allowed;
  if (smooth && kernel.unoccluded() == 0) return make_link(pair, kernel, {}, least);
  // If k rays agree, a fraction of about 1 / (k + 2) may not: rule of succession.
  const double enough = std::sqrt(kernel.norm_squared() / allowed) - 2;
  if (!(enough < LinkRays::kMostRays) || (!smooth && pair.view == View::kClear))
    return split(pair, pair.view);
  int count = needs_all_rays(pair) ? settings_.full_rays : settings_.probe_rays;
  while (count < enough) count *= 2;
  count = std::min(count, LinkRays::kMostRays);

  // More rays are traced where this tells that a link would be partly hidden.
  const bool more = count < settings_.full_rays;
  LinkRays::Visibility visible =
      trace(pair, count, smooth && !more ? LinkRays::Wanted::kVisibility : LinkRays::Wanted::kKind,
            scratch);
  const auto for_rays = [&] { return kernel.norm_squared() / ((count + 2.0) * (count + 2.0)); };
  if (!visible.mixed && visible.part == 0) return make_link(pair, kernel, visible, for_rays());
  if (!smooth) return split(pair, visible.mixed ? View::kMixed : View::kClear);
  if (!visible.mixed) return make_link(pair, kernel, visible, std::max(least, for_rays()));
  if (more) {
    count = settings_.full_rays;
    visible = trace(pair, count, LinkRays::Wanted::kVisibility, scratch);
  }
  return link_mixed(pair, kernel, visible, std::max(least, for_rays()));
}

LinkRefinement::Outcome LinkRefinement::link_mixed(const Candidate& pair, const PairKernel& kernel,
                                                   const LinkRays::Visibility& visible,
                                                   double least_squared) const {
  const LinkNode &a = tree_[pair.a], &b = tree_[pair.b];
  if (is_doubtful(pair.a) && !a.is_leaf()) return {Outcome::Kind::kSplitA, View::kMixed, {}};
  if (is_doubtful(pair.b) && !b.is_leaf()) return {Outcome::Kind::kSplitB, View::kMixed, {}};
  const double error_squared = visible.part * visible.part * kernel.residual_squared() +
                               visible.spread * kernel.norm_squared();
  // If some children see each other and others do not, a wall may be between them, and light would
  // leak through it.
  if (visible.divided || !(error_squared < allowed_squared())) {
    return split(pair, View::kMixed);
  }
  return make_link(pair, kernel, visible, std::max(least_squared, error_squared));
}

/// `least_squared`: what the allowed squared error has to be above for this link.
LinkRefinement::Outcome LinkRefinement::make_link(const Candidate& pair, const PairKernel& kernel,
                                                  const LinkRays::Visibility& visible,
                                                  double least_squared) const {
  Link link(pair.a, pair.b, pair.view,
            {.gradient_a = stored(visible.part * kernel.gradient_a()),
             .gradient_b = stored(visible.part * kernel.gradient_b()),
             .least_epsilon = static_cast<float>(std::sqrt(least_squared))});
  link.exchange_area = static_cast<float>(visible.part * kernel.unoccluded());
  link.unoccluded_area = static_cast<float>(kernel.unoccluded());
  return {Outcome::Kind::kLink, View::kUnknown, link};
}

/// Splits the node that looks larger from the other: the distance is the same for both.
LinkRefinement::Outcome LinkRefinement::split(const Candidate& pair, View view) const {
  const LinkNode &a = tree_[pair.a], &b = tree_[pair.b];
  const bool first = b.is_leaf() || (!a.is_leaf() && a.radius >= b.radius);
  return {first ? Outcome::Kind::kSplitA : Outcome::Kind::kSplitB, view, {}};
}

/// Appends the links of `outcomes`, in order, and the parts of pairs that are split.
void LinkRefinement::merge(std::span<const Candidate> generation,
                           const std::vector<Outcome>& outcomes, std::vector<Link>& links,
                           std::vector<Candidate>& next) {
  for (std::size_t k = 0; k < generation.size(); ++k) {
    const Candidate& pair = generation[k];
    const Outcome& outcome = outcomes[k];
    if (outcome.kind == Outcome::Kind::kSplitA || outcome.kind == Outcome::Kind::kSplitB) {
      append_children(pair, outcome, next);
    } else if (outcome.kind == Outcome::Kind::kLink && outcome.link.unoccluded_area > 0) {
      links.push_back(outcome.link);
    } else if (outcome.kind == Outcome::Kind::kLink) {
      empty_.push_back(pair);
    }
  }
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
