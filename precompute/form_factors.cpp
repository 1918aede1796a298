#include "rebounce/precompute/form_factors.h"

#include <omp.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "closure.h"
#include "escape.h"
#include "rebounce/runtime/float3_glm.h"
#include "rebounce/runtime/sampling.h"
#include "rebounce/transfer/error.h"

namespace rebounce {
namespace {

constexpr std::uint32_t kPointCount = 64;  // sample points per patch; powers of two only

// A row whose sum is off its target by more than this (and three deviations) is traced again: it is
// partly covered, and probe rays miss what little of it is seen.
constexpr double kRowSumTolerance = 0.005;

// A pair whose rays all agree may still be partly hidden: its variance is not zero but this part
// of the squared exchange.
constexpr double kVarianceFloor = 1e-6;

class FormFactorAssembly {
 public:
  FormFactorAssembly(const PatchModel& model, const RayTracer& tracer,
                     const FormFactorSettings& settings, const Progress& progress)
      : model_(model), tracer_(tracer), settings_(settings), progress_(progress) {
    triangles_.reserve(model.patch_triangle.size());
    for (const std::uint32_t t : model.patch_triangle) {
      const Uint3& v = model.mesh.triangle[t];
      triangles_.emplace_back(to_dvec3(model.mesh.position[v[0]]),
                              to_dvec3(model.mesh.position[v[1]]),
                              to_dvec3(model.mesh.position[v[2]]));
    }
    make_sample_points();
  }

  FormFactors run() {
    const std::size_t n = triangles_.size();
    ExchangeRows rows(n);
    std::vector<Escape> escape(n);
    for_each_patch(0.0, 0.8, [&](std::uint32_t i, Scratch& scratch) {
      compute_row(i, scratch, rows[i]);
      escape[i] = measure_escape(model_, triangles_[i], i, tracer_, settings_.escape_rays,
                                 settings_.seed, scratch.rays, scratch.hits);
    });
    const std::vector<RowTarget> target = row_targets(escape);
    const std::vector<bool> doubtful = find_doubtful_rows(rows, target);
    for_each_patch(0.8, 1.0, [&](std::uint32_t i, Scratch& scratch) {
      refine_row(i, doubtful, scratch, rows[i]);
    });

    FormFactors result;
    result.closure = enforce_closure(rows, areas(), target);
    store_escape(rows, escape, result);
    result.exchange = compress_rows(rows);
    result.ray_count = ray_count_ + n * settings_.escape_rays;
    result.pair_count = pair_count_;
    return result;
  }

 private:
  struct Pair {
    std::uint32_t other;
    double unoccluded;  ///< exchange area in m² with nothing between
  };

  struct Scratch {
    std::vector<Pair> pairs, mixed;
    std::vector<Ray> rays;
    std::vector<Hit> hits;
  };

  void make_sample_points() {
    const std::size_t n = triangles_.size();
    points_.resize(n * kPointCount);
#pragma omp parallel for schedule(static)
    for (std::size_t i = 0; i < n; ++i) {
      const FlatTriangle& t = triangles_[i];
      const glm::dvec2 shift = unit_square(mix_bits(settings_.seed ^ mix_bits(i)));
      for (std::uint32_t k = 0; k < kPointCount; ++k) {
        const glm::dvec2 b = square_to_triangle(r2_point(k, shift));
        const glm::dvec3 p =
            t.vertex[0] + b.x * (t.vertex[1] - t.vertex[0]) + b.y * (t.vertex[2] - t.vertex[0]);
        points_[i * kPointCount + k] = tracer_.offset_point(to_float3(p), to_float3(t.normal));
      }
    }
  }

  /// Runs `work` for every patch on all threads, with progress; throws Cancelled if asked to.
  /// The work is the part from `begin` to `end` of the whole.
  template <typename Work>
  void for_each_patch(double begin, double end, const Work& work) {
    const std::size_t n = triangles_.size();
    std::atomic<bool> stop = false;
    std::atomic<std::size_t> rows_done = 0;
#pragma omp parallel
    {
      Scratch scratch;
#pragma omp for schedule(dynamic, 4)
      for (std::size_t i = 0; i < n; ++i) {
        if (stop) continue;
        work(static_cast<std::uint32_t>(i), scratch);
        const std::size_t done = ++rows_done;
        if (progress_ && omp_get_thread_num() == 0) {
          // Row i has n - i pairs: what is left is a triangle.
          const double left = 1.0 - static_cast<double>(done) / static_cast<double>(n);
          if (!progress_(end - (end - begin) * left * left)) stop = true;
        }
      }
    }
    if (stop) throw Cancelled();
  }

