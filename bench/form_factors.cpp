// How exact form factors are: against closed forms, against a hundred times the rays, and how fast
// beside bare Embree.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "exchange_error.h"
#include "exchange_reference.h"
#include "form_factor_scaling.h"
#include "form_factor_sums.h"
#include "input.h"
#include "known_form_factors.h"
#include "program.h"
#include "rebounce/precompute/links.h"
#include "rebounce/precompute/patch_geometry.h"
#include "rebounce/runtime/float3_glm.h"
#include "stage_speed.h"

namespace rebounce::bench {
namespace {

struct Options {
  std::vector<std::string> scenes;
  std::string table = REBOUNCE_SOURCE_DIR "/tests/reference/view_factors.tsv";
  std::size_t patch_count = 1000;
  int reference_factor = 100;
  double ray_limit = 2e6;
  std::vector<std::size_t> scaling_patches = {4000, 16000, 64000};
  double link_epsilon = kLinkEpsilon;
  std::string part = "all";
  CommonOptions common{.repeats = 5};
};

struct NamedQuality {
  const char* name;
  FormFactorQuality quality;
  double asked_part, asked_least;  ///< error of a known form factor, relative or absolute
};

constexpr std::array kQualities = {NamedQuality{"low", FormFactorQuality::kLow, 0, 0},
                                   NamedQuality{"default", FormFactorQuality::kDefault, 5e-3, 5e-5},
                                   NamedQuality{"high", FormFactorQuality::kHigh, 1e-3, 1e-5}};

/// Rows of what was measured beside what is asked.
class Report {
 public:
  Report() : table_({"subject", "patches", "quality", "measure", "value", "asked", "of asked"}) {}

  /// At most `asked` is wanted; 0: nothing is.
  void at_most(const std::string& subject, std::size_t patches, const char* quality,
               const std::string& measure, double value, double asked) {
    if (asked <= 0) {
      table_.add({subject, patches, quality, measure, value, {}, {}});
    } else {
      table_.add({subject, patches, quality, measure, value, asked, value / asked});
    }
  }

  void at_least(const std::string& subject, std::size_t patches, const char* quality,
                const std::string& measure, double value, double asked) {
    table_.add({subject, patches, quality, measure, value, asked, asked / value});
  }

  const Table& table() const { return table_; }

 private:
  Table table_;
};

FormFactors form_factors_of(const PatchModel& model, FormFactorQuality quality) {
  return compute_form_factors(model, make_surface_tracer(model.mesh), with_quality(quality));
}

void measure_known(const std::vector<KnownFormFactor>& cases, std::size_t patch_count,
                   Report& report) {
  for (const KnownFormFactor& known : cases) {
    const PatchModel model = make_patch_model(known.scene, {.patch_count = patch_count});
    for (const NamedQuality& q : kQualities) {
      if (q.asked_part == 0) continue;
      const FormFactors f = form_factors_of(model, q.quality);
      const double error = std::abs(test::factor_between(model, f, 0, 1) - known.factor);
      report.at_most(
          known.name, model.patches.size(), q.name, "error of F", error,
          std::max(q.asked_part * known.factor, q.asked_least) + known.model_error * known.factor);
    }
  }
}

void measure_closed(const std::string& name, const PatchModel& model, Report& report) {
  for (const NamedQuality& q : kQualities) {
    if (q.asked_part == 0) continue;
    const FormFactors f = form_factors_of(model, q.quality);
    const std::size_t n = model.patches.size();
    report.at_most(name, n, q.name, "row sums before closure", f.closure.row_sum_error_before,
                   1e-3);
    report.at_most(name, n, q.name, "row sums after closure", f.closure.row_sum_error_after, 1e-6);
  }
}

void measure_rooms(Report& report) {
  Scene cube = test::empty_scene(), flat_room = test::empty_scene(), room = test::empty_scene();
  test::add_box(cube, {0, 0, 0}, {1, 1, 1}, true);
  test::add_box(flat_room, {-5, 0, 2}, {15, 2.5, 8}, true);
  test::add_box(room, {0, 0, 0}, {4, 3, 5}, true);
  test::add_box(room, {1, 0.3, 1}, {2, 1.2, 2.5}, false);
  test::add_box(room, {2.5, 1.5, 3}, {3, 2, 4}, false);
  measure_closed("cube", make_patch_model(cube, {.patch_count = 1000}), report);
  measure_closed("room 20 x 2.5 x 6", make_patch_model(flat_room, {.patch_count = 1000}), report);
  measure_closed("room with two blocks", make_patch_model(room, {.patch_count = 1000}), report);
}

/// From inside, F(i,j) = A(j) / A of a sphere. Triangles differ from it by their tessellation,
/// which their exact kernels tell: nothing hides anything in there.
void measure_sphere(int longitudes, Report& report) {
  Scene scene = test::empty_scene();
  test::add_ball(scene, longitudes, longitudes / 2, true);
  const PatchModel model = make_patch_model(scene, {.patch_count = scene.triangle.size()});
  const RayTracer tracer = make_surface_tracer(model.mesh);
  const PatchGeometry geometry(model, tracer);
  const std::size_t n = model.patches.size();
  double total = 0;
  for (const float area : model.patches.area) total += area;
  std::vector<double> sphere(n * n), exact(n * n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      sphere[i * n + j] = model.patches.area[i] * model.patches.area[j] / total;
      if (i != j) exact[i * n + j] = unoccluded_exchange_area(geometry, i, j, 1e-6);
    }
  }
  const std::string name = "sphere of " + std::to_string(model.mesh.triangle.size()) + " triangles";
  const double tessellation = form_factor_error(exact, sphere, model.patches.area);
  report.at_most(name, n, "", "kernel against A(j) / A", tessellation, 0);
  const std::vector<double> found =
      dense_exchange(form_factors_of(model, FormFactorQuality::kDefault).exchange);
  report.at_most(name, n, "default", "F against A(j) / A",
                 form_factor_error(found, sphere, model.patches.area), 1.01 * tessellation);
}

/// A scene from a file, against the reference and bare Embree.
class SceneBench {
 public:
  SceneBench(const std::string& path, const Options& options, Report& report)
      : name_(scene_name(path)),
        options_(options),
        report_(report),
        model_(model_of_scene(path, options.patch_count)),
        tracer_(make_surface_tracer(model_.mesh)) {}

