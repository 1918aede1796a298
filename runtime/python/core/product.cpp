// Products with Y on NumPy's arrays.

#include "runtime/python/core/product.h"

#include <omp.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <type_traits>

#include "rebounce/error.h"
#include "runtime/python/core/arrays.h"
#include "transfer/base/parallel.h"

namespace rebounce::python {
namespace {

// Lights of one pass over the operator. More gain nothing, and their vectors would not stay in the
// second cache.
constexpr std::size_t kPassLights = 4;

// A block of rows and columns that is turned at a time: it stays in the first cache. A row of it is
// so long that few lines are loaded for little of them, since rows lie on pages of their own.
constexpr std::size_t kTurnedRows = 16, kTurnedColumns = 120;

// Rows are fetched this many ahead.
constexpr std::size_t kRowsAhead = 16;

using Four = float __attribute__((vector_size(16)));
using FourPlaces = int __attribute__((vector_size(16)));

/// Rows become columns. Entry (r, c) of `from` is at r * from_stride + c, of `to` at r * to_stride
/// + c.
void turn_four(const float* from, std::size_t from_stride, float* to, std::size_t to_stride) {
  Four row[4];
  for (std::size_t r = 0; r < 4; ++r) std::memcpy(&row[r], from + r * from_stride, sizeof(Four));
  constexpr FourPlaces kLow{0, 4, 1, 5}, kHigh{2, 6, 3, 7};
  const Four a = __builtin_shuffle(row[0], row[2], kLow),
             b = __builtin_shuffle(row[1], row[3], kLow);
  const Four c = __builtin_shuffle(row[0], row[2], kHigh);
  const Four d = __builtin_shuffle(row[1], row[3], kHigh);
  const Four column[4] = {__builtin_shuffle(a, b, kLow), __builtin_shuffle(a, b, kHigh),
                          __builtin_shuffle(c, d, kLow), __builtin_shuffle(c, d, kHigh)};
  for (std::size_t r = 0; r < 4; ++r) std::memcpy(to + r * to_stride, &column[r], sizeof(Four));
}

/// As many rows and columns of `from` become columns and rows of `to`.
void turn(const float* from, std::size_t from_stride, std::size_t rows, std::size_t columns,
          float* to, std::size_t to_stride) {
  const std::size_t whole_rows = rows / 4 * 4, whole_columns = columns / 4 * 4;
  for (std::size_t c = 0; c < whole_columns; c += 4) {
    for (std::size_t r = 0; r < whole_rows; r += 4) {
      turn_four(from + r * from_stride + c, from_stride, to + c * to_stride + r, to_stride);
    }
  }
  for (std::size_t c = 0; c < columns; ++c) {
    for (std::size_t r = c < whole_columns ? whole_rows : 0; r < rows; ++r) {
      to[c * to_stride + r] = from[r * from_stride + c];
    }
  }
}

/// Columns of an array [rows][columns] in C order, side by side in a row.
template <typename Number>
struct SideBySide {
  Number* first;  ///< of the first row
  std::size_t columns, row_stride;
};

/// Fetches a row, to write it or to read it.
template <bool kWrite, typename Number>
void fetch_row(const SideBySide<Number>& columns, std::size_t row) {
  const char* const first = reinterpret_cast<const char*>(columns.first + row * columns.row_stride);
  constexpr std::size_t kLine = 64;
  for (std::size_t at = 0; at < columns.columns * sizeof(Number); at += kLine) {
    __builtin_prefetch(first + at, kWrite ? 1 : 0);
  }
}

/// Writes the columns into `out` [columns][rows].
template <typename Number>
void turn_to_planes(const SideBySide<const Number>& in, std::size_t rows, float* out) {
  if (in.columns < 4) {
    for (std::size_t k = 0; k < in.columns; ++k, out += rows) {
      for (std::size_t r = 0; r < rows; ++r) {
        out[r] = static_cast<float>(in.first[r * in.row_stride + k]);
      }
    }
    return;
  }
  alignas(64) float block[kTurnedRows][kTurnedColumns];
  for (std::size_t begin = 0; begin < rows; begin += kTurnedRows) {
    const std::size_t count = std::min(rows - begin, kTurnedRows);
    for (std::size_t r = 0; r < count; ++r) {
      if (begin + r + kRowsAhead < rows) fetch_row<false>(in, begin + r + kRowsAhead);
      const Number* const row = in.first + (begin + r) * in.row_stride;
      for (std::size_t k = 0; k < in.columns; ++k) block[r][k] = static_cast<float>(row[k]);
    }
    turn(block[0], kTurnedColumns, count, in.columns, out + begin, rows);
  }
}

/// Writes `in` [columns][rows] into the columns.
template <typename Number>
void turn_from_planes(const float* in, std::size_t rows, const SideBySide<Number>& out) {
  if (out.columns < 4) {
    for (std::size_t k = 0; k < out.columns; ++k, in += rows) {
      for (std::size_t r = 0; r < rows; ++r) {
        out.first[r * out.row_stride + k] = static_cast<Number>(in[r]);
      }
    }
    return;
  }
  alignas(64) float block[kTurnedRows][kTurnedColumns];
  for (std::size_t begin = 0; begin < rows; begin += kTurnedRows) {
    const std::size_t count = std::min(rows - begin, kTurnedRows);
    for (std::size_t r = 0; r < count; ++r) fetch_row<true>(out, begin + r);
    turn(in + begin, rows, out.columns, count, block[0], kTurnedColumns);
    for (std::size_t r = 0; r < count; ++r) {
      Number* const row = out.first + (begin + r) * out.row_stride;
      for (std::size_t k = 0; k < out.columns; ++k) row[k] = static_cast<Number>(block[r][k]);
    }
  }
}

// All tasks of a product on the thread that calls it.
constexpr Scheduler kHere{
    [](void* /*user*/, std::uint32_t count, Scheduler::Task task, void* context) {
      for (std::uint32_t i = 0; i < count; ++i) task(context, i);
    }};

/// A product with columns of light, in chunks of some columns. Threads share the chunks out; a
/// single one is multiplied by all threads.
template <typename Number>
class Product {
 public:
  Product(const Data& data, std::optional<int> channel, bool adjoint)
      : transfer_(*data->transfer),
        area_(data->patches.area),
        memory_(*data.memory),
        channel_(channel),
        rows_(transfer_.patch_count() * (channel ? 1 : kChannelCount)),
        pass_(kPassLights * (channel ? kChannelCount : 1)),
        adjoint_(adjoint) {}

