#include "transfer/format/integer_encoding.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "transfer/base/error.h"
#include "transfer/base/half_float.h"
#include "transfer/format/hierarchical_layout.h"

namespace rebounce {
namespace {

using Storage = HierarchicalStorage;
using Layout = HierarchicalLayout;

/// A kind of integers that bases are rounded to: their largest magnitude, and which of them stands
/// for 1.
template <typename Integer>
struct IntegerRange;
template <>
struct IntegerRange<std::int8_t> {
  static constexpr float kLargest = 127, kScale = HierarchicalFormat::kByteScale;
};
template <>
struct IntegerRange<std::int16_t> {
  static constexpr float kLargest = HierarchicalFormat::kLargestShort;
  static constexpr float kScale = HierarchicalFormat::kShortScale;
};

/// Rounds the bases of operators in f32, and multiplies their cores to make up for the scales.
template <typename Integer>
class IntegerEncoder {
 public:
  IntegerEncoder(const Storage& exact, const Storage& rounded)
      : exact_(exact.values_f32.data()),
        matrix_count_(exact.matrix_count),
        from_(exact),
        to_(rounded),
        moment_scale_(exact.moment_scale),
        bases_(Layout::padded(to_.basis_value_count)),
        cores_(Layout::padded(to_.core_value_count)) {
    for (std::size_t b = 0; b < exact.blocks.size(); ++b) encode(exact.blocks[b], b);
  }

  std::vector<float> take_moment_scale() { return std::move(moment_scale_); }
  SharedArray<Integer> take_bases() { return SharedArray(std::move(bases_)); }
  SharedArray<std::uint16_t> take_cores() { return SharedArray(std::move(cores_)); }

 private:
  static constexpr float kLargest = IntegerRange<Integer>::kLargest;

  void encode(const TransferBlock& block, std::size_t index) {
    const Layout::Place &from = from_.places[index], &to = to_.places[index];
    const float* core = exact_ + from_.basis_value_count + from.values;
    std::uint16_t* encoded_core = cores_.data() + to.values;
    if (block.kind == TransferBlock::Kind::kDense) {
      std::transform(core, core + block.value_count(matrix_count_), encoded_core,
                     encode_core_value);
    } else if (has_values(block)) {
      const std::vector<float> rows =
          encode_basis(from.row, to.row, block.row_rank, block.row_count);
      if (is_moments(block)) {
        for (const float row : rows) moment_scale_[moment_++] *= row;
        return;
      }
      const std::vector<float> columns =
          encode_basis(from.column, to.column, block.column_rank, block.column_count);
      for (const float row : rows) {
        for (const float column : columns) {
          for (std::uint32_t matrix = 0; matrix < matrix_count_; ++matrix) {
            *encoded_core++ = encode_core_value(*core++ * row * column);
          }
        }
      }
    }
  }

  /// Returns what each vector must be multiplied by, over kScale.
  std::vector<float> encode_basis(const Layout::End& from, const Layout::End& to, std::size_t rank,
                                  std::size_t size) {
    std::vector<float> scales;
    std::vector<float> rest(size);
    for (std::size_t r = 0; r < rank; ++r) {
      std::copy_n(exact_ + from_.basis_index(from, r, 0), size, rest.begin());
      float largest = 0;
      for (const float v : rest) largest = std::max(largest, std::abs(v));
      const float step = largest / kLargest;
      put_multiples(rest, step, to, r);
      if (r < to.remainders) {
        put_multiples(rest, step / HierarchicalFormat::kRemainderScale, to, rank + r);
      }
      scales.push_back(step * IntegerRange<Integer>::kScale);
    }
    return scales;
  }

  /// Stores a vector in multiples of `step`, and leaves what they are off.
  void put_multiples(std::span<float> vector, float step, const Layout::End& to, std::size_t rank) {
    if (step == 0) return;
    for (std::size_t k = 0; k < vector.size(); ++k) {
      const float steps = std::clamp(std::round(vector[k] / step), -kLargest, kLargest);
      bases_[to_.basis_index(to, rank, k)] = static_cast<Integer>(steps);
      vector[k] -= steps * step;
    }
  }

  const float* exact_;
  std::uint32_t matrix_count_;
  Layout from_, to_;
  std::vector<float> moment_scale_;
  std::size_t moment_ = 0;  ///< the next one
  std::vector<Integer> bases_;
  std::vector<std::uint16_t> cores_;
};

/// An operator in f32 with integers for its bases, kept as `bases`.
template <typename Integer>
void encode(const Storage& exact, Storage& rounded, SharedArray<Integer> Storage::*bases) {
  IntegerEncoder<Integer> encoder(exact, rounded);
  rounded.moment_scale = encoder.take_moment_scale();
  rounded.*bases = encoder.take_bases();
  rounded.values_f16 = encoder.take_cores();
}

}  // namespace

std::uint16_t encode_core_value(float value) {
  const std::uint16_t half = float_to_half(value * HierarchicalFormat::kHalfScale);
  if ((half & 0x7FFFU) >= 0x7C00U) {
    throw Error("an entry of the operator is too large for f16; use --precision f32");
  }
  return half;
}

void drop_remainders(Storage& storage) {
  for (TransferBlock& block : storage.blocks) block.row_remainders = block.column_remainders = 0;
}

Storage encode_integers(const Storage& exact, Precision precision) {
  Storage rounded = exact;
  rounded.precision = precision;
  rounded.values_f32 = {};
  if (precision == Precision::kQ8) {
    encode(exact, rounded, &Storage::bases_q8);
  } else {
    drop_remainders(rounded);
    encode(exact, rounded, &Storage::bases_q16);
  }
  return rounded;
}

}  // namespace rebounce
