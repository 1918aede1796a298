#include "precompute/build/build_decisions.h"

#include "precompute/base/ranks.h"
#include "precompute/build/build_estimate.h"
#include "precompute/build/operator_stage.h"
#include "precompute/exchange/links/links.h"
#include "precompute/inverse/dense_transfer.h"
#include "precompute/outputs/row_receivers.h"
#include "rebounce/error.h"
#include "runtime/frame/engine_parts.h"

namespace rebounce {
namespace {

// Of the surface: where vertices that are small against patches show less than this, rows of their
// own change little of what all show (lab/135).
constexpr double kSmallPart = 0.25;

/// The exchange that the operator is made from, if the settings leave it open.
ExchangeSource choose_form_factors(const BuildSettings& settings, const PatchModel& model) {
  const bool from_links = settings.operator_kind == OperatorKind::kHierarchical;
  if (settings.exchange_source == ExchangeSource::kLinks && !from_links &&
      settings.operator_kind != OperatorKind::kNoOperator) {
    throw Error("from links only a hierarchical operator is made; ask for that, or for pairs");
  }
  if (settings.exchange_source != ExchangeSource::kAutomatic) return settings.exchange_source;
  const std::size_t n = model.patches.size();
  const bool too_many =
      n > kPairsPatchCount ||
      peak_bytes_of_pairs(built_scene(n, model.mesh), distinct_channels(model.patches.reflectance),
                          settings.operator_kind, settings.rank) > memory_limit_bytes(settings);
  return from_links && too_many ? ExchangeSource::kLinks : ExchangeSource::kPairs;
}

/// Whether rows of vertices are worth looking for where the settings leave it open.
bool may_need_rows(const BuildSettings& settings, const PatchModel& model) {
  if (settings.operator_kind == OperatorKind::kNoOperator || settings.receiver_rows.at_texels)
    return false;
  return SmallVertices(model.mesh, model.patches, model.shown_patch).part_of_surface() > kSmallPart;
}

}  // namespace

/// The settings with everything decided that was left open.
BuildSettings decide(BuildSettings settings, const PatchModel& model) {
  settings.memory_limit_bytes = memory_limit_bytes(settings);
  settings.exchange_source = choose_form_factors(settings, model);
  const bool links = settings.exchange_source == ExchangeSource::kLinks;
  const bool restricted_roles = !settings.receivers.empty() || !settings.sources.empty();
  const bool hierarchical = settings.operator_kind == OperatorKind::kHierarchical;
  if (restricted_roles && !hierarchical) {
    throw Error("receivers and sources are for hierarchical operators alone; ask for one");
  }
  ReceiverRowSettings& rows = settings.receiver_rows;
  if (rows.at_vertices && rows.least_error > 0) rows.at_vertices = may_need_rows(settings, model);
  if (rows.any() && settings.operator_kind == OperatorKind::kNoOperator) {
    throw Error("rows of receivers need an operator; ask for one, or for receivers at patches");
  }
  if (rows.at_texels && settings.lightmap.size == 0) {
    throw Error("rows of texels need a lightmap; ask for one (--lightmap 512, for instance)");
  }
  if (!links && !Ranks().alone()) {
    throw Error("the ranks of mpirun share builds from links alone; add --form-factors links");
  }
  if (!settings.precision) {
    const bool dense = settings.operator_kind == OperatorKind::kDense;
    settings.precision = hierarchical ? Precision::kQ8 : dense ? Precision::kF32 : Precision::kF16;
  }
  if (are_integers(hierarchical_precision(*settings.precision).bases) && !hierarchical) {
    throw Error("integers are for hierarchical operators alone; use f16 or f32, or ask for one");
  }
  if (links && settings.store_form_factors) {
    throw Error(
        "links have no form factors of pairs to store; take --compress-form-factors instead of "
        "--store-form-factors, or --form-factors pairs");
  }
  double& link_epsilon = settings.form_factors.link_epsilon;
  if (!links && link_epsilon > 0) {
    throw Error("the error of a link is for form factors from links; ask for these");
  }
  if (links && link_epsilon == 0) {
    link_epsilon = kLinkEpsilon * (settings.tolerance / kDefaultTolerance);
  }
  if (links && settings.form_factor_tolerance == 0 && !restricted_roles) {
    settings.form_factor_tolerance = settings.tolerance / kToleranceOverFormFactors;
  }
  return settings;
}

const std::vector<Light>& own_lights(const BuildSettings& settings) {
  check_lights(*settings.lights);
  return *settings.lights;
}

}  // namespace rebounce
