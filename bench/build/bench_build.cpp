// bench_build: what the offline stage takes, phase by phase, and how that grows with the number of
// patches.

#include <cmath>
#include <map>

#include "bench/support/input.h"
#include "bench/support/machine.h"
#include "bench/support/program.h"
#include "bench/support/timing.h"
#include "precompute/base/process_memory.h"

namespace rebounce::bench {
namespace {

struct BuildOptions {
  InputOptions input{.patch_counts = {1000, 4000}};
  CommonOptions common{.repeats = 1};
};

/// What is measured of builds of one scene, from few patches to many.
class SceneBuilds {
 public:
  SceneBuilds(std::string scene, BuildSettings settings, int repeats)
      : scene_(std::move(scene)), settings_(std::move(settings)), repeats_(repeats) {}

  void measure(std::size_t patch_count, Table& table) {
    settings_.subdivision.patch_count = patch_count;
    BuildReport report;
    TransferData data;
    std::map<std::string, std::vector<double>> seconds;
    for (int repeat = 0; repeat < repeats_; ++repeat) {
      report = {};
      data = {};  // else two of them are in memory
      const double before = processor_seconds();
      const double whole =
          seconds_of([&] { data = build_transfer_data(scene_, settings_, report); });
      seconds["whole"].push_back(whole);
      seconds["processor time"].push_back(processor_seconds() - before);
      for (const auto& [phase, taken] : report.seconds) seconds[phase].push_back(taken);
    }
    table_ = &table;
    patch_count_ = data.patches.size();
    const auto n = static_cast<double>(patch_count_);
    for (const auto& [phase, taken] : report.seconds) add_seconds(phase, seconds.at(phase));
    for (const char* all : {"whole", "processor time"}) add_seconds(all, seconds.at(all));
    add("rays", static_cast<double>(report.ray_count) / n, "per patch");
    add("pairs that face each other", static_cast<double>(report.pair_count) / n, "per patch");
    add("form factors that are not 0", static_cast<double>(report.form_factor_count) / n,
        "per patch");
    add("row sums before closure", report.closure.row_sum_error_before, "error");
    add("operator", static_cast<double>(data.transfer->bytes()) / n, "bytes per patch");
    add("operator, mean", data.record.error_mean, "error");
    add("operator, bound", data.record.error_bound, "error");
    add("peak memory of the process", static_cast<double>(peak_memory_bytes()) / 0x1p30, "GiB");
  }

 private:
  void add_seconds(const std::string& phase, const std::vector<double>& taken) {
    add(phase, summarise(taken).median, "s");
  }

  /// With the exponent of its growth since the number of patches before.
  void add(const std::string& measure, double value, const char* unit) {
    if (value == 0) return;
    Table::Cell growth;
    const auto n = static_cast<double>(patch_count_);
    if (const auto before = before_.find(measure); before != before_.end()) {
      const auto& [patches, other] = before->second;
      if (patches != n) growth = std::log(value / other) / std::log(n / patches);
    }
    before_[measure] = {n, value};
    table_->add({scene_name(scene_), patch_count_, measure, value, unit, growth});
  }

  std::string scene_;
  BuildSettings settings_;
  int repeats_;
  Table* table_ = nullptr;
  std::size_t patch_count_ = 0;
  std::map<std::string, std::pair<double, double>> before_;  ///< patches and value
};

void run(const BuildOptions& options) {
  require_scenes(options.input);
  Table table({"scene", "patches", "measure", "value", "unit", "growth"});
  for (const std::string& scene : options.input.inputs) {
    SceneBuilds builds(scene, options.input.settings, options.common.repeats);
    for (const std::size_t patch_count : options.input.patch_counts) {
      builds.measure(patch_count, table);
      save("bench_build", table, options.common);
    }
  }
  publish("bench_build", table, options.common);
}

}  // namespace
}  // namespace rebounce::bench

int main(int argc, char** argv) {
  using namespace rebounce::bench;
  BuildOptions options;
  CLI::App app("Times the offline stage by phase, with rays and memory.", "bench_build");
  add_input_options(app, options.input)->description("Scenes (.glb, .gltf)");
  add_common_options(app, options.common);
  return run_program(app, argc, argv, options.common, [&] { run(options); });
}
