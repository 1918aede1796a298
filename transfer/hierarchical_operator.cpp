#include "rebounce/transfer/hierarchical_operator.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include "block_kernels.h"
#include "hierarchical_plan.h"
#include "hierarchical_storage.h"
#include "rebounce/transfer/error.h"

namespace rebounce {
namespace {

// Of the vectors in the workspace, in floats: a cache line.
constexpr std::size_t kLine = 16;

std::size_t round_up(std::size_t size, std::size_t multiple) {
  return (size + multiple - 1) / multiple * multiple;
}

/// The vectors of an apply, three to each light.
struct WorkVectors {
  PlanarVectors<float> x;             ///< by position, times the root of the area
  PlanarVectors<float> coefficients;  ///< of x in the bases
  PlanarVectors<float> products;      ///< of cores and dense blocks
  PlanarVectors<float> y;             ///< by position, what arrives

  WorkVectors(std::size_t positions, const HierarchicalLayout& layout, std::size_t light_count,
              float* buffer) {
    const auto take = [&](std::size_t size) {
      const PlanarVectors<float> taken{buffer, round_up(size, kLine), kChannelCount * light_count};
      buffer += taken.stride * taken.count;
      return taken;
    };
    x = take(positions);
    coefficients = take(layout.coefficient_count);
    products = take(layout.product_count);
    y = take(positions);
  }

  static std::size_t size(std::size_t positions, const HierarchicalLayout& layout,
                          std::size_t light_count) {
    return (2 * round_up(positions, kLine) + round_up(layout.coefficient_count, kLine) +
            round_up(layout.product_count, kLine)) *
           kChannelCount * light_count;
  }
};

template <typename T>
PlanarVectors<const float> from(const PlanarVectors<T>& vectors, std::size_t begin) {
  return {vectors.data + begin, vectors.stride, vectors.count};
}

PlanarVectors<float> to(const PlanarVectors<float>& vectors, std::size_t begin) {
  return {vectors.data + begin, vectors.stride, vectors.count};
}

/// The vectors of one channel of all lights.
template <typename T>
PlanarVectors<T> channel_of(const PlanarVectors<T>& vectors, std::size_t channel) {
  return {vectors.data + channel * vectors.stride, kChannelCount * vectors.stride,
          vectors.count / kChannelCount};
}

/// The phases of an apply, one entry of the plan at a time.
template <typename Basis, typename Value>
class Phases {
 public:
  Phases(const BasisKernels<Basis>& bases, const CoreKernels<Value>& cores, const Basis* basis,
         const Value* value, const std::array<std::uint32_t, kChannelCount>& channel_matrix,
         const WorkVectors& work)
      : bases_(bases),
        cores_(cores),
        basis_(basis),
        value_(value),
        channel_matrix_(channel_matrix),
        work_(work) {}

  void project(const HierarchicalPlan::Projection& p) const {
    bases_.project(basis_ + p.basis, p.rank, p.size, from(work_.x, p.begin),
                   to(work_.coefficients, p.coefficient));
  }

  void multiply(const HierarchicalPlan::Core& core) const {
    const PlanarVectors<float>& in = core.dense ? work_.x : work_.coefficients;
    const std::size_t size = std::size_t{core.rows} * core.columns;
    const auto product = kernel(core.direction);
    for (std::size_t c = 0; c < kChannelCount; ++c) {
      const CoreVectors vectors{.row_in = channel_of(from(in, core.row_in), c),
                                .column_in = channel_of(from(in, core.column_in), c),
                                .row_out = channel_of(to(work_.products, core.row_out), c),
                                .column_out = channel_of(to(work_.products, core.column_out), c)};
      product(value_ + core.values + channel_matrix_[c] * size, core.rows, core.columns, vectors);
    }
  }

  void expand(const HierarchicalPlan::Expansion& e) const {
    if (e.rank == 0) return add_products(e);
    bases_.expand(basis_ + e.basis, e.rank, e.size, e.count, from(work_.products, e.coefficient),
                  to(work_.y, e.begin));
  }

 private:
  typename CoreKernels<Value>::Product kernel(HierarchicalPlan::Direction direction) const {
    switch (direction) {
      case HierarchicalPlan::Direction::kToRows:
        return cores_.to_rows;
      case HierarchicalPlan::Direction::kToColumns:
        return cores_.to_columns;
      case HierarchicalPlan::Direction::kBoth:
        break;
    }
    return cores_.both;
  }

  void add_products(const HierarchicalPlan::Expansion& e) const {
    for (std::size_t v = 0; v < work_.y.count; ++v) {
      float* y = work_.y.data + v * work_.y.stride + e.begin;
      const float* product = work_.products.data + v * work_.products.stride + e.coefficient;
      for (std::size_t k = 0; k < e.count; ++k) y[k] += product[k];
    }
  }

