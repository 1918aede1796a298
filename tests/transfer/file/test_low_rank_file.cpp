// The operators of low rank in a transfer file.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <random>

#include "rebounce/error.h"
#include "tests/support/expect_error.h"
#include "tests/support/plain_data.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/transfer_file_tampering.h"
#include "transfer/exchange/form_factor_blocks.h"
#include "transfer/file/safetensors.h"
#include "transfer/file/transfer_file_io.h"
#include "transfer/operator/low_rank_operator.h"

namespace rebounce::test_low_rank_file {
namespace {

using test::expect_error;
using test::replace_in_file;

constexpr std::size_t kPatchCount = 300, kRank = 5;  // two tiles, the second not full

std::vector<float> random_values(std::size_t count, std::mt19937& engine) {
  std::uniform_real_distribution<float> uniform(-1, 1);
  std::vector<float> values(count);
  for (float& v : values) v = uniform(engine);
  return values;
}

LowRankOperator::Storage sample_storage(Precision precision) {
  std::mt19937 engine(7);
  constexpr std::size_t kTile = LowRankOperator::kTile;
  LowRankOperator::Storage storage;
  storage.area.assign(kPatchCount, 0.25F);
  storage.channel_matrix = {0, 1, 0};
  storage.matrix_count = 2;
  storage.rank = kRank;
  std::vector<float> basis =
      random_values(LowRankOperator::tile_count(kPatchCount) * kRank * kTile, engine);
  for (std::size_t k = 0; k < basis.size(); ++k) {
    const std::size_t patch = k / (kRank * kTile) * kTile + k % kTile;
    if (patch >= kPatchCount) basis[k] = 0;
  }
  storage.basis_f32 = SharedArray(std::move(basis));
  storage.coupling = SharedArray(random_values(2 * kRank * kRank, engine));
  return precision == Precision::kF16 ? LowRankOperator::encode_half(storage) : storage;
}

TransferData sample_data(Precision precision) {
  TransferData data = test::plain_data(std::vector<float>(kPatchCount, 0.25F));
  data.transfer = std::make_shared<const LowRankOperator>(sample_storage(precision));
  return data;
}

std::vector<Float3> relit(const TransferData& data) {
  std::vector<Float3> light(kPatchCount);
  for (std::size_t i = 0; i < kPatchCount; ++i) light[i] = {1.0F + i % 7, 2, 0.1F * i};
  return product(*data.transfer, light);
}

TEST(LowRankFile, RoundTrips) {
  for (const Precision precision : {Precision::kF32, Precision::kF16}) {
    const test::TemporaryFolder folder;
    const TransferData data = sample_data(precision);
    save_transfer_file(folder / "file", data);
    const TransferData loaded = load_transfer_file(folder / "file");
    EXPECT_EQ(loaded.transfer->kind(), OperatorKind::kLowRank);
    EXPECT_EQ(loaded.transfer->bytes(), data.transfer->bytes());
    EXPECT_EQ(relit(loaded), relit(data));
    save_transfer_file(folder / "again", loaded);
    EXPECT_EQ(test::read_bytes(folder / "file"), test::read_bytes(folder / "again"));
  }
}

TEST(LowRankFile, RefusesAKindThatIsNotKnown) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data(Precision::kF32));
  replace_in_file(folder / "file", "\"low-rank\"", "\"low-bank\"");
  expect_error([&] { load_transfer_file(folder / "file"); }, "of a kind");
}

TEST(LowRankFile, RefusesAChannelWithoutAMatrix) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data(Precision::kF32));
  std::string bytes = test::read_bytes(folder / "file");
  const SafetensorsFile file(folder / "file");
  const std::uint32_t matrix = 2;
  std::memcpy(
      bytes.data() + test::prefix_size(bytes) + file.info("transfer.low_rank.channel_matrix").begin,
      &matrix, sizeof(matrix));
  test::reseal(bytes);
  test::write_bytes(folder / "file", bytes);
  expect_error([&] { load_transfer_file(folder / "file"); }, "channel_matrix");
}

TEST(LowRankFile, RefusesTensorsThatDoNotFit) {
  const test::TemporaryFolder folder;
  // The sizes of the bytes stay what they were: only the shapes disagree with each other.
  struct Fault {
    const char *before, *after;
  };
  const Fault faults[] = {
      {"[2,5,256]", "[5,2,256]"},  // tiles
      {"[2,5,256]", "[2,256,5]"},  // tiles
      {"[2,5,5]", "[5,2,5]"},      // the coupling matrix's rank
      {"[2,5,5]", "[5,5,2]"},     {"transfer.low_rank.core", "transfer.low_rank.cord"},
  };
  for (const Fault& fault : faults) {
    SCOPED_TRACE(fault.after);
    save_transfer_file(folder / "file", sample_data(Precision::kF32));
    replace_in_file(folder / "file", fault.before, fault.after);
    EXPECT_THROW(load_transfer_file(folder / "file"), Error);
  }
}

}  // namespace
}  // namespace rebounce::test_low_rank_file
