#include "bench/solve/sweep_times.h"

#include <functional>

#include "bench/support/input.h"
#include "bench/support/read_buffer.h"
#include "bench/support/timing.h"
#include "transfer/exchange/relaxation.h"

namespace rebounce::bench {
namespace {

struct Sweep {
  std::string form, name;
  double bytes = 0;  ///< of F, each counted as often as it is read
  std::function<void()> work;
  std::shared_ptr<ReadBuffer> stored;  ///< of the size of F
  double stored_bytes = 0;
};

class SweepList {
 public:
  SweepList(const TransferData& data, std::span<const Float3> light)
      : data_(data), light_(light), result_(light.size()) {}

  void add(const Form& form) {
    add_gather(form);
    const auto* sweepable = dynamic_cast<const SweepableFormFactors*>(form.form_factors.get());
    if (sweepable == nullptr) return;
    for (const SweepOrder order : {SweepOrder::kForward, SweepOrder::kSymmetric}) {
      add_relaxation(form, *sweepable, order);
    }
  }

  const std::vector<Sweep>& sweeps() const { return sweeps_; }

 private:
  void add_gather(const Form& form) {
    const FormFactorOperator& form_factors = *form.form_factors;
    const auto workspace = std::make_shared<std::vector<float>>(form_factors.workspace_size());
    add(form, "gather", form_factors.bytes_per_gather(),
        [this, &form_factors, workspace] { form_factors.gather(light_, result_, *workspace); });
  }

  void add_relaxation(const Form& form, const SweepableFormFactors& sweepable, SweepOrder order) {
    const std::shared_ptr<Relaxation> relaxation = sweepable.make_relaxation();
    relaxation->begin({data_.patches.area, data_.patches.reflectance, light_}, light_);
    const std::size_t bytes = form.form_factors->bytes() * relaxation->reads_per_sweep(order);
    const bool symmetric = order == SweepOrder::kSymmetric;
    const auto work = [relaxation, symmetric, backward = false]() mutable {
      relaxation->sweep(backward ? SweepDirection::kBackward : SweepDirection::kForward);
      if (symmetric) backward = !backward;
    };
    add(form, symmetric ? "symmetric-gauss-seidel" : "gauss-seidel", bytes, work);
  }

  void add(const Form& form, const std::string& name, std::size_t bytes,
           const std::function<void()>& work) {
    const std::size_t stored = form.form_factors->bytes();
    sweeps_.push_back({form.name, name, static_cast<double>(bytes), work,
                       std::make_shared<ReadBuffer>(stored), static_cast<double>(stored)});
  }

  const TransferData& data_;
  std::span<const Float3> light_;
  std::vector<Float3> result_;
  std::vector<Sweep> sweeps_;
};

}  // namespace

Table make_sweep_table() {
  return Table({"scene", "patches", "form", "sweep", "bytes", "bytes per patch", "microseconds",
                "spread", "GB/s", "of read", "of memory"});
}

void measure_sweeps(const TransferData& data, std::span<const Form> forms,
                    std::span<const Float3> light, int rounds, Table& table) {
  SweepList list(data, light);
  for (const Form& form : forms) list.add(form);
  std::vector<TimedCase> cases;
  for (const Sweep& sweep : list.sweeps()) {
    cases.push_back({.work = [&sweep] { sweep.stored->read(); }});
    cases.push_back({.work = sweep.work});
  }
  const double memory_bandwidth = measure_memory_bandwidth();
  const std::vector<Timing> timings = time_interleaved(cases, {.rounds = rounds});
  for (std::size_t k = 0; k < list.sweeps().size(); ++k) {
    const Sweep& sweep = list.sweeps()[k];
    const Timing &read = timings[2 * k], &time = timings[2 * k + 1];
    const double rate = sweep.bytes / time.median;
    table.add({scene_name(data), data.patches.size(), sweep.form, sweep.name, sweep.bytes,
               sweep.bytes / static_cast<double>(data.patches.size()), time.median * 1e6,
               time.spread, rate / 1e9, rate * read.median / sweep.stored_bytes,
               rate / memory_bandwidth});
  }
}

}  // namespace rebounce::bench