  const BasisKernels<Basis>& bases_;
  const CoreKernels<Value>& cores_;
  const Basis* basis_;
  const Value* value_;
  const std::array<std::uint32_t, kChannelCount>& channel_matrix_;
  const WorkVectors& work_;
};

/// Takes the light of the patches into x and what arrives out of y.
class Exchange {
 public:
  Exchange(std::span<const std::uint32_t> patch, std::span<const float> sqrt_area, float scale,
           const WorkVectors& work)
      : patch_(patch), sqrt_area_(sqrt_area), scale_(scale), work_(work) {}

  void gather(std::span<const Float3> light, std::size_t position) const {
    const std::size_t n = patch_.size();
    for (std::size_t v = 0; v < work_.x.count; v += kChannelCount) {
      const Float3* of_light = light.data() + v / kChannelCount * n;
      float* x = work_.x.data + v * work_.x.stride + position;
      for (int c = 0; c < kChannelCount; ++c) {
        x[c * work_.x.stride] =
            position < n ? sqrt_area_[position] * of_light[patch_[position]][c] : 0;
      }
    }
  }

  void scatter(std::size_t position, std::span<Float3> light) const {
    const std::size_t n = patch_.size();
    const float factor = scale_ / sqrt_area_[position];
    for (std::size_t v = 0; v < work_.y.count; v += kChannelCount) {
      Float3* of_light = light.data() + v / kChannelCount * n;
      const float* y = work_.y.data + v * work_.y.stride + position;
      for (int c = 0; c < kChannelCount; ++c) {
        of_light[patch_[position]][c] = y[c * work_.y.stride] * factor;
      }
    }
  }

