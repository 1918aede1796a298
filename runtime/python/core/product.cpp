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

// Columns side by side are turned at least this many at a time: a cache line of each row.
constexpr std::size_t kTurnedColumns = 16;  // lab/097

// Rows are fetched this many ahead, since each may lie on a page of its own.
constexpr std::size_t kRowsAhead = 16;

using Four = float __attribute__((vector_size(16)));
using FourDoubles = double __attribute__((vector_size(32)));

Four load_four(const float* from) {
  Four four;
  std::memcpy(&four, from, sizeof(four));
  return four;
}

Four load_four(const double* from) {
  FourDoubles four;
  std::memcpy(&four, from, sizeof(four));
  return __builtin_convertvector(four, Four);
}

void store_four(const Four& four, float* to) {
  std::memcpy(to, &four, sizeof(four));
}

void store_four(const Four& four, double* to) {
  const auto doubles = __builtin_convertvector(four, FourDoubles);
  std::memcpy(to, &doubles, sizeof(doubles));
}

/// Four rows become four columns. Entry (r, c) of `from` is at r * from_stride + c, of `to` at
/// r * to_stride + c.
template <typename From, typename To>
void turn_four(const From* from, std::size_t from_stride, To* to, std::size_t to_stride) {
  Four row[4];
  for (std::size_t r = 0; r < 4; ++r) row[r] = load_four(from + r * from_stride);
  const auto low = [](Four a, Four b) { return __builtin_shufflevector(a, b, 0, 4, 1, 5); };
  const auto high = [](Four a, Four b) { return __builtin_shufflevector(a, b, 2, 6, 3, 7); };
  const Four a = low(row[0], row[2]), b = low(row[1], row[3]);
  const Four c = high(row[0], row[2]), d = high(row[1], row[3]);
  const Four column[4] = {low(a, b), high(a, b), low(c, d), high(c, d)};
  for (std::size_t r = 0; r < 4; ++r) store_four(column[r], to + r * to_stride);
}

/// Some columns of an array in C order: entry (r, k) is at r * stride + k.
template <typename Number>
struct SideBySide {
  Number* first;
  std::size_t rows, columns, stride;
};

/// Fetches four rows, to write them or to read them.
template <bool kWrite, typename Number>
void fetch_four_rows(const SideBySide<Number>& array, std::size_t row) {
  constexpr std::size_t kOfLine = 64 / sizeof(Number);
  for (std::size_t r = row; r < std::min(row + 4, array.rows); ++r) {
    for (std::size_t k = 0; k < array.columns; k += kOfLine) {
      __builtin_prefetch(array.first + r * array.stride + k, kWrite ? 1 : 0);
    }
  }
}

/// Calls squares(r, k) for all squares of 4 x 4 entries from (r, k) on, row by row, and entries(r,
/// k) for what is left over.
template <bool kWrite, typename Number, typename Squares, typename Entries>
void for_all(const SideBySide<Number>& array, const Squares& squares, const Entries& entries) {
  const std::size_t whole_rows = array.rows / 4 * 4, whole_columns = array.columns / 4 * 4;
  for (std::size_t r = 0; r < whole_rows; r += 4) {
    fetch_four_rows<kWrite>(array, r + kRowsAhead);
    for (std::size_t k = 0; k < whole_columns; k += 4) squares(r, k);
  }
  for (std::size_t k = 0; k < array.columns; ++k) {
    for (std::size_t r = k < whole_columns ? whole_rows : 0; r < array.rows; ++r) entries(r, k);
  }
}

/// Writes the columns of the array into `out` [columns][rows].
template <typename Number>
void turn_to_planes(const SideBySide<const Number>& in, float* out) {
  for_all<false>(
      in,
      [&](std::size_t r, std::size_t k) {
        turn_four(in.first + r * in.stride + k, in.stride, out + k * in.rows + r, in.rows);
      },
      [&](std::size_t r, std::size_t k) {
        out[k * in.rows + r] = static_cast<float>(in.first[r * in.stride + k]);
      });
}

