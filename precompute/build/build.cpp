#include "rebounce/build.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "precompute/base/thread_limit.h"
#include "precompute/build/build_decisions.h"
#include "precompute/build/build_estimate.h"
#include "precompute/build/exchange_stage.h"
#include "precompute/build/operator_stage.h"
#include "precompute/build/output_stage.h"
#include "precompute/build/phase_clock.h"
#include "precompute/build/transfer_build.h"
#include "precompute/patches/patch_model.h"
#include "precompute/patches/patch_selection.h"
#include "precompute/patches/winding.h"
#include "rebounce/version.h"

namespace rebounce {
namespace {

std::vector<std::string> mesh_names(const Scene& scene) {
  std::vector<std::string> names;
  std::set<std::string_view> known{""};
  for (const PlacedMesh& mesh : scene.placed_meshes) {
    const std::string& name = mesh.mesh_name.empty() ? mesh.node_name : mesh.mesh_name;
    if (known.insert(name).second) names.push_back(name);
  }
  return names;
}

void describe_patches(const PatchModel& model, BuildReport& report) {
  report.display_triangle_count = model.mesh.triangle.size();
  report.patch_count = model.patches.size();
  report.sliver_count = model.sliver_count;
  report.unlit_side_count = model.unlit_side_count;
  report.covered_side_count = model.covered_side_count;
  report.opening_side_count = model.opening_side_count;
  report.buried_side_count = model.buried_side_count;
  std::vector<float> size(model.patches.area);
  for (float& s : size) s = std::sqrt(s);
  std::ranges::sort(size);
  report.patch_size_min = size.front();
  report.patch_size_median = size[size.size() / 2];
  report.patch_size_max = size.back();
  report.warnings.insert(report.warnings.end(), model.warnings.begin(), model.warnings.end());
}

/// The offline stage, step by step; each step uses the results of those before it.
class TransferBuild {
 public:
  TransferBuild(const BuildSettings& settings, BuildReport& report, const BuildProgress& progress,
                const EstimateListener& on_estimate)
      : settings_(settings), report_(report), on_estimate_(on_estimate), clock_(report, progress) {}

  Scene import_scene(const std::filesystem::path& path) {
    Scene scene =
        clock_.run("import", [&](const Progress&) { return import_usable(path, settings_.scale); });
    return scene;
  }

  void describe_scene(const Scene& scene) {
    report_.triangle_count = scene.triangle.size();
    report_.degenerate_triangle_count = scene.degenerate_triangle_count;
    report_.mesh_names = mesh_names(scene);
    report_.warnings.insert(report_.warnings.end(), scene.warnings.begin(), scene.warnings.end());
    receivers_ = PatchSelection(settings_.receivers, scene, "receivers");
    sources_ = PatchSelection(settings_.sources, scene, "sources");
    data_.materials = scene.materials;
    data_.textures = scene.textures;
    data_.cameras = scene.cameras;
    data_.lights = scene.lights;
    const auto left_out =
        std::ranges::count_if(data_.lights, [](const Light& light) { return !is_punctual(light); });
    if (left_out > 0) {
      report_.warnings.push_back(fmt::format(
          "lamps with a surface or a profile that shape the patches but are not kept in the file: "
          "{}; name them where it is lit",
          left_out));
    }
    data_.record.generator = std::string("rebounce ") + version();
    data_.record.scene_name = scene.name;
    data_.record.scene_hash = scene.hash;
  }

  /// Makes the patches. Throws Error if the rest needs more memory than allowed, or cannot be made
  /// with these settings.
  void make_patches(Scene scene) {
    refuse_if_too_large(least_cost(scene, settings_.subdivision), memory_limit_bytes(settings_),
                        report_.triangle_count);
    model_ = clock_.run("patches", [&](const Progress& part) {
      return make_patch_model(std::move(scene), settings_.subdivision, part);
    });
    describe_patches(model_, report_);
    roles_ = choose_roles(model_, receivers_, sources_);
    if (settings_.lightmap.size > 0) {
      data_.lightmap = clock_.run(
          "lightmap", [&](const Progress&) { return make_lightmap(model_, settings_, report_); });
    }
    decided_ = decide(settings_, model_);
    estimate();
    if (settings_.exchange_source == ExchangeSource::kAutomatic && !fits() &&
        decided_.exchange_source == ExchangeSource::kPairs &&
        decided_.operator_kind == OperatorKind::kHierarchical) {
      BuildSettings from_links = settings_;
      from_links.exchange_source = ExchangeSource::kLinks;
      decided_ = decide(from_links, model_);
      estimate();
    }
    announce(report_.estimate);
  }

  /// Finds the exchange of the patches, and what brings their light to where it is shown. Patches
  /// and mesh then belong to the data.
  void find_exchange() {
    const bool links = decided_.exchange_source == ExchangeSource::kLinks;
    const bool operator_of_links = links && decided_.operator_kind != OperatorKind::kNoOperator;
    EscapedLight escaped =
        links ? find_linked() : find_pairs(model_, tracer(), decided_, data_, report_, clock_);
    model_.patches.sky_visibility = std::move(escaped.sky_visibility);
    model_.patches.absorbed = std::move(escaped.absorbed);
    if (operator_of_links) {
      LinkedBuild build =
          linked_build(built_scene(model_, decided_), report_.link_count, links_->bytes(),
                       model_.patches, roles_, kCompressionPart * decided_.tolerance);
      std::uint64_t& limit = decided_.memory_limit_bytes;
      announce(report_.estimate_after_links.emplace(estimate_after_links(build, limit)));
      thread_limit_.emplace(thread_count_after_links(build, limit));
      limit -= std::min(limit - 1, build.held_bytes);  // what is left for the other stages
    }
    data_.patches = std::move(model_.patches);
    data_.sky_cells = std::move(escaped.sky_cells);
    data_.mesh = std::move(model_.mesh);
    make_outputs(model_.shown_patch, *tracer_, decided_, data_, report_, clock_);
  }

