#include "precompute/inverse/dense_transfer.h"

#include <omp.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>

#include "precompute/base/blas.h"
#include "precompute/inverse/tiled_cholesky.h"
#include "transfer/base/area_norm.h"

namespace rebounce {
namespace {

constexpr double kReflectanceFloor = 1e-7;
constexpr std::size_t kTile = DenseOperator::kTile;

std::vector<double> root_reflectance(const PatchTable& patches, int channel) {
  std::vector<double> root;
  root.reserve(patches.size());
  for (const Float3& rho : patches.reflectance) {
    root.push_back(std::sqrt(std::max<double>(rho[channel], kReflectanceFloor)));
  }
  return root;
}

/// Calls visit(i, j, g) for the nonzero entries of G with i <= j.
template <typename Visit>
void visit_exchange(const ExchangeMatrix& exchange, const std::vector<float>& area,
                    const Visit& visit) {
  for (std::size_t i = 0; i < area.size(); ++i) {
    for (std::uint64_t k = exchange.row_begin[i]; k < exchange.row_begin[i + 1]; ++k) {
      const std::size_t j = exchange.column[k];
      visit(i, j, exchange.exchange_area[k] / std::sqrt(static_cast<double>(area[i]) * area[j]));
    }
  }
}

/// The matrix I - R G R.
template <typename Scalar>
void fill_system(const ExchangeMatrix& exchange, const std::vector<float>& area,
                 const std::vector<double>& root, TiledMatrix<Scalar>& system) {
  for (std::size_t i = 0; i < area.size(); ++i) system.at(i, i) = 1;
  visit_exchange(exchange, area, [&](std::size_t i, std::size_t j, double g) {
    const auto value = static_cast<Scalar>(root[i] * g * root[j]);
    system.at(j, i) -= value;
    if (j != i && j / system.kTile == i / system.kTile) system.at(i, j) -= value;
  });
}

/// Writes Yhat = R^-1 (inverse - I) R^-1 to the tiles of the operator, except for the diagonal.
template <typename Scalar>
void write_tiles(TiledMatrix<Scalar>& inverse, const std::vector<double>& root, float* tiles) {
  const std::size_t n = root.size(), side = (n + kTile - 1) / kTile;
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t tile_row = 0; tile_row < side; ++tile_row) {
    float* tile = tiles + tile_row * (tile_row + 1) / 2 * kTile * kTile;
    for (std::size_t tile_column = 0; tile_column <= tile_row; ++tile_column) {
      for (std::size_t r = 0; r < kTile; ++r) {
        for (std::size_t c = 0; c < kTile; ++c, ++tile) {
          const std::size_t i = tile_row * kTile + r, j = tile_column * kTile + c;
          if (i >= n || j >= n) continue;
          if (i == j) continue;
          const double p = inverse.at(std::max(i, j), std::min(i, j));
          *tile = static_cast<float>(p / (root[i] * root[j]));
        }
      }
    }
  }
}

/// Writes the diagonal of Yhat = G + G R² Yhat, from the entries beside it. The diagonal of the
/// inverse cannot give it: little is left of an entry after the 1 is subtracted, and nothing where
/// patches are black.
void write_diagonal(const ExchangeMatrix& exchange, const std::vector<float>& area,
                    const std::vector<double>& root, float* tiles) {
  std::vector<double> sum(area.size(), 0.0), left(area.size(), 1.0);
  visit_exchange(exchange, area, [&](std::size_t i, std::size_t j, double g) {
    if (i == j) {
      sum[i] += g;
      left[i] -= g * root[i] * root[i];
    } else {
      const double gy = g * tiles[DenseOperator::entry_index(i, j)];
      sum[i] += gy * root[j] * root[j];
      sum[j] += gy * root[i] * root[i];
    }
  });
  for (std::size_t i = 0; i < area.size(); ++i) {
    tiles[DenseOperator::entry_index(i, i)] = static_cast<float>(sum[i] / left[i]);
  }
}

/// The inverse of one channel: Yhat.
template <typename Scalar>
void solve_channel(const ExchangeMatrix& exchange, const PatchTable& patches, int channel,
                   float* tiles, const Progress& progress) {
  const std::vector<double> root = root_reflectance(patches, channel);
  TiledMatrix<Scalar> system(patches.size());
  fill_system(exchange, patches.area, root, system);
  invert_positive_definite(system, progress);
  write_tiles(system, root, tiles);
  write_diagonal(exchange, patches.area, root, tiles);
}

/// The speed of products of tiles in one arithmetic.
template <typename Scalar>
double speed_of_products() {
  using Matrix = typename TiledMatrix<Scalar>::Matrix;
  constexpr Eigen::Index kSide = TiledMatrix<Scalar>::kTile;
  constexpr int kProducts = 16;  // of each thread: some milliseconds
  load_blas();
  const Matrix tile = Matrix::Constant(kSide, kSide, Scalar(1) / kSide);
  std::vector<Matrix> sums(static_cast<std::size_t>(omp_get_max_threads()),
                           Matrix::Zero(kSide, kSide));
  const auto multiply = [&] {
    const auto begin = std::chrono::steady_clock::now();
#pragma omp parallel for schedule(static)
    for (Matrix& sum : sums) {
      for (int k = 0; k < kProducts; ++k) sum.noalias() += tile * tile;
    }
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    return 2.0 * kSide * kSide * kSide * kProducts * static_cast<double>(sums.size()) /
           seconds.count();
  };
  multiply();  // starts the threads and touches the memory that they write to
  return multiply();
}

}  // namespace

