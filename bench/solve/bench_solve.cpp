// bench_solve: sweeps over every form of the form factors; and what a file promises, tried: its
// operator under many fresh lights.

#include <initializer_list>

#include "bench/solve/light_errors.h"
#include "bench/solve/sweep_times.h"
#include "bench/support/input.h"
#include "bench/support/light_changes.h"
#include "bench/support/program.h"
#include "precompute/compression/form_factor_compression.h"
#include "precompute/lights/fitting_lights.h"
#include "rebounce/error.h"

namespace rebounce::bench {
namespace {

const std::string kSweeps = "sweeps", kLightErrors = "light-errors";

struct SolveOptions {
  InputOptions input{.patch_counts = {4000}};
  std::string part = kSweeps;
  double form_factor_tolerance = 0.001;
  LightErrorSettings light_errors;
  CommonOptions common{.repeats = 7};
};

/// Those that the data hold or that can be made of all pairs, where the data hold these.
std::vector<Form> forms_of(const TransferData& data, double tolerance) {
  std::vector<Form> forms;
  if (!data.exchange.empty()) forms = exact_forms(data);
  if (!data.links.empty()) forms.push_back(links_form(data));
  if (data.compressed_form_factors) {
    forms.push_back(compressed_form("compressed", data.compressed_form_factors));
  } else if (!data.exchange.empty()) {
    const FittingLights lights = draw_fitting_lights(data, make_surface_tracer(data.mesh), 1);
    forms.push_back(compressed_form(
        compressed_name(tolerance),
        compress_form_factors(data.exchange, data.patches, radiosities_of(lights, data),
                              {tolerance, Precision::kF16})));
  }
  if (forms.empty()) throw Error("'" + scene_name(data) + "' holds no form factors");
  return forms;
}

Table table_of(const std::string& part) {
  return part == kSweeps ? make_sweep_table() : make_light_error_table();
}

void measure(const TransferData& data, const SolveOptions& options, Table& table, Table& single) {
  if (options.part == kLightErrors) {
    return measure_light_errors(data, options.light_errors, table, single);
  }
  const std::vector<Form> forms = forms_of(data, options.form_factor_tolerance);
  measure_sweeps(data, forms, light_changes(data).front().after, options.common.repeats, table);
}

void run(const SolveOptions& options) {
  Table table = table_of(options.part), single = make_single_light_table();
  for_each_input(options.input, [&](const std::shared_ptr<const TransferData>& data) {
    measure(*data, options, table, single);
    save("bench_solve", table, options.common);
    if (!options.light_errors.each.empty()) write_text(options.light_errors.each, single.csv());
  });
  publish("bench_solve", table, options.common);
}

/// Throws CLI::ValidationError if one of these is given, which `part` does not heed.
void refuse(const CLI::App& app, const std::string& part,
            std::initializer_list<const char*> options) {
  for (const char* option : options) {
    if (app.count(option) > 0) throw CLI::ValidationError(option, "is not for --part " + part);
  }
}

}  // namespace
}  // namespace rebounce::bench

int main(int argc, char** argv) {
  using namespace rebounce::bench;
  SolveOptions options;
  CLI::App app("Times sweeps, and tries operators under fresh lights.", "bench_solve");
  add_input_options(app, options.input);
  add_choice_option(
      app, "--part", options.part, {kSweeps, kLightErrors},
      "What is measured: single sweeps beside the bandwidth of memory, or errors of the "
      "operator beside its bounds");
  app.add_option("--form-factor-tolerance", options.form_factor_tolerance,
                 "Error of compressed form factors, where the input holds none")
      ->check(CLI::Range(1e-5, 0.5))
      ->capture_default_str();
  app.add_option("--lights", options.light_errors.light_count, "Lights of each kind")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  app.add_option("--seed", options.light_errors.seed, "Seed of these, not that of the build")
      ->capture_default_str();
  app.add_option("--each", options.light_errors.each,
                 "CSV file for a row of every light: its error, and how much of it arrives");
  app.add_option("--truth", options.light_errors.truth,
                 "Transfer file of the same patches, whose form factors give the truth")
      ->check(CLI::ExistingFile);
  app.add_flag("--iterate", options.light_errors.iterate,
               "Their truth by conjugate gradients alone, without an inverse");
  add_common_options(app, options.common);
  app.callback([&] {
    if (options.part == kSweeps) {
      refuse(app, kSweeps, {"--lights", "--seed", "--each", "--truth", "--iterate"});
      options.input.with_form_factors = true;
    } else {
      refuse(app, kLightErrors, {"--form-factor-tolerance", "--repeats"});
      options.input.with_truth = options.light_errors.truth.empty();
      options.common.repeats = 1;
    }
  });
  return run_program(app, argc, argv, options.common, [&] { run(options); });
}