  /// Makes the operator, measures its error and makes what needs it.
  void make_operator() {
    if (decided_.operator_kind == OperatorKind::kNoOperator) return;
    const bool links = decided_.exchange_source == ExchangeSource::kLinks;
    const std::vector<KindError> errors =
        links
            ? make_operator_from_links(std::move(links_), std::move(fewer_links_), *tracer_,
                                       model_.shown_patch, decided_, roles_, data_, report_, clock_)
            : make_operator_from_pairs(*tracer_, decided_, roles_, data_, report_, clock_);
    make_outputs_of_operator(model_.shown_patch, *tracer_, decided_, data_, report_, clock_);
    record_build(decided_, report_, errors, data_);
  }

  /// All that follows on the scene.
  TransferData run(Scene scene) {
    check_settings(settings_);
    if (settings_.lights) scene.lights = own_lights(settings_);
    describe_scene(scene);
    make_patches(std::move(scene));
    find_exchange();
    make_operator();
    return take();
  }

 private:
  /// Whether links are judged by the light that an operator is fitted to, and made finer.
  bool judges_links() const {
    return decided_.exchange_source == ExchangeSource::kLinks &&
           decided_.operator_kind != OperatorKind::kNoOperator &&
           settings_.form_factors.link_epsilon == 0;
  }

  /// Finds links: for an operator, or else into the data.
  EscapedLight find_linked() {
    FoundLinks build =
        find_links(model_, tracer(), roles_, judges_links(), decided_, data_, report_, clock_);
    links_ = std::move(build.form_factors);
    fewer_links_ = std::move(build.fewer);
    if (decided_.operator_kind == OperatorKind::kNoOperator) {
      data_.links = flat_links(*std::exchange(links_, nullptr));
    }
    return build;
  }

  /// Of the surfaces of the model, made once.
  const RayTracer& tracer() {
    if (!tracer_) tracer_.emplace(make_surface_tracer(model_.mesh));
    return *tracer_;
  }

  /// The data, with those lamps and form factors alone that are to be kept.
  TransferData take() {
    std::erase_if(data_.lights, [](const Light& light) { return !is_punctual(light); });
    if (!settings_.store_form_factors) data_.exchange = {};
    if (settings_.form_factor_tolerance == 0) data_.compressed_form_factors.reset();
    return std::move(data_);
  }

  /// Estimates what the build will cost, as it is decided.
  void estimate() {
    const bool links = decided_.exchange_source == ExchangeSource::kLinks;
    std::size_t link_count = links ? forecast_links(model_, tracer(), decided_, clock_) : 0;
    if (judges_links()) link_count = finer_link_count(link_count, model_.patches.size());
    report_.estimate = estimate_cost(model_, roles_, decided_, link_count);
    if (fits() && !links) forecast_pairs();
  }

  bool fits() const { return report_.estimate.peak_bytes <= decided_.memory_limit_bytes; }

  /// Forecasts the cost of a build from pairs, from short samples.
  void forecast_pairs() {
    clock_.run("estimate", [&](const Progress& part) {
      sample_pairs(model_, tracer(), decided_, part, report_.estimate);
      return true;
    });
  }

  /// Reports the estimate, which what the build has taken so far is a part of. Throws Error if the
  /// rest needs more memory than allowed.
  void announce(CostEstimate& estimate) {
    estimate.peak_bytes = std::max(estimate.peak_bytes, taken_.bytes());
    if (on_estimate_) on_estimate_(estimate);
    refuse_if_too_large(estimate, decided_.memory_limit_bytes, report_.triangle_count);
  }

  const TakenMemory taken_;
  const BuildSettings& settings_;
  BuildSettings decided_;  ///< settings_ with everything decided
  BuildReport& report_;
  const EstimateListener& on_estimate_;
  PhaseClock clock_;
  TransferData data_;
  PatchModel model_;
  PatchSelection receivers_, sources_;
  PatchRoles roles_;
  std::shared_ptr<const LinkedFormFactors> links_;
  FormFactorLinks fewer_links_;
  std::optional<RayTracer> tracer_;
  std::optional<ThreadLimit> thread_limit_;  ///< of what follows links
};

}  // namespace

TransferData build_transfer_data(const std::filesystem::path& scene_path,
                                 const BuildSettings& settings, BuildReport& report,
                                 const BuildProgress& progress,
                                 const EstimateListener& on_estimate) {
  TransferBuild build(settings, report, progress, on_estimate);
  return build.run(build.import_scene(scene_path));
}

TransferData build_transfer_data(Scene scene, const BuildSettings& settings, BuildReport& report,
                                 const BuildProgress& progress,
                                 const EstimateListener& on_estimate) {
  TransferBuild build(settings, report, progress, on_estimate);
  return build.run(std::move(scene));
}

std::shared_ptr<const TransferData> build_transfer(const std::filesystem::path& scene_path,
                                                   const BuildSettings& settings,
                                                   BuildReport& report,
                                                   const BuildProgress& progress,
                                                   const EstimateListener& on_estimate) {
  return std::make_shared<const TransferData>(
      build_transfer_data(scene_path, settings, report, progress, on_estimate));
}

}  // namespace rebounce
