#include "precompute/lights/whole_error.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "precompute/base/parallel_loop.h"
#include "precompute/base/parallel_progress.h"
#include "precompute/base/ranks.h"
#include "precompute/exchange/pairs/escape.h"
#include "runtime/rays/sampling.h"
#include "transfer/base/area_norm.h"
#include "transfer/base/light_sum.h"
#include "transfer/base/reflection.h"

namespace rebounce {
namespace {

constexpr std::size_t kGroups = WholeErrorEstimator::kGroups;

// The quantile at 97.5 % of Student's distribution with kGroups - 1 = 3 degrees of freedom.
constexpr double kStudent = 3.182;

// Rays of a group, and of a patch of it (lab/111, lab/133).
constexpr double kRaysOfGroup = 1 << 23, kLeastRays = 512, kMostRays = 4096;

// Pieces that the rays of a group are traced in: what they meet takes the most memory.
constexpr std::size_t kPieces = 8;

// Lights that are gathered together: those of all patches stay in the last cache.
constexpr std::size_t kLightsGathered = 32;

/// Lights whose groups are spread together: a batch of solves for each rank, for up to eight ranks.
std::size_t lights_spread() {
  constexpr std::size_t kMostRanks = 8;
  return std::min(Ranks().count(), kMostRanks) * ReferenceSolver::kBatchLights / kGroups;
}

// Rays take this part of the time of an estimate.
constexpr double kTracingPart = 0.7;

/// An estimate from all groups, and from all but one.
struct Replicates {
  double all = 0;
  std::array<double, kGroups> without{};

  void add(const Replicates& other, double weight) {
    all += weight * other.all;
    for (std::size_t g = 0; g < kGroups; ++g) without[g] += weight * other.without[g];
  }

