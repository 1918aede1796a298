// Ranks that are threads of one process, joined as processes are by MPI.

#include "precompute/base/ranks.h"

#include <gtest/gtest.h>

#include <barrier>
#include <cstring>
#include <filesystem>
#include <functional>
#include <numeric>
#include <random>
#include <thread>

#include "precompute/build/transfer_build.h"
#include "tests/support/built_scene.h"
#include "tests/support/temporary_folder.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce {
namespace {

std::filesystem::path scene_path(const std::string& name) {
  return std::filesystem::path(REBOUNCE_SOURCE_DIR) / "tests" / "scenes" / (name + ".gltf");
}

/// What the threads share.
struct Meeting {
  explicit Meeting(std::size_t count) : barrier(static_cast<std::ptrdiff_t>(count)) {}
  std::barrier<> barrier;
  std::span<const std::byte> sent;
};

class ThreadRank final : public Communicator {
 public:
  ThreadRank(Meeting& meeting, std::size_t rank, std::size_t count)
      : meeting_(meeting), rank_(rank), count_(count) {}
  std::size_t rank() const override { return rank_; }
  std::size_t count() const override { return count_; }
  void broadcast(std::span<std::byte> bytes, std::size_t root) override {
    if (rank_ == root) meeting_.sent = bytes;
    meeting_.barrier.arrive_and_wait();
    ASSERT_EQ(meeting_.sent.size(), bytes.size()) << "ranks go different ways";
    if (rank_ != root) std::memcpy(bytes.data(), meeting_.sent.data(), bytes.size());
    meeting_.barrier.arrive_and_wait();
  }

 private:
  Meeting& meeting_;
  std::size_t rank_, count_;
};

/// Runs `work` on `count` ranks at once.
void on_ranks(std::size_t count, const std::function<void(std::size_t rank)>& work) {
  Meeting meeting(count);
  std::vector<std::jthread> threads;
  for (std::size_t rank = 0; rank < count; ++rank) {
    threads.emplace_back([&, rank] {
      ThreadRank communicator(meeting, rank, count);
      const CommunicatorScope scope(&communicator);
      work(rank);
    });
  }
}

TEST(Ranks, AThreadIsARankAlone) {
  const Ranks ranks;
  EXPECT_TRUE(ranks.alone());
  EXPECT_TRUE(ranks.makes(7, 3));
  std::vector<int> items = {1, 2, 3};
  ranks.share(std::span(items));
  ranks.add_up(std::span(items));
  EXPECT_EQ(items, (std::vector<int>{1, 2, 3}));
}

TEST(Ranks, EachItemIsMadeOnceAndSharedWithAll) {
  constexpr std::uint64_t kSeed = 13;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 engine(kSeed);
  for (int round = 0; round < 20; ++round) {
    const std::size_t count = 1 + engine() % 4, run = 1 + engine() % 5, size = engine() % 40;
    std::vector<std::uint64_t> wanted(size);
    std::ranges::generate(wanted, std::ref(engine));
    std::vector<std::size_t> lengths(size);
    for (std::size_t& length : lengths) length = engine() % 4;
    on_ranks(count, [&](std::size_t rank) {
      const Ranks ranks;
      std::vector<std::uint64_t> items(size, 0), times_made(size, 0);
      std::vector<std::vector<std::uint64_t>> lists(size);
      for (std::size_t k = 0; k < size; ++k) {
        if (!ranks.makes(k, run)) continue;
        items[k] = wanted[k];
        lists[k].assign(lengths[k], wanted[k]);
        times_made[k] = 1;
      }
      ranks.share(std::span(items), run);
      ranks.share(std::span(lists), run);
      ranks.add_up(std::span(times_made));
      EXPECT_EQ(items, wanted);
      EXPECT_EQ(times_made, std::vector<std::uint64_t>(size, 1));
      for (std::size_t k = 0; k < size; ++k) {
        EXPECT_EQ(lists[k], std::vector<std::uint64_t>(lengths[k], wanted[k]));
      }
      EXPECT_EQ(ranks.least(10 + rank), 10U);
    });
  }
}

TEST(Ranks, ALoneScopeSharesNothing) {
  on_ranks(2, [&](std::size_t rank) {
    const CommunicatorScope alone(nullptr);
    std::vector<std::size_t> items = {rank};
    Ranks().share(std::span(items));
    EXPECT_EQ(items.front(), rank);
  });
}

TEST(Ranks, BuildsHaveTheBytesOfOne) {
  const test::TemporaryFolder folder;
  BuildSettings settings = test::quick_settings(40);
  settings.exchange_source = ExchangeSource::kLinks;
  settings.tolerance = 0.02;
  const auto build = [&](const std::string& name) {
    BuildReport report;
    save_transfer_file(folder / name,
                       build_transfer_data(scene_path("white_room"), settings, report));
    return report.ray_count;
  };
  const std::uint64_t rays = build("alone");
  for (const std::size_t count : {2, 3}) {
    on_ranks(count, [&](std::size_t rank) { EXPECT_EQ(build(std::to_string(rank)), rays); });
    for (std::size_t rank = 0; rank < count; ++rank) {
      EXPECT_EQ(test::read_bytes(folder / std::to_string(rank)), test::read_bytes(folder / "alone"))
          << "rank " << rank << " of " << count;
    }
  }
}

TEST(Ranks, RefuseABuildFromPairs) {
  BuildSettings settings;
  settings.subdivision.patch_count = 50;
  settings.exchange_source = ExchangeSource::kPairs;
  on_ranks(2, [&](std::size_t) {
    BuildReport report;
    EXPECT_THROW(build_transfer_data(scene_path("cornell_box"), settings, report), Error);
  });
}

}  // namespace
}  // namespace rebounce
