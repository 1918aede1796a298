// Relighting beside the bandwidth with which the same run merely reads as many bytes.

#include <omp.h>

#include <algorithm>
#include <functional>

#include "bench/input.h"
#include "bench/light_changes.h"
#include "bench/program.h"
#include "bench/read_buffer.h"
#include "bench/tile_product.h"
#include "bench/timing.h"
#include "precompute/build/build.h"
#include "precompute/inverse/dense_transfer.h"
#include "precompute/lights/random_lights.h"
#include "precompute/lights/reference_solution.h"
#include "runtime/frame/direct_lighting.h"
#include "runtime/solvers/gauss_seidel_solver.h"
#include "transfer/base/area_norm.h"
#include "transfer/base/error.h"
#include "transfer/exchange/compressed_form_factors.h"
#include "transfer/exchange/form_factor_blocks.h"
#include "transfer/format/hierarchical_storage.h"
#include "transfer/kernels/kernels.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce::bench {
namespace {

struct ApplyOptions {
  std::vector<std::string> inputs;
  BuildSettings settings;
  CommonOptions common{.repeats = 51};
};

/// The operator of `data` in f32, built anew if the data hold another.
std::shared_ptr<const DenseOperator> operator_f32(const TransferData& data) {
  auto dense = std::dynamic_pointer_cast<const DenseOperator>(data.transfer);
  if (dense && dense->storage().precision == Precision::kF32) return dense;
  return build_dense_transfer(data.exchange, data.patches, Precision::kF32);
}

std::shared_ptr<const DenseOperator> to_f16(const DenseOperator& dense) {
  DenseOperator::Storage storage = dense.storage();
  storage.precision = Precision::kF16;
  storage.tiles_f16 = SharedArray(DenseOperator::encode_half(storage.tiles_f32.span()));
  storage.tiles_f32 = {};
  return std::make_shared<const DenseOperator>(std::move(storage));
}

/// Where there are pairs, which the others are made of: in f32 and f16.
std::vector<std::shared_ptr<const DenseOperator>> dense_operators(const TransferData& data) {
  if (data.exchange.empty()) return {};
  const auto f32 = operator_f32(data);
  return {f32, to_f16(*f32)};
}

/// By pairs, or compressed where those are not kept.
std::unique_ptr<const SweepableFormFactors> sweepable_form_factors(const TransferData& data) {
  if (!data.exchange.empty()) {
    return std::make_unique<FormFactorBlocks>(data.exchange, data.patches.area);
  }
  if (!data.compressed_form_factors) {
    throw Error("'" + scene_name(data) + "' holds form factors neither by pairs nor compressed");
  }
  return std::make_unique<CompressedFormFactors>(data.compressed_form_factors);
}

/// The light that the patches send out first under one point light in the free space of the scene.
std::vector<Float3> light_one_lamp(const TransferData& data) {
  const RayTracer tracer = make_surface_tracer(data.mesh);
  DirectLighting direct(data, tracer);
  return light_of(random_point_lights(data, tracer, 1, 1).front(), data, direct);
}

/// Something to time, with what the table says about it.
struct Measure {
  std::string name, instruction_set = {}, precision = {};
  std::size_t bytes = 0;               ///< that one run must read or write at least
  double reads = 1;                    ///< of each of them, on average
  std::function<double()> error = {};  ///< of the last run's result; empty: it has none
  TimedCase timed;
};

class ApplyBenchmark {
 public:
  ApplyBenchmark(const TransferData& data, const CommonOptions& options)
      : scene_(scene_name(data)),
        patches_(data.patches),
        options_(options),
        dense_(dense_operators(data)),
        stored_(data.transfer),
        form_factors_(sweepable_form_factors(data)),
        gauss_seidel_(*form_factors_, {patches_.area, patches_.reflectance}),
        initial_exitance_(light_one_lamp(data)),
        truth_(ReferenceSolver(data).indirect_irradiance(initial_exitance_)),
        result_(patches_.size()),
        workspace_(std::max(stored_->workspace_size(), form_factors_->workspace_size())),
        read_stored_(stored_->bytes()),
        read_form_factors_(gather_bytes()) {
    for (const auto& dense : dense_) {
      workspace_.resize(std::max(workspace_.size(), dense->workspace_size()));
      read_dense_.emplace_back(dense->bytes());
    }
  }