  double confidence() const {
    double mean = 0, squares = 0;
    for (const double w : without) mean += w / kGroups;
    for (const double w : without) squares += (w - mean) * (w - mean);
    return kStudent * std::sqrt(squares * (kGroups - 1) / kGroups);
  }
};

/// The root of the mean of `product`(g, h) over the ordered pairs of different groups, of all of
/// them and without each.
template <typename Product>
Replicates root_of_pairs(const Product& product) {
  const auto root = [&](std::size_t without) {
    double sum = 0;
    int count = 0;
    for (std::size_t g = 0; g < kGroups; ++g) {
      for (std::size_t h = 0; h < kGroups; ++h) {
        if (g == h || g == without || h == without) continue;
        sum += product(g, h);
        ++count;
      }
    }
    return std::sqrt(std::max(0.0, sum / count));
  };
  Replicates result{.all = root(kGroups)};
  for (std::size_t g = 0; g < kGroups; ++g) result.without[g] = root(g);
  return result;
}

/// The error of each light, relative to `reference`(light). What spreads the error along links
/// instead of F changes it by about the error as a part of itself, which adds its square to the
/// half width of the confidence interval.
template <typename Reference>
SampledError error_over_lights(const std::vector<Replicates>& lights, const Reference& reference) {
  Replicates sum, largest;
  double squares = 0;
  for (std::size_t k = 0; k < lights.size(); ++k) {
    Replicates relative;
    // Nothing is relative to a light that reaches no receiver.
    if (reference(k) > 0) relative.add(lights[k], 1 / reference(k));
    sum.add(relative, 1 / static_cast<double>(lights.size()));
    squares += relative.all * relative.all / static_cast<double>(lights.size());
    if (relative.all > largest.all) largest = relative;
  }
  return {sum.all, std::hypot(sum.confidence(), squares), largest.all,
          std::hypot(largest.confidence(), largest.all * largest.all)};
}

/// `count` of `all` numbers, one in each of as many equal runs.
std::vector<std::uint32_t> spread_choice(std::size_t count, std::size_t all, std::uint64_t bits) {
  const double start = unit_square(bits).x;
  std::vector<std::uint32_t> chosen;
  for (std::size_t k = 0; k < count; ++k) {
    const double place = (static_cast<double>(k) + start) / static_cast<double>(count);
    chosen.push_back(static_cast<std::uint32_t>(place * static_cast<double>(all)));
  }
  return chosen;
}

double area_product(std::span<const Float3> a, std::span<const Float3> b,
                    std::span<const float> area) {
  const auto [red, green, blue] = area_inner_product(a, b, area);
  return red + green + blue;
}

}  // namespace

WholeErrorEstimator::WholeErrorEstimator(const TransferData& data, const PatchRoles& roles,
                                         std::uint64_t seed, const Sample& sample)
    : data_(data), roles_(roles), seed_(mix_bits(seed)), ray_count_(sample.ray_count) {
  const std::size_t n = data.patches.size();
  for (std::size_t g = 0; g < kGroups; ++g) {
    patch_[g] = spread_choice(std::min(n, sample.patch_count), n, mix_bits(seed_ + g));
  }
}

WholeErrorEstimator::Sample WholeErrorEstimator::sample_for(std::size_t patch_count, double part) {
  Sample sample;
  const auto patches = static_cast<double>(std::min(patch_count, sample.patch_count));
  sample.ray_count =
      static_cast<int>(std::clamp(part * kRaysOfGroup / patches, part * kLeastRays, kMostRays));
  return sample;
}

void WholeErrorEstimator::add(std::span<const Float3> initial_exitance,
                              std::span<const Float3> truth, std::span<const Float3> result) {
  const PatchTable& patches = data_.patches;
  std::vector<Float3> received(truth.begin(), truth.end());
  roles_.keep(PatchRoles::kReceiver, received);
  received_.add(area_norm(received, patches.area), area_norm(truth, patches.area));
  std::vector<Float3>& compression = compression_.emplace_back(result.begin(), result.end());
  std::vector<Float3>& radiosity = radiosity_.emplace_back(truth.begin(), truth.end());
  reflect(patches.reflectance, radiosity);
  add_to(radiosity, initial_exitance);
  for (std::size_t i = 0; i < patches.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) compression[i][c] -= received[i][c];
  }
  truth_.emplace_back(truth.begin(), truth.end());
}

/// The patches that the rays of the patches [begin, end) of a group met.
WholeErrorEstimator::MetRows WholeErrorEstimator::trace(std::size_t group, std::size_t begin,
                                                        std::size_t end,
                                                        std::span<const std::uint32_t> shown_patch,
                                                        const RayTracer& tracer,
                                                        const Progress& progress) const {
  const std::size_t n = data_.patches.size(), rows = end - begin;
  const PatchTriangles triangles(data_.mesh.triangle_patch, n);
  const Ranks ranks;
  MetRows met{begin, std::vector<std::vector<MetPatch>>(rows)};
  ParallelProgress loop(progress, rows);
  struct Scratch {
    EscapeScratch escape;
    MetPatchCounter counter;
  };
  parallel_loop(
      rows, 16, [] { return Scratch(); },
      [&](std::size_t k, Scratch& scratch) {
        if (loop.stopped() || !ranks.makes(k)) return;
        const std::uint32_t i = patch_[group][begin + k];
        measure_escape(data_.mesh, shown_patch, triangles[i], i, tracer, ray_count_,
                       mix_bits(seed_ + kGroups + group), scratch.escape);
        met.patch[k] = scratch.counter.count(n, scratch.escape.met);
        loop.advance();
      });
  loop.finish();
  ranks.share(std::span(met.patch));
  return met;
}