  /// Columns one after the other, [columns][rows].
  void apply_to_planes(const Number* in, Number* out, std::size_t columns) const {
    const bool direct = std::is_same_v<Number, float> && !adjoint_;
    for_each_chunk(columns, pass_, direct ? 0 : pass_, [&](const Chunk& chunk) {
      const std::size_t first = chunk.begin * rows_, size = chunk.count * rows_;
      if constexpr (std::is_same_v<Number, float>) {
        if (!adjoint_) return multiply(chunk, in + first, out + first, chunk.count);
      }
      float *const light = chunk.scratch.light.data(), *const result = chunk.scratch.result.data();
      std::transform(in + first, in + first + size, light,
                     [](Number value) { return static_cast<float>(value); });
      multiply_scaled(chunk, light, result, chunk.count);
      std::transform(result, result + size, out + first,
                     [](float value) { return static_cast<Number>(value); });
    });
  }

  /// Columns side by side, [rows][columns].
  void apply_to_rows(const Number* in, Number* out, std::size_t columns) const {
    const std::size_t each = piece_count(columns, static_cast<std::size_t>(omp_get_max_threads()));
    const std::size_t most = std::min(kTurnedColumns, piece_count(each, pass_) * pass_);
    for_each_chunk(columns, most, most, [&](const Chunk& chunk) {
      float *const light = chunk.scratch.light.data(), *const result = chunk.scratch.result.data();
      turn_to_planes<Number>({in + chunk.begin, chunk.count, columns}, rows_, light);
      for (std::size_t k = 0; k < chunk.count; k += pass_) {
        multiply_scaled(chunk, light + k * rows_, result + k * rows_,
                        std::min(pass_, chunk.count - k));
      }
      turn_from_planes<Number>(result, rows_, {out + chunk.begin, chunk.count, columns});
    });
  }

 private:
  struct Chunk {
    std::size_t begin, count;
    ProductScratch& scratch;
    Scheduler scheduler;  ///< of its products
  };

