#include "rebounce/precompute/form_factors.h"

#include <omp.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "closure.h"
#include "escape.h"
#include "link_expansion.h"
#include "rebounce/transfer/error.h"
#include "refined_links.h"
#include "row_targets.h"
#include "shadow_rays.h"

namespace rebounce {
namespace {

// A pair whose rays all agree may still be partly hidden: its variance is not zero but this part
// of the squared exchange.
constexpr double kVarianceFloor = 1e-6;

class FormFactorAssembly {
 public:
  FormFactorAssembly(const PatchModel& model, const RayTracer& tracer,
                     const FormFactorSettings& settings, const Progress& progress)
      : model_(model),
        tracer_(tracer),
        settings_(settings),
        progress_(progress),
        patch_triangles_(model.mesh.triangle_patch, model.patches.size()),
        geometry_(model, tracer, settings.seed),
        shadow_rays_(geometry_, settings.seed, settings.kernel_tolerance) {}

  FormFactors run() { return settings_.link_epsilon > 0 ? run_on_links() : run_on_pairs(); }

 private:
  FormFactors run_on_pairs() {
    const std::size_t n = geometry_.patch_count();
    ExchangeRows rows(n);
    std::vector<Escape> escape(n);
    for_each_patch(0.0, 0.8, [&](std::uint32_t i, Scratch& scratch) {
      compute_row(i, scratch, rows[i]);
      escape[i] = measure_escape(model_.mesh, patch_triangles_[i], i, tracer_,
                                 settings_.escape_rays, settings_.seed, scratch.escape);
    });
    const std::vector<RowTarget> target = row_targets(escape, settings_.escape_rays);
    const std::vector<bool> doubtful =
        find_doubtful_rows(row_sums(rows, geometry_.areas()), target, geometry_);
    for_each_patch(0.8, 1.0, [&](std::uint32_t i, Scratch& scratch) {
      refine_row(i, doubtful, scratch, rows[i]);
    });

    return close(rows, escape, target);
  }

  FormFactors run_on_links() {
    const RefinedLinks refined =
        refine_links(model_, shadow_rays_, tracer_, settings_, {}, progress_);
    ExchangeRows rows = expand_links(refined.tree, shadow_rays_, refined.links, progress_);
    for (auto& row : rows) {
      for (ExchangeEntry& entry : row) entry.visibility_variance += kVarianceFloor;
    }
    ray_count_ = refined.ray_count;
    pair_count_ = refined.candidate_count;
    return close(rows, refined.escape, refined.target);
  }

  FormFactors close(ExchangeRows& rows, const std::vector<Escape>& escape,
                    const std::vector<RowTarget>& target) const {
    FormFactors result;
    result.closure = enforce_closure(rows, geometry_.areas(), target);
    store_escape(rows, escape, result);
    result.exchange = compress_rows(rows);
    result.ray_count = ray_count_ + escape.size() * settings_.escape_rays;
    result.pair_count = pair_count_;
    return result;
  }

  struct Scratch {
    std::vector<FacingPatch> facing, mixed;
    std::vector<Ray> rays;
    std::vector<float> transmitted;  ///< of each ray
    EscapeScratch escape;
  };

  /// Runs `work` for every patch on all threads, with progress; throws Cancelled if asked to.
  /// The work is the part from `begin` to `end` of the whole.
  template <typename Work>
  void for_each_patch(double begin, double end, const Work& work) {
    const std::size_t n = geometry_.patch_count();
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
    shadow_rays_.find_facing(i, scratch.facing, [](std::uint32_t) { return true; });
    trace(i, scratch.facing, settings_.probe_rays, scratch);
    scratch.mixed.clear();
    const auto probe = static_cast<std::size_t>(settings_.probe_rays);
    for (std::size_t p = 0; p < scratch.facing.size(); ++p) {
      const auto agreement =
          ShadowRays::agreement(std::span(scratch.rays).subspan(p * probe, probe),
                                std::span(scratch.transmitted).subspan(p * probe, probe));
      if (agreement == ShadowRays::Agreement::kClear) append(row, scratch.facing[p], 1.0, 0.0);
      if (agreement == ShadowRays::Agreement::kMixed) scratch.mixed.push_back(scratch.facing[p]);
    }
    append_mixed(i, scratch, row);
    pair_count_ += scratch.facing.size();
    ray_count_ += scratch.facing.size() * settings_.probe_rays;
  }

