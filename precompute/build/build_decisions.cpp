#include "precompute/build/build_decisions.h"

#include <algorithm>
#include <cmath>

#include "precompute/base/checkpoint.h"
#include "precompute/base/ranks.h"
#include "precompute/build/build_estimate.h"
#include "precompute/build/operator_stage.h"
#include "precompute/exchange/links/links.h"
#include "precompute/exchange/pairs/form_factor_settings.h"
#include "precompute/inverse/dense_transfer.h"
#include "precompute/outputs/light_probes.h"
#include "precompute/outputs/receiver_rows.h"
#include "precompute/outputs/row_receivers.h"
#include "rebounce/error.h"
#include "runtime/frame/engine_parts.h"

namespace rebounce {
namespace {

// Of the surface: where vertices that are small against patches show less than this, rows of their
// own change little of what all show (lab/135).
constexpr double kSmallPart = 0.25;

constexpr std::size_t kMostRank = 1'000'000;

/// The exchange that the operator is made from, if the settings leave it open.
ExchangeSource choose_form_factors(const BuildSettings& settings, const PatchModel& model) {
  const bool from_links = settings.operator_kind == OperatorKind::kHierarchical;
  if (settings.exchange_source == ExchangeSource::kLinks && !from_links &&
      settings.operator_kind != OperatorKind::kNoOperator) {
    throw Error(
        "from links only a hierarchical operator is made; give --operator hierarchical, or "
        "--form-factors pairs");
  }
  if (settings.exchange_source != ExchangeSource::kAutomatic) return settings.exchange_source;
  const std::size_t n = model.patches.size();
  const bool too_many =
      n > kPairsPatchCount ||
      peak_bytes_of_pairs(pairs_build(built_scene(n, model.mesh),
                                      distinct_channels(model.patches.reflectance), settings)) >
          memory_limit_bytes(settings);
  return from_links && too_many ? ExchangeSource::kLinks : ExchangeSource::kPairs;
}

/// Whether rows of vertices are worth looking for where the settings leave it open.
bool may_need_rows(const BuildSettings& settings, const PatchModel& model) {
  if (settings.operator_kind == OperatorKind::kNoOperator || settings.receiver_rows.at_texels)
    return false;
  return SmallVertices(model.mesh, model.patches, model.shown_patch).part_of_surface() > kSmallPart;
}

void require(bool holds, const char* otherwise) {
  if (!holds) throw Error(otherwise);
}

/// True if `x` is a finite number of at least `least`.
bool is_from(double least, double x) {
  return std::isfinite(x) && x >= least;
}

}  // namespace

void check_settings(const BuildSettings& settings) {
  const SubdivisionSettings& patches = settings.subdivision;
  require(settings.scale > 0 && std::isfinite(settings.scale), "scale must be above 0");
  require(is_from(0, patches.patch_size) && (patches.patch_size > 0 || patches.patch_count > 0),
          "patches need a number of them, or a size above 0 metres");
  require(is_from(0, patches.lamp_weight), "the weight of lamps must be at least 0");
  require(settings.operator_kind != OperatorKind::kHierarchical ||
              (settings.tolerance > 0 && std::isfinite(settings.tolerance)),
          "the tolerance must be above 0");
  require(settings.operator_kind != OperatorKind::kLowRank ||
              (settings.rank >= 1 && settings.rank <= kMostRank),
          "the rank must be from 1 to 1000000");
  require(is_from(0, settings.form_factor_tolerance),
          "the tolerance of form factors must be at least 0");
  require(
      settings.operator_kind != OperatorKind::kNoOperator || settings.form_factor_tolerance == 0,
      "form factors are compressed with an operator alone; make one, or store them whole");
  const auto& [nx, ny, nz] = settings.probes.grid;
  require((nx > 0) == (ny > 0) && (ny > 0) == (nz > 0),
          "a grid of probes needs a number along each of x, y and z");
  require(is_from(0, settings.probes.spacing), "the spacing of probes must be at least 0 metres");
  require(settings.probes.ray_count >= kFewestProbeRays, "a probe needs at least 64 rays");
  const int harmonic_rays = settings.surface_harmonics.ray_count;
  require(harmonic_rays == 0 || harmonic_rays >= kFewestHarmonicRays,
          "surface harmonics need at least 16 rays for each patch");
  check_receiver_rows(settings.receiver_rows);
  check_form_factor_settings(settings.form_factors);
}

/// The settings with everything decided that was left open.
BuildSettings decide(BuildSettings settings, const PatchModel& model) {
  settings.memory_limit_bytes = memory_limit_bytes(settings);
  settings.exchange_source = choose_form_factors(settings, model);
  const bool links = settings.exchange_source == ExchangeSource::kLinks;
  const bool restricted_roles = !settings.receivers.empty() || !settings.sources.empty();
  const bool hierarchical = settings.operator_kind == OperatorKind::kHierarchical;
  if (restricted_roles && !hierarchical) {
    throw Error(
        "receivers and sources are for hierarchical operators alone; give --operator hierarchical");
  }
  ReceiverRowSettings& rows = settings.receiver_rows;
  if (rows.at_vertices && rows.least_error > 0) rows.at_vertices = may_need_rows(settings, model);
  if (rows.any() && settings.operator_kind == OperatorKind::kNoOperator) {
    throw Error("rows of receivers need an operator; make one, or give --receivers-at patches");
  }
  if (rows.at_texels && settings.lightmap.size == 0) {
    throw Error("rows of texels need a lightmap; ask for one (--lightmap 512, for instance)");
  }
  const ProbeSettings& probes = settings.probes;
  if (probes.grid[0] > 0 || probes.spacing > 0) place_probes(model.mesh, probes);  // not too many
  if (!links && !Ranks().alone()) {
    throw Error("the ranks of mpirun share builds from links alone; add --form-factors links");
  }
  if (!settings.precision) {
    const bool dense = settings.operator_kind == OperatorKind::kDense;
    settings.precision = hierarchical ? Precision::kQ8 : dense ? Precision::kF32 : Precision::kF16;
  }
  if (are_integers(hierarchical_precision(*settings.precision).bases) && !hierarchical) {
    throw Error(
        "integers are for hierarchical operators alone; give --precision f16 or f32, or "
        "--operator hierarchical");
  }
  if (links && settings.store_form_factors) {
    throw Error(
        "links have no form factors of pairs to store; take --compress-form-factors instead of "
        "--store-form-factors, or --form-factors pairs");
  }
  double& link_epsilon = settings.form_factors.link_epsilon;
  if (!links && link_epsilon > 0) {
    throw Error("--link-epsilon is for form factors from links; add --form-factors links");
  }
  if (!links && !settings.checkpoint.empty()) {
    throw Error(
        "--checkpoint keeps parts of builds from links; leave it out, or add --form-factors links");
  }
  const Checkpoint is_writable(settings.checkpoint, "");  // refused before the work begins
  if (links && link_epsilon == 0) {
    link_epsilon = kLinkEpsilon * (settings.tolerance / kDefaultTolerance);
  }
  if (links && settings.form_factor_tolerance == 0 && !restricted_roles) {
    settings.form_factor_tolerance =
        std::max(kLeastFormFactorTolerance, settings.tolerance / kToleranceOverFormFactors);
  }
  return settings;
}

const std::vector<Light>& own_lights(const BuildSettings& settings) {
  check_lights(*settings.lights);
  return *settings.lights;
}

}  // namespace rebounce
