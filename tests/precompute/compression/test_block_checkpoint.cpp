// Parts of an operator in a folder: found again as they were, or not at all.

#include "precompute/compression/block_checkpoint.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <numeric>

#include "tests/support/expect_error.h"
#include "tests/support/temporary_folder.h"
#include "transfer/format/operator_format.h"

namespace rebounce::test_block_checkpoint {
namespace {

const std::string kName = "cell_0000", kOther = "cell_0001";

BlockPart some_part(std::size_t value_count) {
  BlockPart part;
  part.blocks.push_back({.row_begin = 16, .row_count = 32, .column_begin = 0, .column_count = 16});
  part.blocks.push_back({.row_count = 16,
                         .column_count = 16,
                         .kind = TransferBlock::Kind::kLowRank,
                         .row_rank = 2,
                         .column_rank = 2});
  part.values.resize(value_count);
  std::iota(part.values.begin(), part.values.end(), 0.5F);
  return part;
}

/// A folder with one part, to be damaged.
struct Kept {
  test::TemporaryFolder folder;
  BlockCheckpoint checkpoint{folder.path(), "key"};
  std::string bytes;

  Kept() {
    checkpoint.keep(kName, some_part(100));
    bytes = test::read_bytes(folder / kName);
  }

  bool is_found_as(const std::string& other_bytes) const {
    test::write_bytes(folder / kName, other_bytes);
    return checkpoint.find(kName).has_value();
  }
};

TEST(BlockCheckpoint, FindsWhatWasKept) {
  const Kept kept;
  const BlockPart part = some_part(100);
  const std::optional<BlockPart> found = kept.checkpoint.find(kName);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->values, part.values);
  ASSERT_EQ(found->blocks.size(), part.blocks.size());
  EXPECT_EQ(found->blocks[0].row_begin, 16U);
  EXPECT_EQ(found->blocks[1].kind, TransferBlock::Kind::kLowRank);
  EXPECT_EQ(kept.folder.names().size(), 1U) << "a temporary file was left";
  EXPECT_TRUE(kept.is_found_as(kept.bytes));
}

TEST(BlockCheckpoint, MakesWhatItDoesNotFindAndOnlyThat) {
  const Kept kept;
  int made = 0;
  const auto make = [&] {
    ++made;
    return some_part(7);
  };
  EXPECT_EQ(kept.checkpoint.find_or_make(kName, make).values.size(), 100U);
  EXPECT_EQ(made, 0);
  EXPECT_EQ(kept.checkpoint.find_or_make(kOther, make).values.size(), 7U);
  EXPECT_EQ(kept.checkpoint.find_or_make(kOther, make).values.size(), 7U);
  EXPECT_EQ(made, 1);
}

TEST(BlockCheckpoint, DoesNotTakeWhatWasMadeForSomethingElse) {
  const Kept kept;
  EXPECT_FALSE(BlockCheckpoint(kept.folder.path(), "another key").find(kName));
  std::filesystem::copy_file(kept.folder / kName, kept.folder / kOther);
  EXPECT_FALSE(kept.checkpoint.find(kOther)) << "another part under this name";
}

TEST(BlockCheckpoint, DoesNotTakeADamagedFile) {
  const Kept kept;
  for (std::size_t place = 0; place < kept.bytes.size(); place += 3) {
    std::string bytes = kept.bytes;
    bytes[place] ^= 1;
    EXPECT_FALSE(kept.is_found_as(bytes)) << place;
  }
  for (std::size_t size = 0; size < kept.bytes.size(); size += 11) {
    EXPECT_FALSE(kept.is_found_as(kept.bytes.substr(0, size))) << size;
  }
  EXPECT_FALSE(kept.is_found_as(kept.bytes + "x"));
  EXPECT_FALSE(kept.is_found_as(std::string(kept.bytes.size(), '\0')));
  // Counts that no memory holds, and whose products overflow.
  for (const char digit : {'\xff', '\x40', '\x7f'}) {
    std::string bytes = kept.bytes;
    bytes.replace(80, 16, 16, digit);
    EXPECT_FALSE(kept.is_found_as(bytes));
  }
}

TEST(BlockCheckpoint, WithoutAFolderNothingIsKept) {
  const BlockCheckpoint nowhere, empty("", "key");
  for (const BlockCheckpoint* checkpoint : {&nowhere, &empty}) {
    EXPECT_FALSE(checkpoint->keeps());
    checkpoint->keep(kName, some_part(3));
    EXPECT_FALSE(checkpoint->find(kName));
  }
}

TEST(BlockCheckpoint, SaysWhereItCannotKeep) {
  const test::TemporaryFolder folder;
  test::write_bytes(folder / "file", "no folder");
  test::expect_error([&] { BlockCheckpoint(folder / "file", "key"); }, "checkpoints");
  test::expect_error([] { BlockCheckpoint("/proc/self", "key"); }, "cannot write /proc/self");
  const BlockCheckpoint checkpoint(folder.path(), "key");
  std::filesystem::create_directory(folder / kName);
  EXPECT_FALSE(checkpoint.find(kName));
  test::expect_error([&] { checkpoint.keep(kName, some_part(3)); }, kName);
}

}  // namespace
}  // namespace rebounce::test_block_checkpoint