  void measure_convergence() {
    const std::vector<double> light = smooth_light();
    const ExchangeReference truth =
        make_exchange_reference(model_, tracer_, light, options_.reference_factor);
    add("", "noise of the gather's reference", truth.gather_noise);
    add("", "gather, one reference against the other",
        light_error(gather(truth.exchange_area, area(), light), truth.gathered, area()));
    std::vector<std::vector<double>> matrices;
    for (const NamedQuality& q : kQualities) {
      const FormFactors f = compute_form_factors(model_, tracer_, with_quality(q.quality));
      matrices.push_back(dense_exchange(f.exchange));
      const bool asked = q.quality == FormFactorQuality::kDefault;
      add(q.name, "rays per patch",
          static_cast<double>(f.ray_count) / static_cast<double>(area().size()));
      add(q.name, "gather F B, L2",
          light_error(gather(matrices.back(), area(), light), truth.gathered, area()),
          asked ? 3e-3 : 0);
      add(q.name, "F, Frobenius", form_factor_error(matrices.back(), truth.exchange_area, area()),
          asked ? 0.03 : 0);
      add(q.name, "row sums before closure", f.closure.row_sum_error_before);
      add(q.name, "F changed by closure", f.closure.relative_change);
    }
    matrices.push_back(truth.exchange_area);
    measure_ranks(matrices);
  }

  void measure_speed() {
    const FormFactorSettings settings;
    FormFactors f = compute_form_factors(model_, tracer_, settings);
    StageSpeed speed(model_, tracer_, settings, options_.ray_limit, f.ray_count);
    std::vector<double> samples;
    for (int repeat = 0; repeat < options_.common.repeats; ++repeat) {
      samples.push_back(seconds_of([&] { compute_form_factors(model_, tracer_, settings); }));
      speed.measure_once();
    }
    const double phase = summarise(samples).minimum;
    const double escape = static_cast<double>(area().size()) * settings.hemisphere_rays;
    const double shadow = static_cast<double>(f.ray_count) - escape;
    const double traced = speed.tracer_seconds(shadow, escape, &Timing::minimum);
    const double kernel = speed.kernel_seconds(static_cast<double>(f.pair_count), &Timing::minimum);
    report_.at_least(name_, area().size(), "default", "bare Embree / traced, same rays",
                     speed.bare_seconds(shadow, escape, &Timing::minimum) / traced, 0.7);
    add("default", "kernel / phase", kernel / phase);
    add("default", "neither rays nor kernel / phase", 1 - (traced + kernel) / phase, 0.15);
  }

 private:
  const std::vector<float>& area() const { return model_.patches.area; }

  void add(const char* quality, const std::string& measure, double value, double asked = 0) {
    report_.at_most(name_, area().size(), quality, measure, value, asked);
  }

  /// Two and a half waves across the scene's diagonal, on top of a constant.
  std::vector<double> smooth_light() const {
    glm::dvec3 low(1e30), high(-1e30);
    for (const Float3& c : model_.patches.centroid) {
      low = glm::min(low, to_dvec3(c));
      high = glm::max(high, to_dvec3(c));
    }
    std::vector<double> light;
    for (const Float3& c : model_.patches.centroid) {
      const glm::dvec3 x = (to_dvec3(c) - low) / glm::max(high - low, glm::dvec3(1e-9));
      light.push_back(1.5 + std::sin(5 * std::numbers::pi * (x.x + x.y + x.z) / 3));
    }
    return light;
  }