/// What `met` says from the other side: for each patch of a group, the patches whose rays met it.
std::vector<std::vector<MetPatch>> WholeErrorEstimator::met_by(
    std::size_t group, const MetRows& met, std::span<const std::uint32_t> row) const {
  std::vector<std::size_t> count(patch_[group].size(), 0);
  const auto for_each = [&](const auto& visit) {
    for (std::size_t k = 0; k < met.patch.size(); ++k) {
      const std::uint32_t i = patch_[group][met.begin + k];
      for (const MetPatch& m : met.patch[k]) {
        if (row[m.patch] != kNone) visit(row[m.patch], MetPatch{i, m.count});
      }
    }
  };
  for_each([&](std::uint32_t of, const MetPatch&) { ++count[of]; });
  std::vector<std::vector<MetPatch>> by(count.size());
  for (std::size_t k = 0; k < by.size(); ++k) by[k].reserve(count[k]);
  for_each([&](std::uint32_t of, const MetPatch& m) { by[of].push_back(m); });
  return by;
}

/// The light of the links with the other sign, [patches of a group][lights].
std::vector<std::vector<Float3>> WholeErrorEstimator::without_gathered(std::size_t group) const {
  std::vector<std::vector<Float3>> residual;
  for (const std::uint32_t i : patch_[group]) {
    std::vector<Float3>& of_patch = residual.emplace_back();
    of_patch.reserve(truth_.size());
    for (const std::vector<Float3>& truth : truth_) {
      const auto& [r, g, b] = truth[i];
      of_patch.push_back({-r, -g, -b});
    }
  }
  return residual;
}

/// Adds F B, as some rays of a group tell, to what `residual_` holds of it. Where both patches of a
/// pair have rays, what either side says counts by the inverse of its variance, as in
/// CountedExchange: the rays of a large patch hardly meet a small one.
void WholeErrorEstimator::add_gathered(std::size_t group, const MetRows& met) {
  const std::vector<float>& area = data_.patches.area;
  const std::size_t n = data_.patches.size();
  std::vector<std::uint32_t> row(n, kNone);
  for (std::uint32_t k = 0; k < patch_[group].size(); ++k) row[patch_[group][k]] = k;
  const std::vector<std::vector<MetPatch>> by = met_by(group, met, row);
  const Ranks ranks;
  std::vector<Float3> by_patch;
  for (std::size_t first = 0; first < radiosity_.size(); first += kLightsGathered) {
    const std::size_t lights = std::min(kLightsGathered, radiosity_.size() - first);
    by_patch.resize(n * lights);
    for (std::size_t l = 0; l < lights; ++l) {
      for (std::size_t i = 0; i < n; ++i) by_patch[i * lights + l] = radiosity_[first + l][i];
    }
#pragma omp parallel for schedule(dynamic, 16)
    for (std::size_t k = 0; k < by.size(); ++k) {
      if (!ranks.makes(k)) continue;
      const std::uint32_t i = patch_[group][k];
      const auto sum = std::span(residual_[group][k]).subspan(first, lights);
      const auto add = [&](const MetPatch& m, float part) {
        add_to(sum, std::span(by_patch).subspan(m.patch * lights, lights),
               part * static_cast<float>(m.count) / static_cast<float>(ray_count_));
      };
      const auto share = [&](std::uint32_t j) { return area[j] / (area[i] + area[j]); };
      if (k >= met.begin && k < met.end()) {
        for (const MetPatch& m : met.patch[k - met.begin]) {
          add(m, row[m.patch] == kNone ? 1 : share(m.patch));
        }
      }
      for (const MetPatch& m : by[k]) add(m, share(m.patch));
    }
  }
}

/// Finds the residuals of all groups: F B, as rays tell, less the light of the links.
void WholeErrorEstimator::gather(std::span<const std::uint32_t> shown_patch,
                                 const RayTracer& tracer, const Progress& progress) {
  constexpr double kAll = kGroups * kPieces;
  const Ranks ranks;
  for (std::size_t group = 0; group < kGroups; ++group) {
    residual_[group] = without_gathered(group);
    const std::size_t rows = patch_[group].size();
    for (std::size_t piece = 0; piece < kPieces; ++piece) {
      const double done = static_cast<double>(group * kPieces + piece);
      const Progress part = part_of(progress, done / kAll, (done + 1) / kAll);
      add_gathered(group, trace(group, piece * rows / kPieces, (piece + 1) * rows / kPieces,
                                shown_patch, tracer, part));
    }
    ranks.share(std::span(residual_[group]));
  }
  radiosity_ = {};
  truth_ = {};
}