  /// Traces all rays of the pairs of row i that have a doubtful patch, and replaces their entries.
  void refine_row(std::uint32_t i, const std::vector<bool>& doubtful, Scratch& scratch,
                  std::vector<ExchangeEntry>& row) {
    const auto is_doubtful = [&](std::uint32_t j) { return doubtful[i] || doubtful[j]; };
    std::erase_if(row, [&](const ExchangeEntry& entry) { return is_doubtful(entry.column); });
    shadow_rays_.find_facing(i, scratch.mixed, is_doubtful);
    append_mixed(i, scratch, row);
  }

  /// Traces all rays of scratch.mixed and adds what gets through to the row.
  void append_mixed(std::uint32_t i, Scratch& scratch, std::vector<ExchangeEntry>& row) {
    const int full = settings_.full_rays;
    trace(i, scratch.mixed, full, scratch);
    for (std::size_t p = 0; p < scratch.mixed.size(); ++p) {
      const ShadowRays::Visibility visible = shadow_rays_.visibility(
          i, scratch.mixed[p].patch, std::span(scratch.rays).subspan(p * full, full),
          std::span(scratch.transmitted).subspan(p * full, full));
      append(row, scratch.mixed[p], visible.part, visible.variance);
    }
    std::sort(row.begin(), row.end(),
              [](const ExchangeEntry& a, const ExchangeEntry& b) { return a.column < b.column; });
    ray_count_ += scratch.mixed.size() * full;
  }

  /// Traces `count` rays for each pair of patch i, one pair after the other.
  /// Where there are holes, a triangle's mean is all that patches resolve: taking it keeps the
  /// noise of single holes out of F.
  void trace(std::uint32_t i, const std::vector<FacingPatch>& facing, int count,
             Scratch& scratch) const {
    shadow_rays_.make_rays(i, facing, count, scratch.rays);
    scratch.transmitted.resize(scratch.rays.size());
    tracer_.transmittance(scratch.rays, PassageDetail::kTriangle, scratch.transmitted);
  }

  void append(std::vector<ExchangeEntry>& row, const FacingPatch& pair, double visible,
              double variance) const {
    const double exchange = pair.unoccluded * visible;
    if (static_cast<float>(exchange) <= 0) return;
    row.push_back({pair.patch, static_cast<float>(exchange), static_cast<float>(pair.unoccluded),
                   static_cast<float>(variance + kVarianceFloor)});
  }

  /// What the rows of F leave of 1 is what escapes; its parts are shared as they were measured.
  void store_escape(const ExchangeRows& rows, const std::vector<Escape>& escape,
                    FormFactors& result) const {
    const std::vector<double> sum = row_sums(rows, geometry_.areas());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double rest = std::max(0.0, 1 - sum[i]), lost = escape[i].sky + escape[i].absorbed;
      const double sky = lost > 0 ? rest * escape[i].sky / lost : 0;
      result.sky_visibility.push_back(static_cast<float>(sky));
      result.absorbed.push_back(static_cast<float>(std::max(0.0, rest - sky)));
      append_sky_cells(escape[i], sky, result.sky_cells);
    }
  }

  /// Adds the cells by which one more patch sees the sky, `sky` in all.
  static void append_sky_cells(const Escape& escape, double sky, SkyCells& cells) {
    if (cells.empty()) cells.entry_begin.push_back(0);
    for (const auto& [cell, part] : escape.sky_cells) {
      if (!(sky > 0)) break;
      cells.entry_cell.push_back(cell);
      cells.entry_part.push_back(static_cast<float>(part * sky / escape.sky));
    }
    cells.entry_begin.push_back(static_cast<std::uint32_t>(cells.entry_cell.size()));
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
  const PatchTriangles patch_triangles_;
  const PatchGeometry geometry_;
  const ShadowRays shadow_rays_;
  std::atomic<std::uint64_t> ray_count_ = 0, pair_count_ = 0;
};

}  // namespace

FormFactors compute_form_factors(const PatchModel& model, const RayTracer& tracer,
                                 const FormFactorSettings& settings, const Progress& progress) {
  check_form_factor_settings(settings);
  return FormFactorAssembly(model, tracer, settings, progress).run();
}

}  // namespace rebounce
