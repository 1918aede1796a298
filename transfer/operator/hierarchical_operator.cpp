#include "transfer/operator/hierarchical_operator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "rebounce/error.h"
#include "transfer/base/argument_check.h"
#include "transfer/format/hierarchical_encoding.h"
#include "transfer/format/hierarchical_values.h"
#include "transfer/kernels/block_kernels.h"
#include "transfer/kernels/kernels_of_storage.h"
#include "transfer/operator/hierarchical_plan.h"
#include "transfer/operator/light_of_patches.h"
#include "transfer/operator/work_vectors.h"

namespace rebounce {
namespace {

// Positions that one task gathers.
constexpr std::size_t kPositionsPerTask = 1024;

// Ends of dense blocks, and cluster bases, that one task handles.
constexpr std::size_t kDenseEndsPerTask = 64, kClusterBasesPerTask = 32;

/// Entries [first, last) of `all`.
template <typename T>
std::span<const T> between(const std::vector<T>& all, std::uint32_t first, std::uint32_t last) {
  return std::span(all).subspan(first, last - first);
}

/// The phases of an apply.
class Phases {
 public:
  Phases(const BasisProducts& bases, const CouplingProducts& couplings, const ChannelLanes& lanes,
         std::span<const float> coefficient_scale, const WorkVectors& work)
      : bases_(bases),
        couplings_(couplings),
        lanes_(lanes),
        basis_scale_(bases.scale()),
        coefficient_scale_(coefficient_scale),
        work_(work) {}

  /// Measures the light at positions.
  void measure(std::size_t begin, std::size_t end) const {
    for (std::size_t light = 0; light < work_.light_count; ++light) {
      bases_.measure(work_.x.data + light * kChannelCount * work_.x.stride + begin, work_.x.stride,
                     end - begin, work_.runs_at(light, begin));
    }
  }

  /// Projects the light at positions, which is measured.
  void project(std::span<const BasisPart> parts) const {
    bases_.project(parts, constant(work_.x), work_.runs, work_.coefficient);
  }

  void project_cluster_coefficients(std::span<const BasisPart> parts) const {
    bases_.project(parts, constant(work_.x), nullptr, work_.coefficient);
  }

  void copy_dense_input(const DenseEnd& end) const {
    for (std::size_t v = 0; v < work_.x.count; ++v) {
      const float* const x = work_.x.data + v * work_.x.stride + end.position;
      float* const lane = lane_of(work_.coefficient, v, end.coefficient);
      for (std::size_t k = 0; k < end.count; ++k) lane[k * kChannelLanes] = x[k];
    }
  }

  /// Computes the cluster coefficients of the light from its coefficients in a cluster basis.
  void gather_cluster_coefficients(const HierarchicalPlan::ClusterBasis& basis) const {
    const std::size_t stride = work_.x.stride;
    for (std::size_t light = 0; light < work_.light_count; ++light) {
      float* const lane = lane_of(work_.coefficient, light * kChannelCount, basis.coefficient);
      const float* const residual = lane + basis.rank * kChannelLanes;
      for (std::size_t k = 0; k < basis.residual_rank * kChannelLanes; ++k) {
        lane[k] += kResidual * residual[k];
      }
      float* const x = work_.x.data + light * kChannelCount * stride + basis.position;
      for (std::size_t k = 0; k < basis.rank; ++k) {
        const float scale = coefficient_scale_[basis.scale + k] / basis_scale_;
        for (int c = 0; c < kChannelCount; ++c)
          x[c * stride + k] = scale * lane[k * kChannelLanes + c];
      }
    }
  }