 private:
  std::span<const std::uint32_t> patch_;
  std::span<const float> sqrt_area_;
  float scale_;
  const WorkVectors& work_;
};

void clear(const PlanarVectors<float>& vectors, std::size_t begin, std::size_t end) {
  for (std::size_t v = 0; v < vectors.count; ++v) {
    float* const data = vectors.data + v * vectors.stride;
    std::fill(data + begin, data + end, 0.0F);
  }
}

template <typename Basis, typename Value>
void run_plan(const HierarchicalPlan& plan, const Phases<Basis, Value>& phases,
              const Exchange& exchange, const WorkVectors& work,
              std::span<const Float3> initial_exitance, std::span<Float3> indirect_irradiance) {
#pragma omp parallel
  {
#pragma omp for schedule(static)
    for (std::size_t k = 0; k < work.x.stride; ++k) exchange.gather(initial_exitance, k);
#pragma omp for schedule(dynamic, 1)
    for (std::size_t part = 0; part < plan.projection_parts.size() - 1; ++part) {
      for (std::uint32_t k = plan.projection_parts[part]; k < plan.projection_parts[part + 1];
           ++k) {
        phases.project(plan.projections[k]);
      }
    }
#pragma omp for schedule(dynamic, 1)
    for (std::size_t part = 0; part < plan.core_parts.size() - 1; ++part) {
      for (std::uint32_t k = plan.core_parts[part]; k < plan.core_parts[part + 1]; ++k) {
        phases.multiply(plan.cores[k]);
      }
    }
#pragma omp for schedule(dynamic, 1)
    for (const HierarchicalPlan::Arrival& arrival : plan.arrivals) {
      clear(work.y, arrival.begin, arrival.end);
      for (std::uint32_t k = arrival.first_expansion; k < arrival.last_expansion; ++k) {
        phases.expand(plan.expansions[k]);
      }
      for (std::uint32_t k = arrival.first_target; k < arrival.last_target; ++k) {
        exchange.scatter(plan.targets[k], indirect_irradiance);
      }
    }
  }
}

}  // namespace

std::uint64_t HierarchicalOperator::Receivers::value_count() const {
  return plan_->value_count;
}

std::size_t HierarchicalOperator::position_count(std::size_t patch_count) {
  return round_up(patch_count, kAlignment);
}

HierarchicalOperator::HierarchicalOperator(Storage storage)
    : storage_(stream(storage)),
      layout_(std::make_shared<HierarchicalLayout>(storage_.blocks, storage_.matrix_count)) {
  sqrt_area_.reserve(patch_count());
  for (const std::uint32_t p : storage_.patch) sqrt_area_.push_back(std::sqrt(storage_.area[p]));
  std::vector<std::uint32_t> all(patch_count());
  std::iota(all.begin(), all.end(), 0U);
  plan_ = std::make_shared<HierarchicalPlan>(storage_, *layout_, std::move(all));
}

std::size_t HierarchicalOperator::bytes() const {
  return storage_.values_f16.size_bytes() + storage_.values_f32.size_bytes() +
         storage_.blocks.size() * sizeof(TransferBlock) +
         storage_.patch.size() * sizeof(std::uint32_t);
}

std::size_t HierarchicalOperator::batch_workspace_size(std::size_t light_count) const {
  return WorkVectors::size(position_count(patch_count()), *layout_, light_count) + kLine;
}

void HierarchicalOperator::run(const HierarchicalPlan& plan, std::size_t light_count,
                               std::span<const Float3> initial_exitance,
                               std::span<Float3> indirect_irradiance,
                               std::span<float> workspace) const {
  assert(initial_exitance.size() == light_count * patch_count());
  assert(indirect_irradiance.size() == light_count * patch_count());
  assert(workspace.size() >= batch_workspace_size(light_count));
  // The workspace has room for one line more than its vectors, so that they may begin with one.
  const std::size_t misplaced = reinterpret_cast<std::uintptr_t>(workspace.data()) / sizeof(float);
  float* const aligned = workspace.data() + (kLine - misplaced % kLine) % kLine;
  const WorkVectors work(position_count(patch_count()), *layout_, light_count, aligned);
  const BlockKernelSet& kernels = block_kernels();
  const auto apply_phases = [&](const auto& bases, const auto& cores, const auto* values,
                                float scale) {
    const Phases phases(bases, cores, values, values, storage_.channel_matrix, work);
    const Exchange exchange(storage_.patch, sqrt_area_, scale, work);
    run_plan(plan, phases, exchange, work, initial_exitance, indirect_irradiance);
  };
  if (storage_.precision == Precision::kF16) {
    apply_phases(kernels.bases_f16, kernels.cores_f16, storage_.values_f16.data(),
                 1.0F / kHalfScale);
  } else {
    apply_phases(kernels.bases_f32, kernels.cores_f32, storage_.values_f32.data(), 1.0F);
  }
}

void HierarchicalOperator::apply(std::span<const Float3> initial_exitance,
                                 std::span<Float3> indirect_irradiance,
                                 std::span<float> workspace) const {
  run(*plan_, 1, initial_exitance, indirect_irradiance, workspace);
}

void HierarchicalOperator::apply_batch(std::size_t light_count,
                                       std::span<const Float3> initial_exitance,
                                       std::span<Float3> indirect_irradiance,
                                       std::span<float> workspace) const {
  run(*plan_, light_count, initial_exitance, indirect_irradiance, workspace);
}

HierarchicalOperator::Receivers HierarchicalOperator::receivers(
    std::span<const std::uint32_t> patches) const {
  std::vector<bool> wanted(patch_count());
  for (const std::uint32_t p : patches) {
    if (p >= patch_count()) {
      throw Error("hierarchical operator: receiver " + std::to_string(p) +
                  " does not exist; there are " + std::to_string(patch_count()) + " patches");
    }
    wanted[p] = true;
  }
  std::vector<std::uint32_t> positions;
  for (std::uint32_t k = 0; k < patch_count(); ++k) {
    if (wanted[storage_.patch[k]]) positions.push_back(k);
  }
  return Receivers(std::make_shared<HierarchicalPlan>(storage_, *layout_, std::move(positions)));
}

void HierarchicalOperator::apply_to(const Receivers& receivers,
                                    std::span<const Float3> initial_exitance,
                                    std::span<Float3> indirect_irradiance,
                                    std::span<float> workspace) const {
  run(*receivers.plan_, 1, initial_exitance, indirect_irradiance, workspace);
}

void HierarchicalOperator::expand(int channel, std::span<float> transfer) const {
  const std::size_t n = patch_count();
  assert(transfer.size() == n * n);
  std::ranges::fill(transfer, 0.0F);
  const auto put = [&](std::size_t i, std::size_t j, double value) {
    const std::size_t row = storage_.patch[i], column = storage_.patch[j];
    transfer[row * n + column] = static_cast<float>(value * sqrt_area_[j] / sqrt_area_[i]);
  };
  for (std::size_t b = 0; b < storage_.blocks.size(); ++b) {
    const TransferBlock& block = storage_.blocks[b];
    const std::vector<double> entries =
        block_entries(storage_, *layout_, b, storage_.channel_matrix[channel]);
    for (std::size_t r = 0; r < block.row_count; ++r) {
      for (std::size_t c = 0; c < block.column_count; ++c) {
        const std::size_t i = block.row_begin + r, j = block.column_begin + c;
        if (i >= n || j >= n) continue;
        put(i, j, entries[r * block.column_count + c]);
        if (!block.on_diagonal()) put(j, i, entries[r * block.column_count + c]);
      }
    }
  }
}

}  // namespace rebounce
