#include <algorithm>
#include <cmath>
#include <utility>

#include "precompute/base/process_memory.h"
#include "precompute/base/ranks.h"
#include "precompute/build/build_estimate.h"
#include "precompute/build/exchange_stage.h"
#include "precompute/build/link_checkpoint.h"
#include "precompute/build/operator_stage.h"
#include "precompute/exchange/links/link_fitting.h"
#include "precompute/exchange/links/links.h"
#include "precompute/lights/link_error.h"

namespace rebounce {
namespace {

// Links are made so often at most. The last are kept, whatever they are off.
constexpr int kMostRounds = 3;

// What links may be off, as a part of the tolerance, before they are made finer: with what
// compression is off, usually 0.65 of the tolerance, the whole error is then within it, and chance
// in what rays tell seldom brings it above (lab/122, lab/183).
constexpr double kAccepted = 0.65;

// The error of links grows with this power of their epsilon, and their number with that of its
// inverse (lab/122).
constexpr double kErrorPower = 0.7, kCountPower = 0.5;

// From one round to the next epsilon falls to these parts of itself. Where it does not bring the
// error down, it is not what binds, and links are not made again.
constexpr double kLeastStep = 0.3, kMostStep = 0.7, kLeastGain = 0.85;

/// Patches and mesh of a model, as long as the object lives in the data of a build, with the light
/// that escapes them.
class LentPatches {
 public:
  LentPatches(PatchModel& model, const EscapedLight& escaped, TransferData& data)
      : model_(model), data_(data) {
    exchange();
    data.patches.sky_visibility = escaped.sky_visibility;
    data.patches.absorbed = escaped.absorbed;
    data.sky_cells = escaped.sky_cells;
  }
  ~LentPatches() { exchange(); }
  LentPatches(const LentPatches&) = delete;
  LentPatches& operator=(const LentPatches&) = delete;

 private:
  void exchange() {
    std::swap(model_.patches, data_.patches);
    std::swap(model_.mesh, data_.mesh);
  }

  PatchModel& model_;
  TransferData& data_;
};

/// The epsilon with which links are off by what they aim at, within limits.
double finer_epsilon(double epsilon, double error, double tolerance) {
  const double wanted = std::pow(kLinksPart * tolerance / error, 1 / kErrorPower);
  return epsilon * std::clamp(wanted, kLeastStep, kMostStep);
}

/// The memory that as many links as epsilon times `step` gives need, where `builder` has `found`
/// some.
std::uint64_t bytes_of_finer(const PatchModel& model, const PatchRoles& roles,
                             const BuildSettings& decided, const LinkBuilder& builder,
                             const LinkBuild& found, double step) {
  const double finer =
      static_cast<double>(found.form_factors->link_count()) * std::pow(step, -kCountPower);
  const LinkedBuild build =
      linked_build(built_scene(model.patches.size(), model.mesh), static_cast<std::size_t>(finer),
                   builder.held_bytes() + found.form_factors->bytes(), model.patches, roles,
                   kCompressionPart * decided.tolerance);
  return std::max(peak_bytes_of_links(build),
                  peak_bytes_after_links(build, decided.memory_limit_bytes));
}

/// Whether finer links that need so many bytes are made. Ranks may have different limits, and go
/// the same way.
bool finer_fit(std::uint64_t bytes, std::uint64_t limit, LinkLimits& limits) {
  const bool fits = Ranks().least(bytes <= limit ? 1 : 0) != 0;
  if (fits) limits.least = std::max(limits.least, std::min(bytes, limit));
  if (!fits) limits.end = std::max(bytes, limit + 1);
  return fits;
}

/// What the light of `found` is off by, in the mean; finds fewer links, which tell it.
double judge(PatchModel& model, const RayTracer& tracer, const PatchRoles& roles,
             const BuildSettings& decided, FoundLinks& found, TransferData& data,
             PhaseClock& clock) {
  found.fewer = clock.run("fewer links", [&](const Progress& part) {
    return fit_links(found.form_factors, model.patches, kErrorPerLink, part);
  });
  return clock.run("check of links", [&](const Progress& part) {
    const LentPatches lent(model, found, data);
    return error_of_links(found.form_factors, found.fewer, data, model.shown_patch, tracer, roles,
                          decided.form_factors.seed, part)
        .mean;
  });
}

/// Makes links, and while they are `judged`, finer ones from them until they are near enough.
JudgedLinks near_enough_links(PatchModel& model, const RayTracer& tracer, const PatchRoles& roles,
                              bool judged, const BuildSettings& decided, TransferData& data,
                              PhaseClock& clock) {
  double epsilon = decided.form_factors.link_epsilon;
  LinkLimits limits;
  LinkBuilder builder(model, tracer, decided.form_factors);
  double last_error = 0;
  for (int round = 1;; ++round) {
    FoundLinks found{clock.run(round == 1 ? "form factors" : "finer links",
                               [&](const Progress& part) { return builder.build(epsilon, part); }),
                     {}};
    if (!judged || round == kMostRounds) return {std::move(found), epsilon, limits};
    const double error = judge(model, tracer, roles, decided, found, data, clock);
    const bool helps = round == 1 || error < kLeastGain * last_error;
    const bool is_last = error <= kAccepted * decided.tolerance || !helps;
    const double finer = finer_epsilon(epsilon, error, decided.tolerance);
    const auto bytes_needed = [&] {
      return bytes_of_finer(model, roles, decided, builder, found, finer / epsilon);
    };
    if (is_last || !finer_fit(bytes_needed(), decided.memory_limit_bytes, limits)) {
      return {std::move(found), epsilon, limits};
    }
    epsilon = finer;
    last_error = error;
  }
}

}  // namespace

FoundLinks find_links(PatchModel& model, const RayTracer& tracer, const PatchRoles& roles,
                      bool judged, BuildSettings& decided, TransferData& data, BuildReport& report,
                      PhaseClock& clock) {
  const Checkpoint checkpoint(decided.checkpoint, identity_of_links(model, roles, judged, decided));
  JudgedLinks links;
  if (!find_kept_links(checkpoint, model.patches, decided.memory_limit_bytes, links)) {
    links = near_enough_links(model, tracer, roles, judged, decided, data, clock);
    return_freed_memory();  // of what finer links would have been made from
    if (Ranks().rank() == 0) keep_links(checkpoint, links);
  }
  decided.form_factors.link_epsilon = links.epsilon;
  const LinkBuild& build = links.build;
  report.ray_count = build.ray_count;
  report.pair_count = build.candidate_count;
  report.link_count = build.form_factors->link_count();
  report.closure = build.closure;
  return std::move(links.build);
}

std::size_t forecast_links(const PatchModel& model, const RayTracer& tracer,
                           const BuildSettings& decided, PhaseClock& clock) {
  return clock.run("estimate", [&](const Progress& part) {
    return forecast_link_count(model, tracer, decided.form_factors, part);
  });
}

}  // namespace rebounce
