#include "transfer/format/hierarchical_encoding.h"

#include <algorithm>
#include <cmath>

#include "transfer/base/error.h"
#include "transfer/base/half_float.h"
#include "transfer/format/hierarchical_check.h"
#include "transfer/format/hierarchical_layout.h"
#include "transfer/format/integer_encoding.h"

namespace rebounce {
namespace {

using Storage = HierarchicalStorage;

using Order = HierarchicalStorage::Order;

/// Copies the values of one block from where it begins to where they belong.
template <typename Value>
void place_block(const HierarchicalLayout& layout, const TransferBlock& block,
                 const HierarchicalLayout::Place& place, std::uint32_t matrix_count,
                 const Value* from, Value* to) {
  const bool dense = block.kind == TransferBlock::Kind::kDense;
  const auto copy_basis = [&](const HierarchicalLayout::End& end, std::uint64_t count) {
    std::copy_n(from, count, to + layout.basis_index(end, 0, 0));
    from += count;
  };
  if (!dense) {
    copy_basis(place.row, std::uint64_t{block.row_rank} * block.row_count);
    if (!block.on_diagonal() && !is_moments(block)) {
      copy_basis(place.column, std::uint64_t{block.column_rank} * block.column_count);
    }
  }
  const std::uint64_t entries = dense ? std::uint64_t{block.row_count} * block.column_count
                                      : std::uint64_t{block.row_rank} * block.column_rank;
  Value* const core = to + layout.basis_value_count + place.values;
  for (std::uint32_t matrix = 0; matrix < matrix_count; ++matrix) {
    for (std::uint64_t k = 0; k < entries; ++k) core[k * matrix_count + matrix] = *from++;
  }
}

template <typename Value>
SharedArray<Value> stream_array(const Storage& storage, const std::vector<TransferBlock>& blocks,
                                const SharedArray<Value>& values) {
  const HierarchicalLayout layout(blocks, storage.matrix_count, storage.precision);
  std::vector<Value> streamed(
      HierarchicalLayout::padded(layout.basis_value_count + layout.core_value_count));
  const Value* from = values.data();
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (has_values(blocks[b])) {
      place_block(layout, blocks[b], layout.places[b], storage.matrix_count, from, streamed.data());
    }
    from += storage.blocks[b].value_count(storage.matrix_count);
  }
  return SharedArray(std::move(streamed));
}

/// Makes all entries so much smaller by powers of four that halves hold them, and scales of
/// positions, if there are any, as much larger.
void fit_halves(Storage& exact) {
  if (exact.scale_exponent.empty()) return;
  // Half of what they hold: entries of cores grow a little with the rounding of their bases.
  constexpr float kMost = 65504 / HierarchicalFormat::kHalfScale / 2;
  const std::uint64_t begin = HierarchicalLayout(exact).basis_value_count;
  float largest = 0;
  for (const float entry : exact.values_f32.span().subspan(begin)) {
    largest = std::max(largest, std::abs(entry));
  }
  if (!(largest > kMost) || !std::isfinite(largest)) return;
  const int power = static_cast<int>(std::ceil(std::log2(largest / kMost) / 2));
  std::vector<float> values(exact.values_f32.begin(), exact.values_f32.end());
  for (float& entry : std::span(values).subspan(begin)) entry = std::ldexp(entry, -2 * power);
  for (std::int8_t& exponent : exact.scale_exponent) {
    exponent = static_cast<std::int8_t>(exponent + power);
  }
  exact.values_f32 = SharedArray(std::move(values));
}

/// Values in f32, which can be rounded, in the order kStreamed.
Storage stream_exact(const Storage& storage) {
  if (storage.precision != Precision::kF32) {
    throw Error("hierarchical operator: values in " + precision_name(storage.precision) +
                " cannot be rounded again; give them in f32");
  }
  return stream_values(storage);
}

/// The same within the range of halves, as far as scales of positions allow.
Storage stream_for_halves(const Storage& storage) {
  Storage exact = stream_exact(storage);
  fit_halves(exact);
  return exact;
}

Storage encode_half(const Storage& storage) {
  const Storage exact = stream_for_halves(storage);
  Storage half = exact;
  half.precision = Precision::kF16;
  half.values_f32 = {};
  drop_remainders(half);
  const HierarchicalLayout layout(half);
  std::vector<std::uint16_t> values(exact.values_f32.size());
  for (std::uint64_t k = 0; k < values.size(); ++k) {
    const float value = exact.values_f32[k];
    values[k] = k < layout.basis_value_count ? float_to_half(value) : encode_core_value(value);
  }
  half.values_f16 = SharedArray(std::move(values));
  return half;
}

}  // namespace

Storage stream_values(const Storage& storage) {
  check_hierarchical_storage(storage);
  if (storage.order == Order::kStreamed) return storage;
  Storage streamed = storage;
  streamed.order = Order::kStreamed;
  for (TransferBlock& block : streamed.blocks) {
    if (is_moments(block)) continue;
    if (block.row_rank == 0 || block.column_rank == 0) block.row_rank = block.column_rank = 0;
  }
  if (storage.precision == Precision::kF16) {
    streamed.values_f16 = stream_array(storage, streamed.blocks, storage.values_f16);
  } else {
    streamed.values_f32 = stream_array(storage, streamed.blocks, storage.values_f32);
  }
  return streamed;
}

Storage encode_values(const Storage& storage, Precision precision) {
  switch (precision) {
    case Precision::kF16:
      return encode_half(storage);
    case Precision::kQ16:
    case Precision::kQ8:
      return encode_integers(stream_for_halves(storage), precision);
    case Precision::kF32:
      break;
  }
  return stream_exact(storage);
}

}  // namespace rebounce