  void compute_row(std::uint32_t i, Scratch& scratch, std::vector<ExchangeEntry>& row) {
    find_pairs(i, scratch.pairs, [](std::uint32_t) { return true; });
    trace(i, scratch.pairs, settings_.probe_rays, scratch.rays);
    scratch.mixed.clear();
    const int probe = settings_.probe_rays;
    for (std::size_t p = 0; p < scratch.pairs.size(); ++p) {
      const Ray* rays = &scratch.rays[p * probe];
      const auto hidden = std::count_if(rays, rays + probe, is_occluded);
      if (hidden == 0) {
        append(row, scratch.pairs[p], 1.0, 0.0);
      } else if (hidden < probe) {
        scratch.mixed.push_back(scratch.pairs[p]);
      }
    }
    append_mixed(i, scratch, row);
    pair_count_ += scratch.pairs.size();
    ray_count_ += scratch.pairs.size() * settings_.probe_rays;
  }

  /// Traces all rays of the pairs of row i that have a doubtful patch, and replaces their entries.
  void refine_row(std::uint32_t i, const std::vector<bool>& doubtful, Scratch& scratch,
                  std::vector<ExchangeEntry>& row) {
    const auto is_doubtful = [&](std::uint32_t j) { return doubtful[i] || doubtful[j]; };
    std::erase_if(row, [&](const ExchangeEntry& entry) { return is_doubtful(entry.column); });
    find_pairs(i, scratch.mixed, is_doubtful);
    append_mixed(i, scratch, row);
  }

  /// Traces all rays of scratch.mixed and adds what gets through to the row.
  void append_mixed(std::uint32_t i, Scratch& scratch, std::vector<ExchangeEntry>& row) {
    trace(i, scratch.mixed, settings_.full_rays, scratch.rays);
    for (std::size_t p = 0; p < scratch.mixed.size(); ++p) {
      const std::span rays(&scratch.rays[p * settings_.full_rays], settings_.full_rays);
      const Visibility visible = visibility(i, scratch.mixed[p].other, rays);
      append(row, scratch.mixed[p], visible.part, visible.variance);
    }
    std::sort(row.begin(), row.end(),
              [](const ExchangeEntry& a, const ExchangeEntry& b) { return a.column < b.column; });
    ray_count_ += scratch.mixed.size() * settings_.full_rays;
  }

  /// The patches j > i that patch i would exchange light with, if `wanted`(j).
  template <typename Wanted>
  void find_pairs(std::uint32_t i, std::vector<Pair>& pairs, const Wanted& wanted) const {
    pairs.clear();
    const FlatTriangle& a = triangles_[i];
    for (std::uint32_t j = i + 1; j < triangles_.size(); ++j) {
      if (!wanted(j)) continue;
      const FlatTriangle& b = triangles_[j];
      const glm::dvec3 d = b.centroid - a.centroid;
      if (glm::dot(a.normal, d) + b.radius <= 0 || a.radius - glm::dot(b.normal, d) <= 0) continue;
      const double exchange = unoccluded_exchange_area(a, b, settings_.kernel_tolerance);
      if (exchange > 0) pairs.push_back({j, exchange});
    }
  }

  /// The points that ray k of the pair (i, j) joins. Both walk the patches' point sets, the second
  /// by steps of 19 from a start of the pair's own, so that every prefix covers all four
  /// dimensions.
  std::pair<const Float3*, const Float3*> ray_ends(std::uint32_t i, std::uint32_t j,
                                                   std::uint32_t k, std::uint64_t hash) const {
    const std::uint32_t a = (k + static_cast<std::uint32_t>(hash)) % kPointCount;
    const std::uint32_t b = (19 * k + static_cast<std::uint32_t>(hash >> 32)) % kPointCount;
    return {&points_[static_cast<std::size_t>(i) * kPointCount + a],
            &points_[static_cast<std::size_t>(j) * kPointCount + b]};
  }

  std::uint64_t pair_hash(std::uint32_t i, std::uint32_t j) const {
    return mix_bits(settings_.seed * 0x9E3779B9ULL + ((static_cast<std::uint64_t>(i) << 32) | j));
  }

  /// Traces `count` rays for each pair of patch i, one pair after the other.
  void trace(std::uint32_t i, const std::vector<Pair>& pairs, int count,
             std::vector<Ray>& rays) const {
    rays.resize(pairs.size() * count);
    Ray* ray = rays.data();
    for (const Pair& pair : pairs) {
      const std::uint64_t hash = pair_hash(i, pair.other);
      for (int k = 0; k < count; ++k, ++ray) {
        const auto [x, y] = ray_ends(i, pair.other, k, hash);
        *ray = Ray{};
        ray->origin = *x;
        ray->t_near = 0;
        ray->direction = {(*y)[0] - (*x)[0], (*y)[1] - (*x)[1], (*y)[2] - (*x)[2]};
        ray->t_far = 1;
      }
    }
    tracer_.occluded(rays);
  }

