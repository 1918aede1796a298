// Rows of coupling matrices in integers of 4 to 16 bits.

#include "transfer/format/row_packing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "rebounce/error.h"
#include "transfer/format/row_format.h"

namespace rebounce::test_row_packing {
namespace {

std::vector<float> random_row(std::size_t size, float largest) {
  std::mt19937 engine(5);
  std::uniform_real_distribution<float> uniform(-largest, largest);
  std::vector<float> row(size);
  for (float& entry : row) entry = uniform(engine);
  row[size / 2] = -largest;
  return row;
}

TEST(RowPacking, RoundsToTheNearestMultiplesOfTheStep) {
  constexpr double kStep = 0x1p-10;
  RowPacking packing;
  std::vector<std::vector<float>> rows;
  for (const std::size_t size : {1U, 2U, 9U, 32U}) {
    for (const float largest : {0.005F, 0.1F, 1.5F, 30.0F})
      rows.push_back(random_row(size, largest));
  }
  for (const std::vector<float>& row : rows) packing.append(row, kStep);
  const std::vector<std::uint8_t> formats = packing.formats(), bytes = packing.release_bytes();
  std::size_t begin = 0;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const RowFormat format{formats[r]};
    EXPECT_EQ(format.bits(), 4 + 4 * (r % 4));
    EXPECT_EQ(format.step(), kStep);
    for (std::size_t k = 0; k < rows[r].size(); ++k) {
      const std::int32_t integer = unpacked(bytes.data() + begin, k * format.half_bytes(), format);
      EXPECT_EQ(static_cast<float>(integer), std::round(rows[r][k] / format.step())) << r;
    }
    begin += format.row_bytes(rows[r].size());
  }
  EXPECT_GE(bytes.size(), begin + 32);
  EXPECT_EQ(bytes.size() % 64, 0U);
}

TEST(RowPacking, IsAsFineAsSixteenBitsAllowWhereNoStepIsGiven) {
  for (const float largest : {1e-9F, 1.0F, 32767.0F, 32768.0F, 1e9F}) {
    RowPacking packing;
    packing.append(random_row(7, largest), 0);
    const RowFormat format{packing.formats().front()};
    EXPECT_LE(largest / format.step(), 32767.5F);
    if (largest > 1e-8F) {
      EXPECT_GT(largest / format.step(), 16383);
    }
  }
}

TEST(RowPacking, TakesALargerStepWhereSixteenBitsAreTooFew) {
  RowPacking packing;
  packing.append(random_row(7, 1000), 1e-6);
  const RowFormat format{packing.formats().front()};
  EXPECT_EQ(format.bits(), 16U);
  EXPECT_GT(1000 / format.step(), 16383);
}

TEST(RowPacking, ARowOfNothingHasFourBits) {
  RowPacking packing;
  packing.append(std::vector<float>(5), 0);
  EXPECT_EQ(RowFormat{packing.formats().front()}.bits(), 4U);
}

TEST(RowPacking, RefusesEntriesThatAreTooLarge) {
  for (const float entry :
       {1e15F, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    RowPacking packing;
    EXPECT_THROW(packing.append(std::vector<float>{1, entry, 2}, 0.01), Error) << entry;
  }
}

TEST(RowFormat, EveryByteIsAFormat) {
  for (int stored = 0; stored < 256; ++stored) {
    const RowFormat format{static_cast<std::uint8_t>(stored)};
    EXPECT_TRUE(format.bits() == 4 || format.bits() == 8 || format.bits() == 12 ||
                format.bits() == 16);
    EXPECT_TRUE(std::isnormal(format.step()));
    EXPECT_EQ(RowFormat::of(static_cast<int>(format.bits()), std::ilogb(format.step())).stored,
              stored);
  }
}

}  // namespace
}  // namespace rebounce::test_row_packing