  /// Measures everything with `threads` threads.
  void run(int threads, Table& table) {
    omp_set_num_threads(threads);
    measures_.clear();
    if (stored_->kind() != "dense") {
      add_read(read_stored_, stored_->bytes());
      const auto* blocks = dynamic_cast<const HierarchicalOperator*>(stored_.get());
      const std::string precision = blocks ? precision_name(blocks->storage().precision) : "";
      add_product("apply " + stored_->kind(), precision, *stored_);
      add_batch(precision, *stored_);
      if (blocks) add_receivers(precision, *blocks);
    }
    for (std::size_t k = 0; k < dense_.size(); ++k) add_dense(*dense_[k], read_dense_[k]);
    add_gather();
    add_gauss_seidel();

    std::vector<TimedCase> cases;
    for (const Measure& measure : measures_) cases.push_back(measure.timed);
    const std::vector<Timing> timings = time_interleaved(cases, {.rounds = options_.repeats});
    report(threads, timings, table);
  }

 private:
  std::size_t gather_bytes() const { return form_factors_->bytes() + 2 * vector_bytes(); }
  std::size_t vector_bytes() const { return patches_.size() * sizeof(Float3); }

  std::string form_factor_precision() const {
    const auto* compressed = dynamic_cast<const CompressedFormFactors*>(form_factors_.get());
    return compressed ? precision_name(compressed->exchange().storage().precision) : "f32";
  }

  double error_of(std::span<const Float3> indirect_irradiance) const {
    return relative_difference(indirect_irradiance, truth_, patches_.area);
  }

  void add_read(ReadBuffer& buffer, std::size_t bytes) {
    measures_.push_back(
        {.name = "read", .bytes = bytes, .timed = {.work = [&buffer] { buffer.read(); }}});
  }

  void add_product(const std::string& what, const std::string& precision,
                   const TransferOperator& transfer) {
    const auto apply = [this, &transfer] {
      transfer.apply(initial_exitance_, result_, workspace_);
    };
    const auto apply_error = [this, apply] {
      apply();
      return error_of(result_);
    };
    measures_.push_back({.name = what,
                         .instruction_set = kernels().instruction_set,
                         .precision = precision,
                         .bytes = transfer.bytes(),
                         .reads = static_cast<double>(transfer.bytes_per_apply()) /
                                  static_cast<double>(transfer.bytes()),
                         .error = apply_error,
                         .timed = {.work = apply}});
  }

  /// kBatch lights at once; the error is that of the last.
  void add_batch(const std::string& precision, const TransferOperator& transfer) {
    constexpr std::size_t kBatch = 4;
    struct Batch {
      std::vector<Float3> light, result;
      std::vector<float> workspace;
    };
    const auto batch = std::make_shared<Batch>();
    for (std::size_t k = 0; k < kBatch; ++k) {
      batch->light.insert(batch->light.end(), initial_exitance_.begin(), initial_exitance_.end());
    }
    batch->result.resize(batch->light.size());
    batch->workspace.resize(transfer.batch_workspace_size(kBatch));
    const auto apply = [batch, &transfer] {
      transfer.apply_batch(kBatch, batch->light, batch->result, batch->workspace);
    };
    const auto error = [this, apply, batch] {
      apply();
      return error_of(std::span(batch->result).last(patches_.size()));
    };
    measures_.push_back({.name = "batch of 4",
                         .instruction_set = kernels().instruction_set,
                         .precision = precision,
                         .bytes = transfer.bytes(),
                         .error = error,
                         .timed = {.work = apply}});
  }

  /// To an eighth of the patches, neighbours all; the error counts the others as found.
  void add_receivers(const std::string& precision, const HierarchicalOperator& blocks) {
    const std::vector<std::uint32_t>& order = blocks.storage().patch;
    const auto receivers = std::make_shared<HierarchicalOperator::Receivers>(
        blocks.receivers(std::span(order).first((order.size() + 7) / 8)));
    const std::uint64_t whole = blocks.receivers(order).value_count();
    const auto apply = [this, receivers, &blocks] {
      blocks.apply_to(*receivers, initial_exitance_, result_, workspace_);
    };
    const auto error = [this, apply] {
      result_ = truth_;
      apply();
      return error_of(result_);
    };
    measures_.push_back(
        {.name = "apply to 1/8",
         .instruction_set = kernels().instruction_set,
         .precision = precision,
         .bytes = static_cast<std::size_t>(static_cast<double>(blocks.bytes()) *
                                           static_cast<double>(receivers->value_count()) /
                                           static_cast<double>(whole)),
         .error = error,
         .timed = {.work = apply}});
  }

  void add_dense(const DenseOperator& dense, ReadBuffer& read) {
    const Precision precision = dense.storage().precision;
    add_read(read, dense.bytes());
    add_product("apply dense", precision_name(precision), dense);
    for (const KernelSet* set : kernel_sets()) add_tiles(dense, *set);
  }