/// Writes `in` [columns][rows] into the columns of the array.
template <typename Number>
void turn_from_planes(const float* in, const SideBySide<Number>& out) {
  for_all<true>(
      out,
      [&](std::size_t r, std::size_t k) {
        turn_four(in + k * out.rows + r, out.rows, out.first + r * out.stride + k, out.stride);
      },
      [&](std::size_t r, std::size_t k) {
        out.first[r * out.stride + k] = static_cast<Number>(in[k * out.rows + r]);
      });
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
    for_each_chunk(columns, pass_, 0, [&](const Chunk& chunk) {
      const std::size_t first = chunk.begin * rows_;
      multiply(chunk, in + first, out + first, chunk.count);
    });
  }

  /// Columns side by side, [rows][columns].
  void apply_to_rows(const Number* in, Number* out, std::size_t columns) const {
    const std::size_t most = piece_count(kTurnedColumns, pass_) * pass_;
    for_each_chunk(columns, most, most, [&](const Chunk& chunk) {
      float* const turned = chunk.scratch.turned.data();
      turn_to_planes<Number>({in + chunk.begin, rows_, chunk.count, columns}, turned);
      for (std::size_t k = 0; k < chunk.count; k += pass_) {
        multiply(chunk, turned + k * rows_, turned + k * rows_, std::min(pass_, chunk.count - k));
      }
      turn_from_planes<Number>(turned, {out + chunk.begin, rows_, chunk.count, columns});
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
      scratch.back()->light.resize(std::min(pass_, columns) * rows_);
      scratch.back()->result.resize(std::min(pass_, columns) * rows_);
      scratch.back()->turned.resize(std::min(turned, columns) * rows_);
    }
    const Scheduler scheduler = threads > 1 ? kHere : Scheduler{};
#pragma omp parallel for schedule(dynamic) num_threads(threads) if (threads > 1)
    for (std::size_t k = 0; k < chunks; ++k) {
      work(Chunk{k * most, std::min(most, columns - k * most),
                 *scratch[static_cast<std::size_t>(omp_get_thread_num())], scheduler});
    }
    for (std::unique_ptr<ProductScratch>& used : scratch) memory_.give(std::move(used));
  }

  /// One pass: at most pass_ columns, one after the other; `in` and `out` may be the same. The
  /// operator reads and writes light patch by patch in an order of its own, so it gets memory that
  /// stays in the second cache.
  template <typename Light>
  void multiply(const Chunk& chunk, const Light* in, Light* out, std::size_t columns) const {
    const std::size_t size = columns * rows_;
    float *const light = chunk.scratch.light.data(), *const result = chunk.scratch.result.data();
    std::transform(in, in + size, light, [](Light value) { return static_cast<float>(value); });
    if (adjoint_) {
      for_each_plane(light, size, [](float& value, float area) { value /= area; });
    }
    transfer_.apply_planes(channel_, {light, size}, {result, size}, chunk.scratch.workspace,
                           chunk.scheduler);
    if (adjoint_) {
      for_each_plane(result, size, [](float& value, float area) { value *= area; });
    }
    std::transform(result, result + size, out,
                   [](float value) { return static_cast<Light>(value); });
  }

  /// Calls scale(value, area of its patch) for all values of planes.
  template <typename Scale>
  void for_each_plane(float* plane, std::size_t size, const Scale& scale) const {
    const std::size_t n = transfer_.patch_count();
    for (const float* const end = plane + size; plane != end; plane += n) {
      for (std::size_t i = 0; i < n; ++i) scale(plane[i], area_[i]);
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
  auto result = array_like<Number>(light);
  const Number* const in = light.data();
  check_finite(std::span(in, static_cast<std::size_t>(light.size())), "light");
  Number* const out = result.mutable_data();
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
  if (light.dtype().kind() == 'c') throw py::value_error("light must be real, not complex");
  const auto doubles = py::array_t<double>::ensure(light);
  if (!doubles) throw py::value_error("light must be an array of numbers");
  return apply_to<double>(data, doubles, adjoint, channel);
}

}  // namespace rebounce::python