/// What a group says of the residual, 0 at patches that are not in it.
std::vector<Float3> WholeErrorEstimator::residual(std::size_t group, std::size_t light) const {
  const std::size_t n = data_.patches.size(), count = patch_[group].size();
  const float weight = static_cast<float>(n) / static_cast<float>(count);
  std::vector<Float3> result(n, Float3{0, 0, 0});
  for (std::size_t k = 0; k < count; ++k) {
    const auto& [r, g, b] = residual_[group][k][light];
    result[patch_[group][k]] = {weight * r, weight * g, weight * b};
  }
  return result;
}

/// What the groups say that the light of the links lacks, P r = r + Y rho r, into `missing_`.
void WholeErrorEstimator::spread(const IrradiancesOf& transfer, std::size_t first,
                                 std::size_t count) {
  std::vector<std::vector<Float3>> reflected;
  missing_.clear();
  for (std::size_t l = first; l < first + count; ++l) {
    for (std::size_t g = 0; g < kGroups; ++g) {
      missing_.push_back(residual(g, l));
      reflect(data_.patches.reflectance, reflected.emplace_back(missing_.back()));
    }
  }
  const auto transferred = transfer(reflected);
  for (std::size_t k = 0; k < missing_.size(); ++k) {
    add_to(missing_[k], transferred[k]);
    roles_.keep(PatchRoles::kReceiver, missing_[k]);
  }
}

/// `place`: of the light among those that were spread together.
WholeErrorEstimator::Products WholeErrorEstimator::products(std::size_t light,
                                                            std::size_t place) const {
  const auto missing = std::span(missing_).subspan(place * kGroups, kGroups);
  const std::vector<float>& area = data_.patches.area;
  const std::vector<Float3>& compression = compression_[light];
  Products result;
  result.of_compression = area_product(compression, compression, area);
  for (std::size_t g = 0; g < kGroups; ++g) {
    result.with_compression[g] = area_product(compression, missing[g], area);
    for (std::size_t h = 0; h < g; ++h) {
      const double both = area_product(missing[g], missing[h], area);
      result.of_groups[g][h] = result.of_groups[h][g] = both;
    }
  }
  return result;
}

WholeError WholeErrorEstimator::estimate(std::span<const std::uint32_t> shown_patch,
                                         const RayTracer& tracer, const IrradiancesOf& transfer,
                                         const Progress& progress) {
  const std::size_t lights = compression_.size(), at_once = lights_spread();
  if (lights == 0) return {};
  const Progress tracing = part_of(progress, 0, kTracingPart);
  gather(shown_patch, tracer, tracing);
  std::vector<Replicates> of_links, of_whole;
  for (std::size_t l = 0; l < lights; ++l) {
    if (l % at_once == 0) {
      report_progress(progress, kTracingPart + (1 - kTracingPart) * l / lights);
      spread(transfer, l, std::min(at_once, lights - l));
    }
    const Products p = products(l, l % at_once);
    of_links.push_back(
        root_of_pairs([&](std::size_t g, std::size_t h) { return p.of_groups[g][h]; }));
    of_whole.push_back(root_of_pairs([&](std::size_t g, std::size_t h) {
      return p.of_compression - p.with_compression[g] - p.with_compression[h] + p.of_groups[g][h];
    }));
  }
  // By the triangle inequality at least so much of a light arrives of which links say too little.
  const auto arrived = [&](std::size_t k) {
    const double along_links = received_.reference(k);
    return std::max(along_links, of_links[k].all - along_links);
  };
  return {error_over_lights(of_links, arrived), error_over_lights(of_whole, arrived),
          static_cast<int>(lights)};
}

}  // namespace rebounce
