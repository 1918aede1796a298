#pragma once

#include <cstdint>
#include <span>
#include <type_traits>
#include <variant>

#include "transfer/format/hierarchical_storage.h"
#include "transfer/format/stored_values.h"
#include "transfer/kernels/kernels.h"

namespace rebounce {

/// The kernels for bases of type `Value`.
template <typename Value>
const BasisKernels<Value>& basis_kernels(const BlockKernels& kernels) {
  if constexpr (std::is_same_v<Value, float>) return kernels.bases_f32;
  if constexpr (std::is_same_v<Value, std::uint16_t>) return kernels.bases_f16;
  if constexpr (std::is_same_v<Value, std::int8_t>) return kernels.bases_q8;
}

/// The kernels for coupling matrices of type `Value`.
template <typename Value>
const CouplingKernels<Value>& coupling_kernels(const BlockKernels& kernels) {
  if constexpr (std::is_same_v<Value, float>) return kernels.couplings_f32;
  if constexpr (std::is_same_v<Value, std::uint16_t>) return kernels.couplings_f16;
}

/// Kernels for one type of values, with an array of such values.
template <typename Kernels, typename Value>
struct KernelsOn {
  const Kernels* kernels;
  const Value* values;
};

/// Products with the bases of an operator, with the widest kernels for their precision
/// (BasisKernels). The storage must outlive the object.
class BasisProducts {
 public:
  explicit BasisProducts(const HierarchicalStorage& storage) {
    with_bases(storage, [this]<typename Value>(const SharedArray<Value>& array) {
      on_ = On<Value>{&basis_kernels<Value>(kernels().blocks), array.data()};
      scale_ = kBasisScale<Value>;
    });
  }

  /// `runs`: of x, as in BasisKernels::project.
  void project(std::span<const BasisPart> parts, PlanarVectors<const float> x, const LightRun* runs,
               Coefficients<float> coefficient) const {
    std::visit([&](const auto& on) { on.kernels->project(on.values, parts, x, runs, coefficient); },
               on_);
  }
  /// Measures `count` positions of one light, three planes `stride` floats apart, for `project`.
  /// Bases that are no integers need no measures; for these it does nothing.
  void measure(const float* x, std::size_t stride, std::size_t count, LightRun* runs) const {
    if (std::holds_alternative<On<std::int8_t>>(on_))
      kernels().blocks.measure_light(x, stride, count, runs);
  }
  void expand(std::span<const BasisPart> parts, Coefficients<const float> coefficient,
              PlanarVectors<float> y) const {
    std::visit([&](const auto& on) { on.kernels->expand(on.values, parts, coefficient, y); }, on_);
  }

  /// The stored number that stands for 1 in the bases.
  float scale() const { return scale_; }

 private:
  template <typename Value>
  using On = KernelsOn<BasisKernels<Value>, Value>;
  std::variant<On<float>, On<std::uint16_t>, On<std::int8_t>> on_;
  float scale_ = 1;
};

/// Products with the coupling matrices and dense blocks of an operator (CouplingKernels). The
/// storage has `basis_value_count` values of bases and must outlive the object.
class CouplingProducts {
 public:
  CouplingProducts(const HierarchicalStorage& storage, std::uint64_t basis_value_count) {
    const std::uint64_t first = storage.first_coupling(basis_value_count);
    with_couplings(storage, [this, first]<typename Value>(const SharedArray<Value>& array) {
      on_ = On<Value>{&coupling_kernels<Value>(kernels().blocks), array.data() + first};
      scale_ = kCouplingScale<Value>;
    });
    if (!storage.has_packed_couplings()) return;
    packed_ = storage.packed_couplings.data();
    row_format_ = storage.row_format.data();
  }

  void multiply(std::span<const CouplingBlock> couplings, const ChannelLanes& lanes,
                std::size_t light_count, Coefficients<const float> in, Coefficients<float> out,
                float* scratch) const {
    std::visit(
        [&](const auto& on) {
          on.kernels->multiply({on.values, packed_, row_format_}, couplings, lanes, light_count, in,
                               out, scratch);
        },
        on_);
  }
  void multiply_dense(std::span<const DenseBlock> blocks, PlanarVectors<const float> x,
                      Coefficients<float> out) const {
    std::visit([&](const auto& on) { on.kernels->multiply_dense(on.values, blocks, x, out); }, on_);
  }
  void add_products(std::span<const DenseEnd> ends, Coefficients<const float> products, float scale,
                    PlanarVectors<float> y) const {
    std::visit([&](const auto& on) { on.kernels->add_products(ends, products, scale, y); }, on_);
  }
  void add_dense(std::span<const DenseBlock> blocks, PlanarVectors<const float> x, float scale,
                 PlanarVectors<float> y) const {
    std::visit([&](const auto& on) { on.kernels->add_dense(on.values, blocks, x, scale, y); }, on_);
  }

  /// The stored number that stands for 1 in the coupling matrices.
  float scale() const { return scale_; }

 private:
  template <typename Value>
  using On = KernelsOn<CouplingKernels<Value>, Value>;
  std::variant<On<float>, On<std::uint16_t>> on_;
  const std::uint8_t *packed_ = nullptr, *row_format_ = nullptr;
  float scale_ = 1;
};

/// The factor that turns products of stored values into products of real ones.
inline float product_scale(const BasisProducts& bases, const CouplingProducts& couplings) {
  return 1 / (couplings.scale() * bases.scale() * bases.scale());
}

}  // namespace rebounce
