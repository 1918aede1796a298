#include "transfer/format/row_packing.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rebounce/error.h"
#include "transfer/format/hierarchical_layout.h"
#include "transfer/format/row_format.h"

namespace rebounce {
namespace {

constexpr int kMostBits = 16;

constexpr float largest_integer(int bits) {
  return static_cast<float>((1 << (bits - 1)) - 1);
}

/// The binary exponent of the power of two nearest to `x` on a logarithmic scale.
int nearest_exponent(double x) {
  constexpr int kLeast = RowFormat::kLeastExponent;
  return x > std::ldexp(1.0, kLeast) ? static_cast<int>(std::lround(std::log2(x))) : kLeast;
}

/// The format of a row whose largest magnitude is `largest`, with a step near `step`.
RowFormat format_for(float largest, double step) {
  int exponent = std::max(nearest_exponent(step), RowFormat::kLeastExponent);
  const auto integer = [&] { return std::round(std::ldexp(largest, -exponent)); };
  while (integer() > largest_integer(kMostBits)) ++exponent;
  if (exponent > RowFormat::kMostExponent) {
    throw Error("an entry of the operator is too large for q8; use --precision f32");
  }
  int bits = kMostBits;
  while (bits > 4 && integer() <= largest_integer(bits - 4)) bits -= 4;
  return RowFormat::of(bits, exponent);
}

}  // namespace

void RowPacking::append(std::span<const float> entries, double step) {
  float largest = 0;
  bool finite = true;
  for (const float entry : entries) {
    largest = std::max(largest, std::abs(entry));
    finite &= std::isfinite(entry);
  }
  if (!finite) throw Error("an entry of the operator is too large for q8; use --precision f32");
  const RowFormat format = format_for(largest, step);
  const unsigned bits = format.bits();
  const std::size_t begin = bytes_.size();
  bytes_.resize(begin + format.row_bytes(entries.size()));
  for (std::size_t k = 0; k < entries.size(); ++k) {
    const auto integer = static_cast<std::int32_t>(std::round(entries[k] / format.step()));
    const std::uint32_t value = static_cast<std::uint32_t>(integer) & ((1U << bits) - 1);
    const std::size_t bit = k * bits;
    bytes_[begin + bit / 8] |= static_cast<std::uint8_t>(value << bit % 8);
    if (bits > 8) bytes_[begin + bit / 8 + 1] |= static_cast<std::uint8_t>(value >> (8 - bit % 8));
  }
  formats_.push_back(format.stored);
}

std::vector<std::uint8_t> RowPacking::release_bytes() {
  bytes_.resize(HierarchicalLayout::padded_packed(bytes_.size()));
  return std::move(bytes_);
}

}  // namespace rebounce
