// bench_apply: relighting beside the bandwidth with which the same run merely reads as many bytes.

#include <functional>

#include "bench/support/input.h"
#include "bench/support/light_changes.h"
#include "bench/support/program.h"
#include "bench/support/read_buffer.h"
#include "bench/support/timing.h"
#include "precompute/lights/random_lights.h"
#include "transfer/format/hierarchical_storage.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce::bench {
namespace {

constexpr std::size_t kBatch = 4;  // lights at once

struct ApplyOptions {
  InputOptions input{.patch_counts = {4000}};
  CommonOptions common{.repeats = 51};
};

/// The light that the patches send out first under one point light in the free space of the scene.
std::vector<Float3> light_one_lamp(const TransferData& data) {
  const RayTracer tracer = make_surface_tracer(data.mesh);
  DirectLighting direct(data, tracer);
  return light_of(random_point_lights(data, tracer, 1, 1).front(), data, direct);
}

/// Something to time, with what the table says about it.
struct Measure {
  std::string name;
  double bytes = 0;  ///< of the operator that one run must read at least
  double reads = 1;  ///< of each of them, on average
  std::function<void()> work;
};

class ApplyBenchmark {
 public:
  ApplyBenchmark(std::shared_ptr<const TransferData> data, double memory_bandwidth)
      : data_(std::move(data)),
        transfer_(*data_->transfer),
        memory_bandwidth_(memory_bandwidth),
        light_(light_one_lamp(*data_)),
        result_(light_.size()),
        workspace_(transfer_.workspace_size()),
        batch_result_(kBatch * light_.size()),
        batch_workspace_(transfer_.batch_workspace_size(kBatch)),
        buffer_(transfer_.bytes()) {
    for (std::size_t k = 0; k < kBatch; ++k) {
      batch_light_.insert(batch_light_.end(), light_.begin(), light_.end());
    }
    list_measures();
  }

  void run(int threads, int rounds, Table& table) {
    std::vector<TimedCase> cases;
    for (const Measure& measure : measures_) cases.push_back({.work = measure.work});
    const std::vector<Timing> timings = time_interleaved(cases, {.rounds = rounds});
    const double read_rate = measures_.front().bytes / timings.front().median;
    for (std::size_t k = 0; k < measures_.size(); ++k) {
      const Measure& measure = measures_[k];
      const Timing& time = timings[k];
      const double rate = measure.reads * measure.bytes / time.median;
      const auto n = static_cast<double>(data_->patches.size());
      table.add({scene_name(*data_), data_->patches.size(), operator_name(transfer_.kind()),
                 data_->record.error_mean, threads, measure.name, time.median * 1e6, time.spread,
                 measure.bytes, measure.bytes / n, rate / 1e9, rate / read_rate,
                 rate / memory_bandwidth_});
    }
  }

 private:
  void list_measures() {
    const auto bytes = static_cast<double>(transfer_.bytes());
    const double reads = static_cast<double>(transfer_.bytes_per_apply()) / bytes;
    measures_.push_back({"read", bytes, 1, [this] { buffer_.read(); }});
    measures_.push_back(
        {"apply", bytes, reads, [this] { transfer_.apply(light_, result_, workspace_); }});
    measures_.push_back(
        {"batch of 4", bytes, reads,
         [this] { transfer_.apply_batch(kBatch, batch_light_, batch_result_, batch_workspace_); }});
    if (const auto* blocks = dynamic_cast<const HierarchicalOperator*>(&transfer_)) {
      add_receivers(*blocks, bytes, reads);
    }
  }

  /// To an eighth of the patches, neighbours all.
  void add_receivers(const HierarchicalOperator& blocks, double bytes, double reads) {
    const std::vector<std::uint32_t>& order = blocks.storage().patch;
    const auto some = std::make_shared<const HierarchicalOperator::Receivers>(
        blocks.receivers(std::span(order).first((order.size() + 7) / 8)));
    const double part = static_cast<double>(some->value_count()) /
                        static_cast<double>(blocks.receivers(order).value_count());
    measures_.push_back({"apply to 1/8", part * bytes, reads, [this, some, &blocks] {
                           blocks.apply_to(*some, light_, result_, workspace_);
                         }});
  }

  std::shared_ptr<const TransferData> data_;
  const TransferOperator& transfer_;
  double memory_bandwidth_;  ///< bytes per second
  std::vector<Float3> light_, result_;
  std::vector<float> workspace_;
  std::vector<Float3> batch_light_, batch_result_;
  std::vector<float> batch_workspace_;
  ReadBuffer buffer_;
  std::vector<Measure> measures_;
};

void run(const ApplyOptions& options) {
  Table table({"scene", "patches", "operator", "error", "threads", "measure", "microseconds",
               "spread", "bytes", "bytes per patch", "GB/s", "of read", "of memory"});
  for_each_input(options.input, [&](const std::shared_ptr<const TransferData>& data) {
    run_at_thread_counts(options.common, [&](int threads) {
      ApplyBenchmark(data, measure_memory_bandwidth()).run(threads, options.common.repeats, table);
    });
    save("bench_apply", table, options.common);
  });
  publish("bench_apply", table, options.common);
}

}  // namespace
}  // namespace rebounce::bench

int main(int argc, char** argv) {
  rebounce::bench::ApplyOptions options;
  CLI::App app("Times a relight beside the bandwidth of memory in the same run.", "bench_apply");
  rebounce::bench::add_input_options(app, options.input);
  add_common_options(app, options.common);
  return rebounce::bench::run_program(app, argc, argv, options.common,
                                      [&] { rebounce::bench::run(options); });
}