std::uint32_t distinct_channels(std::span<const Float3> reflectance,
                                std::array<std::uint32_t, kChannelCount>& channel_matrix) {
  const auto same = [&](int a, int b) {
    return std::ranges::all_of(reflectance, [=](const Float3& rho) { return rho[a] == rho[b]; });
  };
  std::uint32_t count = 0;
  for (int c = 0; c < kChannelCount; ++c) {
    int earlier = 0;
    while (earlier < c && !same(earlier, c)) ++earlier;
    channel_matrix[c] = earlier < c ? channel_matrix[earlier] : count++;
  }
  return count;
}

std::uint32_t distinct_channels(std::span<const Float3> reflectance) {
  std::array<std::uint32_t, kChannelCount> channel_matrix{};
  return distinct_channels(reflectance, channel_matrix);
}

std::size_t dense_transfer_peak_bytes(std::size_t patch_count, std::size_t matrix_count,
                                      Arithmetic arithmetic) {
  const std::size_t tiles =
      DenseOperator::tile_count(patch_count) * kTile * kTile * sizeof(float) * matrix_count;
  return tiles + (arithmetic == Arithmetic::kDouble ? TiledMatrix<double>::bytes(patch_count)
                                                    : TiledMatrix<float>::bytes(patch_count));
}

double measure_tile_speed(Arithmetic arithmetic) {
  return arithmetic == Arithmetic::kDouble ? speed_of_products<double>()
                                           : speed_of_products<float>();
}

double forecast_dense_transfer(std::size_t patch_count, std::size_t matrix_count,
                               double tile_speed) {
  const auto n = static_cast<double>(patch_count);
  return 2 * n * n * n * static_cast<double>(matrix_count) / tile_speed;
}

std::shared_ptr<const DenseOperator> build_dense_transfer(const ExchangeMatrix& exchange,
                                                          const PatchTable& patches,
                                                          Precision precision,
                                                          const Progress& progress,
                                                          Arithmetic arithmetic) {
  DenseOperator::Storage storage;
  storage.area = patches.area;
  storage.precision = precision;
  storage.matrix_count = distinct_channels(patches.reflectance, storage.channel_matrix);
  const std::size_t matrix_values = DenseOperator::tile_count(patches.size()) * kTile * kTile;
  std::vector<float> tiles(storage.matrix_count * matrix_values, 0.0F);
  for (std::uint32_t matrix = 0; matrix < storage.matrix_count; ++matrix) {
    const auto channel = static_cast<int>(std::ranges::find(storage.channel_matrix, matrix) -
                                          storage.channel_matrix.begin());
    Progress part;
    if (progress) {
      part = [&](double done) { return progress((matrix + done) / storage.matrix_count); };
    }
    const auto solve =
        arithmetic == Arithmetic::kDouble ? solve_channel<double> : solve_channel<float>;
    solve(exchange, patches, channel, tiles.data() + matrix * matrix_values, part);
  }
  if (precision == Precision::kF16) {
    storage.tiles_f16 = SharedArray(DenseOperator::encode_half(tiles));
  } else {
    storage.tiles_f32 = SharedArray(std::move(tiles));
  }
  return std::make_shared<const DenseOperator>(std::move(storage));
}

double transfer_residual(const TransferOperator& transfer, const FormFactorOperator& form_factors,
                         const PatchTable& patches) {
  constexpr int kProbeCount = 4;
  const std::size_t n = patches.size();
  std::vector<Float3> v(n), fv(n), w(n), result(n);
  std::vector<float> workspace(std::max(transfer.workspace_size(), form_factors.workspace_size()));
  std::mt19937 engine(1);
  double largest = 0;
  for (int probe = 0; probe < kProbeCount; ++probe) {
    for (Float3& value : v) {
      for (float& x : value) x = static_cast<float>(engine() * 0x1p-32);
    }
    form_factors.gather(v, fv, workspace);
    for (std::size_t i = 0; i < n; ++i) {
      for (int c = 0; c < kChannelCount; ++c)
        w[i][c] = v[i][c] - patches.reflectance[i][c] * fv[i][c];
    }
    transfer.apply(w, result, workspace);
    largest = std::max(largest, relative_difference(result, fv, patches.area));
  }
  return largest;
}

double transfer_residual(const TransferOperator& transfer, const ExchangeMatrix& exchange,
                         const PatchTable& patches) {
  return transfer_residual(transfer, FormFactorRows(exchange, patches.area), patches);
}

}  // namespace rebounce