  /// Computes the coefficients of the arriving light in a cluster basis from its cluster
  /// coefficients.
  void scatter_cluster_coefficients(const HierarchicalPlan::ClusterBasis& basis) const {
    const std::size_t stride = work_.y.stride;
    for (std::size_t light = 0; light < work_.light_count; ++light) {
      const float* const y = work_.y.data + light * kChannelCount * stride + basis.position;
      float* const lane = lane_of(work_.coefficient, light * kChannelCount, basis.coefficient);
      for (std::size_t k = 0; k < basis.rank; ++k) {
        const float scale = coefficient_scale_[basis.scale + k] / basis_scale_;
        for (int c = 0; c < kChannelCount; ++c)
          lane[k * kChannelLanes + c] = scale * y[c * stride + k];
        lane[k * kChannelLanes + kChannelCount] = 0;
      }
      float* const residual = lane + basis.rank * kChannelLanes;
      for (std::size_t k = 0; k < basis.residual_rank * kChannelLanes; ++k) {
        residual[k] = kResidual * lane[k];
      }
    }
  }

  /// Multiplies with the coupling matrices of one part.
  void multiply(std::span<const CouplingBlock> couplings, std::size_t part) const {
    couplings_.multiply(couplings, lanes_, work_.light_count, constant(work_.coefficient),
                        work_.coefficient, work_.scratch.data + part * work_.scratch.stride);
  }

  void multiply_dense(std::span<const DenseBlock> blocks) const {
    couplings_.multiply_dense(blocks, constant(work_.x), work_.coefficient);
  }

  void expand(std::span<const BasisPart> parts) const {
    bases_.expand(parts, constant(work_.coefficient), work_.y);
  }

  void add_dense_output(std::span<const DenseEnd> ends) const {
    if (lanes_.matrix_count == 1) {
      couplings_.add_products(ends, constant(work_.coefficient), product_scale(), work_.y);
    } else {
      for (const DenseEnd& end : ends) add_dense_coefficients(end);
    }
  }

 private:
  static constexpr float kResidual = 1 / HierarchicalFormat::kResidualScale;

  /// The scale of products with dense blocks. Light in low-rank blocks meets a basis twice, this
  /// light meets none.
  float product_scale() const { return basis_scale_ * basis_scale_; }

  /// The coefficients of one channel of one light; they are kChannelLanes floats apart.
  static float* lane_of(const Coefficients<float>& coefficients, std::size_t v, std::size_t first) {
    return coefficients.data + v / kChannelCount * coefficients.stride + first * kChannelLanes +
           v % kChannelCount;
  }

  void add_dense_coefficients(const DenseEnd& end) const {
    for (std::size_t v = 0; v < work_.y.count; ++v) {
      const float* const lane = lane_of(work_.coefficient, v, end.coefficient + end.first);
      float* const y = work_.y.data + v * work_.y.stride + end.position;
      for (std::size_t k = 0; k < end.count; ++k) y[k] += product_scale() * lane[k * kChannelLanes];
    }
  }