  struct Visibility {
    double part;
    double variance;
  };

  /// The part of the pair's light that gets through: rays weighted by the kernel between their
  /// ends.
  Visibility visibility(std::uint32_t i, std::uint32_t j, std::span<const Ray> rays) const {
    const std::uint64_t hash = pair_hash(i, j);
    double sum = 0, sum_of_squares = 0, visible = 0, count = 0;
    for (std::size_t k = 0; k < rays.size(); ++k) {
      const auto [x, y] = ray_ends(i, j, static_cast<std::uint32_t>(k), hash);
      const double weight =
          point_kernel(to_dvec3(*x), triangles_[i].normal, to_dvec3(*y), triangles_[j].normal);
      const bool clear = !is_occluded(rays[k]);
      sum += weight;
      sum_of_squares += weight * weight;
      visible += clear ? weight : 0;
      count += clear ? 1 : 0;
    }
    const double part = sum > 0 ? visible / sum : count / static_cast<double>(rays.size());
    // As sure as that many rays of equal weight (Kish's effective sample size).
    const double effective = sum > 0 ? sum * sum / sum_of_squares : 1;
    return {part, part * (1 - part) / effective};
  }

  void append(std::vector<ExchangeEntry>& row, const Pair& pair, double visible,
              double variance) const {
    const double exchange = pair.unoccluded * visible;
    if (static_cast<float>(exchange) <= 0) return;
    row.push_back({pair.other, static_cast<float>(exchange), static_cast<float>(pair.unoccluded),
                   static_cast<float>(variance + kVarianceFloor)});
  }

  std::vector<double> areas() const {
    std::vector<double> area;
    area.reserve(triangles_.size());
    for (const FlatTriangle& t : triangles_) area.push_back(t.area);
    return area;
  }

  std::vector<RowTarget> row_targets(const std::vector<Escape>& escape) const {
    std::vector<RowTarget> target;
    target.reserve(escape.size());
    for (const Escape& e : escape) {
      const double lost = e.sky + e.absorbed;
      // Low-discrepancy rays err about half as much as random ones here.
      target.push_back({1 - lost, 0.5 * std::sqrt(lost * (1 - lost) / settings_.escape_rays)});
    }
    return target;
  }

  std::vector<bool> find_doubtful_rows(const ExchangeRows& rows,
                                       const std::vector<RowTarget>& target) const {
    const std::vector<double> sum = row_sums(rows, areas());
    std::vector<bool> doubtful(rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      doubtful[i] = std::abs(sum[i] - target[i].sum) > kRowSumTolerance + 3 * target[i].deviation;
    }
    return doubtful;
  }

  /// What the rows of F leave of 1 is what escapes; its parts are shared as they were measured.
  void store_escape(const ExchangeRows& rows, const std::vector<Escape>& escape,
                    FormFactors& result) const {
    const std::vector<double> sum = row_sums(rows, areas());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double rest = std::max(0.0, 1 - sum[i]), lost = escape[i].sky + escape[i].absorbed;
      const double sky = lost > 0 ? rest * escape[i].sky / lost : 0;
      result.sky_visibility.push_back(static_cast<float>(sky));
      result.absorbed.push_back(static_cast<float>(std::max(0.0, rest - sky)));
    }
  }

  static ExchangeMatrix compress_rows(const ExchangeRows& rows) {
    std::vector<std::uint64_t> row_begin = {0};
    std::vector<std::uint32_t> column;
    std::vector<float> exchange_area;
    for (const auto& row : rows) {
      for (const ExchangeEntry& entry : row) {
        column.push_back(entry.column);
        exchange_area.push_back(entry.exchange_area);
      }
      row_begin.push_back(column.size());
    }
    return {SharedArray(std::move(row_begin)), SharedArray(std::move(column)),
            SharedArray(std::move(exchange_area))};
  }

  const PatchModel& model_;
  const RayTracer& tracer_;
  const FormFactorSettings& settings_;
  const Progress& progress_;
  std::vector<FlatTriangle> triangles_;  ///< [n]
  std::vector<Float3> points_;           ///< [n][kPointCount], moved off the surface
  std::atomic<std::uint64_t> ray_count_ = 0, pair_count_ = 0;
};

}  // namespace

FormFactors compute_form_factors(const PatchModel& model, const RayTracer& tracer,
                                 const FormFactorSettings& settings, const Progress& progress) {
  const auto in_range = [](int rays) { return rays >= 1 && rays <= static_cast<int>(kPointCount); };
  if (!in_range(settings.probe_rays) || !in_range(settings.full_rays) || settings.escape_rays < 1) {
    throw Error("form factors: rays per pair must be between 1 and 64, escape rays at least 1");
  }
  return FormFactorAssembly(model, tracer, settings, progress).run();
}

}  // namespace rebounce
