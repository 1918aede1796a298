// Couplings as they are kept in memory: rounded to a step, in as few bytes as they take.

#include "precompute/inverse/packed_couplings.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace rebounce::test_packed_couplings {
namespace {

/// Bases of two matrices over three cells; only their ranks matter.
SharedBases bases_of_step(double step) {
  SharedBases bases{.patches = {{0}, {1}, {2}}, .bases = {}, .group = {}, .step = {step, 2 * step}};
  for (const std::vector<Eigen::Index>& ranks :
       {std::vector<Eigen::Index>{40, 7, 0}, {17, 33, 1}}) {
    std::vector<SharedBases::Basis>& cells = bases.bases.emplace_back();
    for (const Eigen::Index rank : ranks) {
      cells.push_back({Eigen::MatrixXf::Zero(1, rank), Eigen::MatrixXf::Zero(1, rank)});
    }
  }
  return bases;
}

/// Couplings of a cell from `largest` down over so many decimal places.
std::vector<float> random_couplings(const SharedBases& bases, std::size_t cell, float largest,
                                    float places) {
  std::mt19937_64 engine(cell + 1);
  std::uniform_real_distribution<float> uniform(0, 1);
  std::vector<float> values(bases.coupling_count(cell));
  for (float& v : values) {
    v = largest * std::pow(10.0F, -places * uniform(engine)) * (uniform(engine) < 0.5F ? -1 : 1);
  }
  return values;
}

/// Calls visit(matrix, what is packed, what is unpacked) for all blocks. A cell's couplings with
/// itself are packed as the mean with their transpose.
template <typename Visit>
void for_each_block(const SharedBases& bases, float largest, const Visit& visit) {
  for (std::size_t c = 0; c < bases.cell_count(); ++c) {
    const std::vector<float> values = random_couplings(bases, c, largest, 6);
    const PackedCouplings packed = pack_couplings(bases, c, values);
    for (std::size_t m = 0; m < bases.bases.size(); ++m) {
      for (std::size_t d = c; d < bases.cell_count(); ++d) {
        Eigen::MatrixXf exact = bases.coupling(m, d, c, values);
        if (d == c) exact = (0.5F * (exact + exact.transpose())).eval();
        const Eigen::MatrixXf found = unpack_coupling(bases, m, d, c, packed);
        ASSERT_EQ(found.rows(), bases.rank(m, d));
        ASSERT_EQ(found.cols(), bases.rank(m, c));
        if (exact.size() > 0) visit(m, exact, found);
      }
    }
  }
}

TEST(PackedCouplings, AreRoundedToTheStepOfTheirMatrix) {
  for (const double step : {1e-1, 1e-3, 1e-5}) {
    SCOPED_TRACE(step);
    const SharedBases bases = bases_of_step(step);
    double largest = 0;
    for_each_block(bases, 1, [&](std::size_t m, const auto& exact, const auto& found) {
      const double error = (found - exact).cwiseAbs().maxCoeff() / bases.step[m];
      EXPECT_LE(error, 0.501);
      largest = std::max(largest, error);
    });
    EXPECT_GT(largest, 0.4) << "nothing is rounded";
  }
}

TEST(PackedCouplings, WithoutAStepAreExact) {
  for_each_block(bases_of_step(0), 1, [](std::size_t, const auto& exact, const auto& found) {
    EXPECT_EQ(found, exact);
  });
}

TEST(PackedCouplings, FarAboveTheStepAreExact) {
  const SharedBases bases = bases_of_step(1e-12);
  for_each_block(bases, 1e6F, [](std::size_t, const auto& exact, const auto& found) {
    EXPECT_LE((found - exact).cwiseAbs().maxCoeff(), 1e-12);
  });
}

TEST(PackedCouplings, OfACellWithItselfAreSymmetric) {
  const SharedBases bases = bases_of_step(1e-3);
  const PackedCouplings packed = pack_couplings(bases, 0, random_couplings(bases, 0, 1, 3));
  const Eigen::MatrixXf own = unpack_coupling(bases, 0, 0, 0, packed);
  EXPECT_EQ(own, own.transpose());
}

TEST(PackedCouplings, TakeAByteWhereTheyAreSmall) {
  const SharedBases bases = bases_of_step(1e-2);
  const auto bytes_of_each = [&](float largest) {
    const std::vector<float> values = random_couplings(bases, 0, largest, 1);
    return static_cast<double>(pack_couplings(bases, 0, values).size()) /
           static_cast<double>(values.size());
  };
  EXPECT_LT(bytes_of_each(1e-3F), 0.15);
  EXPECT_LT(bytes_of_each(1), 1.15);
  EXPECT_LT(bytes_of_each(100), 2.15);
  EXPECT_LT(bytes_of_each(1e6F), 4.15);
}

}  // namespace
}  // namespace rebounce::test_packed_couplings