  const BasisProducts& bases_;
  const CouplingProducts& couplings_;
  const ChannelLanes& lanes_;
  float basis_scale_;
  std::span<const float> coefficient_scale_;
  const WorkVectors& work_;
};

/// Computes all that arrives at a range of positions or cluster coefficients.
void arrive(const HierarchicalPlan& plan, const HierarchicalPlan::Arrival& arrival,
            const Phases& phases, const WorkVectors& work) {
  clear(work.y, arrival.begin, arrival.end);
  phases.expand(between(plan.expansions, arrival.first_expansion, arrival.last_expansion));
  phases.add_dense_output(between(plan.dense_out, arrival.first_dense, arrival.last_dense));
}

/// The entries of one part of a phase.
template <typename Entry>
std::span<const Entry> of_part(const std::vector<Entry>& entries,
                               const std::vector<std::uint32_t>& parts, std::size_t part) {
  return between(entries, parts[part], parts[part + 1]);
}

/// `From` and `To`: the light of patches as LightOfPatches takes it.
template <typename From, typename To>
void run_plan(const HierarchicalPlan& plan, const Phases& phases, const LightOfPatches& patches,
              const WorkVectors& work, const From& initial_exitance, const To& indirect_irradiance,
              const Scheduler& scheduler) {
  patches.darken(plan.dark, indirect_irradiance);
  const std::size_t positions = HierarchicalFormat::position_count(patches.patch.size());
  const auto gather = [&](std::size_t k) {
    const std::size_t begin = k * kPositionsPerTask;
    const std::size_t end = std::min(begin + kPositionsPerTask, positions);
    patches.gather(initial_exitance, begin, end);
    phases.measure(begin, end);
  };
  // Dense blocks of several matrices get their input in the same loop as the projections.
  const std::size_t dense_ends = piece_count(plan.dense_in.size(), kDenseEndsPerTask);
  const auto copy_dense_input = [&](std::size_t k) { phases.copy_dense_input(plan.dense_in[k]); };
  const auto copy_piece = on_piece(plan.dense_in.size(), kDenseEndsPerTask, copy_dense_input);
  const auto project = [&](std::size_t k) {
    if (k < dense_ends) {
      copy_piece(k);
    } else {
      phases.project(of_part(plan.projections, plan.projection_parts, k - dense_ends));
    }
  };
  const std::size_t cluster_bases_in = plan.cluster_bases_in.size(),
                    cluster_bases_out = plan.cluster_bases_out.size();
  const auto gather_cluster_coefficients = [&](std::size_t k) {
    phases.gather_cluster_coefficients(plan.cluster_bases_in[k]);
  };
  const auto project_cluster_coefficients = [&](std::size_t k) {
    phases.project_cluster_coefficients(
        of_part(plan.cluster_projections, plan.cluster_projection_parts, k));
  };
  const std::size_t dense_parts = plan.dense_parts.size() - 1;
  const auto multiply = [&](std::size_t k) {
    if (k < dense_parts) {
      phases.multiply_dense(of_part(plan.dense, plan.dense_parts, k));
    } else {
      const std::size_t part = k - dense_parts;
      phases.multiply(of_part(plan.couplings, plan.coupling_parts, part), part);
    }
  };
  const auto arrive_at_cluster_coefficients = [&](std::size_t k) {
    arrive(plan, plan.cluster_arrivals[plan.cluster_arrivals.size() - 1 - k], phases, work);
  };
  const auto scatter_cluster_coefficients = [&](std::size_t k) {
    phases.scatter_cluster_coefficients(plan.cluster_bases_out[k]);
  };
  // In descending order.
  const auto arrive_at_patches = [&](std::size_t k) {
    const HierarchicalPlan::Arrival& arrival = plan.arrivals[plan.arrivals.size() - 1 - k];
    arrive(plan, arrival, phases, work);
    patches.scatter(between(plan.targets, arrival.first_target, arrival.last_target),
                    indirect_irradiance);
  };
  run_in_turn(
      scheduler,
      {{piece_count(positions, kPositionsPerTask), gather},
       {dense_ends + plan.projection_parts.size() - 1, project},
       {piece_count(cluster_bases_in, kClusterBasesPerTask),
        on_piece(cluster_bases_in, kClusterBasesPerTask, gather_cluster_coefficients)},
       {cluster_bases_in == 0 ? 0 : plan.cluster_projection_parts.size() - 1,
        project_cluster_coefficients},
       {dense_parts + plan.coupling_parts.size() - 1, multiply},
       {cluster_bases_out == 0 ? 0 : plan.cluster_arrivals.size(), arrive_at_cluster_coefficients},
       {piece_count(cluster_bases_out, kClusterBasesPerTask),
        on_piece(cluster_bases_out, kClusterBasesPerTask, scatter_cluster_coefficients)},
       {plan.arrivals.size(), arrive_at_patches}});
}

}  // namespace

std::uint64_t HierarchicalOperator::Receivers::value_count() const {
  return plan_->value_count;
}

HierarchicalOperator::HierarchicalOperator(HierarchicalStorage storage)
    : storage_(std::make_shared<HierarchicalStorage>(stream_values(std::move(storage)))),
      layout_(std::make_shared<HierarchicalLayout>(*storage_)) {
  const std::size_t n = storage_->area.size();
  gather_scale_.reserve(n);
  scatter_scale_.reserve(n);
  const float scale = product_scale(BasisProducts(*storage_),
                                    CouplingProducts(*storage_, layout_->basis_value_count));
  for (std::size_t k = 0; k < n; ++k) {
    const std::uint32_t p = storage_->patch[k];
    const float root = std::sqrt(storage_->area[p]), of_position = storage_->position_scale(k);
    gather_scale_.push_back(roles().is_source(p) ? of_position * root : 0);
    scatter_scale_.push_back(of_position * scale / root);
  }
  plan_ = plan_to(std::vector<bool>(patch_count(), true));
}

std::shared_ptr<const HierarchicalPlan> HierarchicalOperator::plan_to(
    const std::vector<bool>& wanted) const {
  std::vector<std::uint32_t> positions, dark;
  for (std::uint32_t k = 0; k < patch_count(); ++k) {
    const std::uint32_t p = storage_->patch[k];
    if (!wanted[p]) continue;
    if (roles().is_receiver(p)) {
      positions.push_back(k);
    } else {
      dark.push_back(p);
    }
  }
  return std::make_shared<HierarchicalPlan>(*storage_, *layout_, std::move(positions),
                                            std::move(dark));
}

OperatorKind HierarchicalOperator::kind() const {
  const std::vector<TransferBlock>& blocks = storage_->blocks;
  const bool one = blocks.size() == 1 && blocks.front().kind == TransferBlock::Kind::kLowRank;
  return one ? OperatorKind::kLowRank : OperatorKind::kHierarchical;
}

const PatchRoles& HierarchicalOperator::roles() const {
  return storage_->roles;
}

std::size_t HierarchicalOperator::bytes() const {
  std::size_t values = 0;
  for_each_array(*storage_, [&](const auto& array) { values += array.size_bytes(); });
  return values + storage_->blocks.size() * HierarchicalFormat::kBlockBytes +
         storage_->row_format.size() + storage_->coefficient_scale.size() * sizeof(float) +
         storage_->scale_exponent.size() + storage_->patch.size() * sizeof(std::uint32_t) +
         storage_->roles.role.size();
}

std::size_t HierarchicalOperator::bytes_per_apply() const {
  return bytes() + with_bases(*storage_, [this](const auto& array) {
           return layout_->basis_value_count * sizeof(*array.data());
         });
}

ChannelLanes HierarchicalOperator::all_lanes() const {
  return {storage_->channel_matrix, storage_->matrix_count};
}

std::size_t HierarchicalOperator::batch_workspace_size(std::size_t light_count) const {
  return WorkVectors::size(HierarchicalFormat::position_count(patch_count()), *layout_,
                           light_count) +
         WorkVectors::kLine;
}

template <typename From, typename To>
void HierarchicalOperator::run(const HierarchicalPlan& plan, std::size_t light_count,
                               const ChannelLanes& lanes, const From& initial_exitance,
                               const To& indirect_irradiance, std::span<float> workspace,
                               const Scheduler& scheduler) const {
  // The workspace has room for one cache line more than its vectors, so that they can begin with
  // one.
  const std::size_t misplaced = reinterpret_cast<std::uintptr_t>(workspace.data()) / sizeof(float);
  float* const aligned =
      workspace.data() + (WorkVectors::kLine - misplaced % WorkVectors::kLine) % WorkVectors::kLine;
  const WorkVectors work(HierarchicalFormat::position_count(patch_count()), *layout_, light_count,
                         aligned);
  const LightOfPatches patches{storage_->patch, gather_scale_, scatter_scale_, work};
  const BasisProducts bases(*storage_);
  const CouplingProducts couplings(*storage_, layout_->basis_value_count);
  const Phases phases(bases, couplings, lanes, storage_->coefficient_scale, work);
  run_plan(plan, phases, patches, work, initial_exitance, indirect_irradiance, scheduler);
}

void HierarchicalOperator::do_apply(std::span<const Float3> initial_exitance,
                                    std::span<Float3> indirect_irradiance,
                                    std::span<float> workspace, const Scheduler& scheduler) const {
  run(*plan_, 1, all_lanes(), initial_exitance, indirect_irradiance, workspace, scheduler);
}

void HierarchicalOperator::do_apply_batch(std::size_t light_count,
                                          std::span<const Float3> initial_exitance,
                                          std::span<Float3> indirect_irradiance,
                                          std::span<float> workspace,
                                          const Scheduler& scheduler) const {
  run(*plan_, light_count, all_lanes(), initial_exitance, indirect_irradiance, workspace,
      scheduler);
}

void HierarchicalOperator::do_apply_planes(std::optional<int> channel,
                                           std::span<const float> initial_exitance,
                                           std::span<float> indirect_irradiance,
                                           std::span<float> workspace,
                                           const Scheduler& scheduler) const {
  // The bases serve all channels, so a light may have three planes of one channel.
  std::array<std::uint32_t, kChannelCount> matrix = storage_->channel_matrix;
  if (channel) matrix.fill(matrix[*channel]);
  const std::size_t planes = initial_exitance.size() / patch_count();
  run(*plan_, piece_count(planes, kChannelCount), ChannelLanes(matrix, storage_->matrix_count),
      Planes<const float>{initial_exitance.data(), planes},
      Planes<float>{indirect_irradiance.data(), planes}, workspace, scheduler);
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
  return Receivers(plan_to(wanted));
}

void HierarchicalOperator::apply_to(const Receivers& receivers,
                                    std::span<const Float3> initial_exitance,
                                    std::span<Float3> indirect_irradiance,
                                    std::span<float> workspace, const Scheduler& scheduler) const {
  check_size("operator: initial exitance", initial_exitance.size(), patch_count());
  check_size("operator: indirect irradiance", indirect_irradiance.size(), patch_count());
  check_workspace("operator: workspace", workspace.size(), workspace_size());
  run(*receivers.plan_, 1, all_lanes(), initial_exitance, indirect_irradiance, workspace,
      scheduler);
}

void HierarchicalOperator::do_expand(int channel, std::span<float> transfer) const {
  const std::size_t n = patch_count();
  std::ranges::fill(transfer, 0.0F);
  const auto put = [&](std::size_t i, std::size_t j, double value) {
    const std::size_t row = storage_->patch[i], column = storage_->patch[j];
    if (!roles().is_receiver(row) || !roles().is_source(column)) return;
    transfer[row * n + column] = static_cast<float>(value * std::sqrt(storage_->area[column]) /
                                                    std::sqrt(storage_->area[row]));
  };
  for (std::size_t b = 0; b < storage_->blocks.size(); ++b) {
    if (is_cluster_basis(storage_->blocks[b])) continue;
    const BlockOfPositions block =
        block_of_positions(*storage_, *layout_, b, storage_->channel_matrix[channel]);
    for (std::size_t r = 0; r < block.rows.size(); ++r) {
      const std::size_t i = block.rows[r];
      if (i >= n) continue;
      const double scale = storage_->position_scale(i);
      for (std::size_t c = 0; c < block.columns.size(); ++c) {
        const std::size_t j = block.columns[c];
        if (j >= n) continue;
        const double entry =
            scale * storage_->position_scale(j) * block.entries[r * block.columns.size() + c];
        put(i, j, entry);
        if (!storage_->blocks[b].on_diagonal()) put(j, i, entry);
      }
    }
  }
}

}  // namespace rebounce
