#include "precompute/inverse/packed_couplings.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

namespace rebounce {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;

// Neighbours in a column that have the same number of bytes. They are few, because couplings fall
// steeply from the first vectors of a basis to the last.
constexpr Index kGroup = 16;

template <typename T>
T read(const std::uint8_t* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

/// Appends a group: the bytes of a value, then the values as multiples of `step`.
template <typename T>
void append_values(std::span<const float> values, double step, PackedCouplings& bytes) {
  const std::size_t begin = bytes.size() + 1;
  bytes.push_back(sizeof(T));
  bytes.resize(begin + values.size() * sizeof(T));
  for (std::size_t k = 0; k < values.size(); ++k) {
    const T value = std::is_integral_v<T> ? static_cast<T>(std::lround(values[k] / step))
                                          : static_cast<T>(values[k]);
    std::memcpy(bytes.data() + begin + k * sizeof(T), &value, sizeof(T));
  }
}

void append_group(std::span<const float> values, double step, PackedCouplings& bytes) {
  float largest = 0;
  for (const float v : values) largest = std::max(largest, std::abs(v));
  if (largest > std::numeric_limits<std::int16_t>::max() * step) {
    append_values<float>(values, 1, bytes);
  } else if (largest > std::numeric_limits<std::int8_t>::max() * step) {
    append_values<std::int16_t>(values, step, bytes);
  } else if (largest >= 0.5 * step && step > 0) {
    append_values<std::int8_t>(values, step, bytes);
  } else {
    bytes.push_back(0);
  }
}

void pack(const Eigen::Ref<const MatrixXf>& coupling, double step, PackedCouplings& bytes) {
  for (Index column = 0; column < coupling.cols(); ++column) {
    const float* const values = coupling.data() + column * coupling.outerStride();
    for (Index row = 0; row < coupling.rows(); row += kGroup) {
      const Index count = std::min(kGroup, coupling.rows() - row);
      append_group({values + row, static_cast<std::size_t>(count)}, step, bytes);
    }
  }
}

/// Reads `count` values of a type. Returns the byte behind them.
template <typename T>
const std::uint8_t* unpack_values(const std::uint8_t* bytes, Index count, float step, float* out) {
  for (Index k = 0; k < count; ++k) {
    out[k] = step * static_cast<float>(read<T>(bytes + static_cast<std::size_t>(k) * sizeof(T)));
  }
  return bytes + static_cast<std::size_t>(count) * sizeof(T);
}

/// Reads one group. Returns the byte behind it.
const std::uint8_t* unpack_group(const std::uint8_t* bytes, Index count, float step, float* out) {
  switch (*bytes++) {
    case 0:
      std::fill_n(out, count, 0.0F);
      return bytes;
    case sizeof(std::int8_t):
      return unpack_values<std::int8_t>(bytes, count, step, out);
    case sizeof(std::int16_t):
      return unpack_values<std::int16_t>(bytes, count, step, out);
    default:
      return unpack_values<float>(bytes, count, 1, out);
  }
}

}  // namespace

PackedCouplings pack_couplings(const SharedBases& bases, std::size_t cell,
                               std::span<const float> couplings) {
  // It begins with where each block begins, [matrices][cells from this one on].
  const std::size_t others = bases.cell_count() - cell, matrices = bases.bases.size();
  std::vector<std::uint64_t> begins;
  PackedCouplings bytes(matrices * others * sizeof(std::uint64_t));
  for (std::size_t m = 0; m < matrices; ++m) {
    for (std::size_t d = cell; d < bases.cell_count(); ++d) {
      begins.push_back(bytes.size());
      const auto coupling = bases.coupling(m, d, cell, couplings);
      if (d == cell) {
        const MatrixXf symmetric = 0.5F * (coupling + coupling.transpose());
        pack(symmetric, bases.step[m], bytes);
      } else {
        pack(coupling, bases.step[m], bytes);
      }
    }
  }
  std::memcpy(bytes.data(), begins.data(), begins.size() * sizeof(std::uint64_t));
  bytes.shrink_to_fit();
  return bytes;
}

MatrixXf unpack_coupling(const SharedBases& bases, std::size_t matrix, std::size_t d, std::size_t c,
                         const PackedCouplings& couplings) {
  const std::size_t others = bases.cell_count() - c;
  const std::uint8_t* bytes =
      couplings.data() +
      read<std::uint64_t>(couplings.data() + (matrix * others + d - c) * sizeof(std::uint64_t));
  const auto step = static_cast<float>(bases.step[matrix]);
  MatrixXf coupling(bases.coupled_rank(matrix, d, c), bases.coupled_rank(matrix, c, d));
  for (Index column = 0; column < coupling.cols(); ++column) {
    for (Index row = 0; row < coupling.rows(); row += kGroup) {
      bytes = unpack_group(bytes, std::min(kGroup, coupling.rows() - row), step,
                           &coupling(row, column));
    }
  }
  return coupling;
}

}  // namespace rebounce