  /// `matrices` of the qualities, and of the reference.
  void measure_ranks(const std::vector<std::vector<double>>& matrices) {
    const FarRanksByVisibility ranks = far_ranks(model_, matrices);
    for (const auto& [kind, found] : {std::pair{"clear", &ranks.clear}, {"mixed", &ranks.mixed}}) {
      const std::string what = std::string("mean rank of ") + kind + " far blocks (" +
                               std::to_string(found->block_count) + ")";
      const double truth = found->mean_rank.back();
      add("reference", what, truth);
      for (std::size_t q = 0; q < kQualities.size(); ++q) {
        const bool asked = kQualities[q].quality == FormFactorQuality::kDefault;
        add(kQualities[q].name, what, found->mean_rank[q], asked ? 1.1 * truth : 0);
      }
    }
  }

  std::string name_;
  const Options& options_;
  Report& report_;
  PatchModel model_;
  RayTracer tracer_;
};

/// From some patches to many, with links; the exponent is over the whole range.
void measure_growth(const std::string& scene, const Options& options, LinkedForm form,
                    Report& report) {
  const std::string name = scene_name(scene);
  const char* what = form == LinkedForm::kLinks ? "links" : "pairs";
  std::vector<ScalingSample> samples;
  for (const std::size_t count : options.scaling_patches) {
    const ScalingSample s = measure_scaling(scene, count, options.link_epsilon, form);
    const auto add = [&](const std::string& measure, double value, double asked = 0) {
      report.at_most(name, s.patch_count, what, measure, value, asked);
    };
    add("processor seconds of F", s.processor_seconds);
    add("seconds of F", s.wall_seconds);
    add("rays per patch", static_cast<double>(s.ray_count) / static_cast<double>(s.patch_count));
    add("entries per patch",
        static_cast<double>(s.entry_count) / static_cast<double>(s.patch_count));
    add("peak memory, GiB", s.peak_bytes / 0x1p30, 12);
    samples.push_back(s);
  }
  if (samples.size() < 2) return;
  report.at_most(name, samples.back().patch_count, what,
                 "exponent from " + std::to_string(samples.front().patch_count) + " patches",
                 scaling_exponent(samples.front(), samples.back()), 1.35);
}

void run(const Options& options) {
  Report report;
  const bool all = options.part == "all";
  if (all || options.part == "closed-forms") {
    measure_known(tabled_form_factors(options.table), 200, report);
    measure_known(hidden_form_factors(), 600, report);
    measure_rooms(report);
    for (const int longitudes : {16, 32}) measure_sphere(longitudes, report);
  }
  for (const std::string& scene : options.scenes) {
    if (options.part == "growth-of-links")
      measure_growth(scene, options, LinkedForm::kLinks, report);
    if (options.part == "growth-of-pairs")
      measure_growth(scene, options, LinkedForm::kPairs, report);
    if (options.part.starts_with("growth")) continue;
    SceneBench bench(scene, options, report);
    if (all || options.part == "convergence") bench.measure_convergence();
    if (all || options.part == "speed") bench.measure_speed();
  }
  publish("form_factors", report.table(), options.common);
}

}  // namespace
}  // namespace rebounce::bench

int main(int argc, char** argv) {
  using namespace rebounce::bench;
  Options options;
  CLI::App app("How exact form factors are, and how fast beside bare Embree", "bench_form_factors");
  app.add_option("scenes", options.scenes,
                 "Scenes (.glb or .gltf), against a reference with many rays");
  app.add_option("--patches", options.patch_count, "Patches of a scene")
      ->check(CLI::Range(1, 4000))
      ->capture_default_str();
  app.add_option("--reference", options.reference_factor,
                 "How many times the default rays the reference has")
      ->check(CLI::Range(4, 10000))
      ->capture_default_str();
  app.add_option("--table", options.table, "Table of view factors")->capture_default_str();
  app.add_option("--ray-limit", options.ray_limit, "Rays that lie ready for bare Embree at most")
      ->check(CLI::Range(1e3, 1e9))
      ->capture_default_str();
  app.add_option("--growth-patches", options.scaling_patches, "Patches of the parts growth-of-...")
      ->capture_default_str();
  app.add_option("--link-epsilon", options.link_epsilon, "Error of a link, likewise")
      ->capture_default_str();
  app.add_option("--part", options.part,
                 "What to measure; all but closed-forms for each scene; all: without growth")
      ->check(CLI::IsMember(
          {"all", "closed-forms", "convergence", "speed", "growth-of-links", "growth-of-pairs"}))
      ->capture_default_str();
  add_common_options(app, options.common);
  return run_program(app, argc, argv, options.common, [&] { run(options); });
}