  void add_tiles(const DenseOperator& dense, const KernelSet& set) {
    const auto product = std::make_shared<TileProduct>(dense, set.dense, initial_exitance_);
    const auto multiply = [product] { product->run(); };
    const auto error = [this, product] { return error_of(product->indirect_irradiance()); };
    measures_.push_back({.name = "tiles alone",
                         .instruction_set = set.instruction_set,
                         .precision = precision_name(dense.storage().precision),
                         .bytes = dense.bytes(),
                         .error = error,
                         .timed = {.work = multiply}});
  }

  void add_gather() {
    add_read(read_form_factors_, gather_bytes());
    const auto gather = [this] { form_factors_->gather(initial_exitance_, result_, workspace_); };
    const auto first_bounce_error = [this, gather] {
      gather();
      return error_of(result_);
    };
    measures_.push_back({.name = "gather",
                         .precision = form_factor_precision(),
                         .bytes = gather_bytes(),
                         .error = first_bounce_error,
                         .timed = {.work = gather}});
  }

  void add_gauss_seidel() {
    const SolveSettings one_sweep{.max_sweeps = 1, .residual = 0, .measure_residual = false};
    const auto start = [this] { gauss_seidel_.reset(); };
    const auto sweep = [this, one_sweep] { gauss_seidel_.solve(initial_exitance_, one_sweep); };
    const auto error = [this, start, sweep] {
      start();
      sweep();
      std::vector<Float3> gathered(patches_.size());
      form_factors_->gather(gauss_seidel_.radiosity(), gathered, workspace_);
      return error_of(gathered);
    };
    measures_.push_back({.name = "Gauss-Seidel sweep",
                         .precision = form_factor_precision(),
                         .bytes = form_factors_->bytes() + 4 * vector_bytes(),
                         .error = error,
                         .timed = {.work = sweep, .prepare = start}});
  }

  static Table::Cell text(const std::string& value) {
    return value.empty() ? Table::Cell() : Table::Cell(value);
  }

  void report(int threads, const std::vector<Timing>& timings, Table& table) const {
    double read_seconds = 0;
    for (std::size_t k = 0; k < measures_.size(); ++k) {
      const Measure& measure = measures_[k];
      const Timing& time = timings[k];
      const bool is_read = !measure.error;
      if (is_read) read_seconds = time.median;  // each read comes before what is measured by it
      const double of_read = read_seconds / time.median;
      table.add({scene_, patches_.size(), threads, measure.name, text(measure.instruction_set),
                 text(measure.precision), time.median * 1e6, time.spread, measure.bytes,
                 measure.reads * static_cast<double>(measure.bytes) / time.median / 1e9,
                 is_read ? Table::Cell() : Table::Cell(of_read),
                 is_read ? Table::Cell() : Table::Cell(measure.reads * of_read),
                 is_read ? Table::Cell() : Table::Cell(measure.error())});
    }
  }

  std::string scene_;
  const PatchTable& patches_;
  const CommonOptions& options_;
  std::vector<std::shared_ptr<const DenseOperator>> dense_;
  std::shared_ptr<const TransferOperator> stored_;  ///< the file's own, of any kind
  std::unique_ptr<const SweepableFormFactors> form_factors_;
  GaussSeidelSolver gauss_seidel_;
  std::vector<Float3> initial_exitance_, truth_, result_;
  std::vector<float> workspace_;
  ReadBuffer read_stored_, read_form_factors_;
  std::vector<ReadBuffer> read_dense_;  ///< one for each
  std::vector<Measure> measures_;
};

void run(const ApplyOptions& options) {
  Table table({"scene", "patches", "threads", "measure", "instructions", "precision",
               "microseconds", "spread", "bytes", "GB/s", "of read", "bandwidth of read", "error"});
  for (const std::string& input : options.inputs) {
    const TransferData data = load_or_build(input, options.settings);
    ApplyBenchmark benchmark(data, options.common);
    run_at_thread_counts(options.common, [&](int threads) { benchmark.run(threads, table); });
  }
  publish("apply", table, options.common);
}

}  // namespace
}  // namespace rebounce::bench

int main(int argc, char** argv) {
  rebounce::bench::ApplyOptions options;
  options.settings.store_form_factors = true;
  CLI::App app("Times a relight beside the bandwidth of memory in the same run.", "bench_apply");
  rebounce::bench::add_input_option(app, options.inputs);
  rebounce::bench::add_patch_option(app, options.settings.subdivision.patch_count);
  add_common_options(app, options.common);
  return rebounce::bench::run_program(app, argc, argv, options.common,
                                      [&] { rebounce::bench::run(options); });
}