  /// Calls work(chunk) for chunks of `most` columns, with scratch for `turned` of them.
  template <typename Work>
  void for_each_chunk(std::size_t columns, std::size_t most, std::size_t turned,
                      const Work& work) const {
    const std::size_t chunks = piece_count(columns, most);
    const auto threads = std::min(chunks, static_cast<std::size_t>(omp_get_max_threads()));
    std::vector<std::unique_ptr<ProductScratch>> scratch;
    for (std::size_t t = 0; t < threads; ++t) {
      scratch.push_back(memory_.take());
      scratch.back()->workspace.resize(transfer_.batch_workspace_size(kPassLights));
      scratch.back()->light.resize(std::min(turned, columns) * rows_);
      scratch.back()->result.resize(std::min(turned, columns) * rows_);
    }
    const Scheduler scheduler = threads > 1 ? kHere : Scheduler{};
#pragma omp parallel for schedule(dynamic) num_threads(threads) if (threads > 1)
    for (std::size_t k = 0; k < chunks; ++k) {
      work(Chunk{k * most, std::min(most, columns - k * most),
                 *scratch[static_cast<std::size_t>(omp_get_thread_num())], scheduler});
    }
    for (std::unique_ptr<ProductScratch>& used : scratch) memory_.give(std::move(used));
  }

  void multiply(const Chunk& chunk, const float* in, float* out, std::size_t columns) const {
    transfer_.apply_planes(channel_, {in, columns * rows_}, {out, columns * rows_},
                           chunk.scratch.workspace, chunk.scheduler);
  }

  /// Divides by the area before, and multiplies with it afterwards, for the adjoint.
  void multiply_scaled(const Chunk& chunk, float* in, float* out, std::size_t columns) const {
    const std::size_t n = transfer_.patch_count(), size = columns * rows_;
    for (std::size_t k = 0; adjoint_ && k < size; k += n) {
      for (std::size_t i = 0; i < n; ++i) in[k + i] /= area_[i];
    }
    multiply(chunk, in, out, columns);
    for (std::size_t k = 0; adjoint_ && k < size; k += n) {
      for (std::size_t i = 0; i < n; ++i) out[k + i] *= area_[i];
    }
  }

  const TransferOperator& transfer_;
  const std::vector<float>& area_;
  ProductMemory& memory_;
  std::optional<int> channel_;
  std::size_t rows_;  ///< of a column
  std::size_t pass_;  ///< columns that go through the operator together
  bool adjoint_;
};

/// An array of the shape and the order of `like`.
template <typename Number>
py::array_t<Number> array_like(const py::array& like) {
  return {std::vector<py::ssize_t>(like.shape(), like.shape() + like.ndim()),
          std::vector<py::ssize_t>(like.strides(), like.strides() + like.ndim())};
}

template <typename Number>
py::array apply_to(const Data& data, const py::array_t<Number>& light, bool adjoint,
                   std::optional<int> channel) {
  const bool by_column =
      light.ndim() == 1 || light.shape(1) == 1 || (light.flags() & py::array::f_style) != 0;
  if ((light.flags() & (py::array::c_style | py::array::f_style)) == 0) {
    return apply_to<Number>(data, Array<Number>(light), adjoint, channel);
  }
  const auto result = array_like<Number>(light);
  const Number* const in = light.data();
  auto* const out = const_cast<Number*>(result.data());
  const auto columns = static_cast<std::size_t>(light.ndim() == 1 ? 1 : light.shape(1));
  const py::gil_scoped_release unlocked;
  const Product<Number> product(data, channel, adjoint);
  if (by_column) {
    product.apply_to_planes(in, out, columns);
  } else {
    product.apply_to_rows(in, out, columns);
  }
  return result;
}

}  // namespace

py::array apply_to_array(const Data& data, const py::array& light, bool adjoint,
                         std::optional<int> channel) {
  if (!data->transfer) throw Error("the transfer data have no operator");
  if (adjoint && !data->transfer->roles().all_are_both()) {
    throw Error("an operator with receivers and sources has no adjoint");
  }
  const std::size_t rows = data->patches.size() * (channel ? 1 : kChannelCount);
  if (light.ndim() == 1) {
    check_shape(light, {static_cast<py::ssize_t>(rows)}, "light");
  } else {
    check_shape(light, {static_cast<py::ssize_t>(rows), -1}, "light");
  }
  if (py::isinstance<py::array_t<float>>(light)) {
    return apply_to<float>(data, light, adjoint, channel);
  }
  const auto doubles = py::array_t<double>::ensure(light);
  if (!doubles) throw py::value_error("light is an array of numbers");
  return apply_to<double>(data, doubles, adjoint, channel);
}

}  // namespace rebounce::python
