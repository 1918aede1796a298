// Compressed operators of the rows of receivers and the columns of sources, against those of all
// patches.

#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>

#include "precompute/compression/form_factor_compression.h"
#include "precompute/compression/hierarchical_transfer.h"
#include "precompute/compression/matrix_free_transfer.h"
#include "tests/support/solved_room.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/unshadowed_lights.h"

namespace rebounce::test_restricted_transfer {
namespace {

using Lights = std::vector<std::vector<Float3>>;

/// A room of 4 x 3 x 5 m with two blocks.
struct Room : test::SolvedRoom {
  Room(const Scene& scene, std::size_t patch_count) : SolvedRoom(scene, patch_count) {}

  Lights lights(int count, std::uint64_t seed) const {
    return test::unshadowed_lights(patches, count, seed, 1.6, 1.2);
  }
  Lights training = lights(16, 1), validation = lights(12, 2), others = lights(24, 3);
};

Scene room_with_two_blocks() {
  Scene scene = test::room_with_block({0.7F, 0.5F, 0.2F});
  test::add_box(scene, {2.5, 0, 3}, {3, 1, 4}, false);
  return scene;
}

const Room& room() {
  static const Room made(room_with_two_blocks(), 800);
  return made;
}

using Place = std::function<bool(const Float3&)>;

bool anywhere(const Float3& /*p*/) {
  return true;
}
bool before(const Float3& p) {
  return p[2] < 2.5F;
}
bool behind(const Float3& p) {
  return p[2] >= 2.5F;
}

PatchRoles roles_at(const PatchTable& patches, const Place& receivers, const Place& sources) {
  PatchRoles roles;
  for (const Float3& p : patches.centroid) {
    const int role =
        (receivers(p) ? PatchRoles::kReceiver : 0) | (sources(p) ? PatchRoles::kSource : 0);
    roles.role.push_back(static_cast<std::uint8_t>(role));
  }
  return roles;
}

struct Choice {
  const char* name;
  Place receivers, sources;
};
const Choice kChoices[] = {{"half of both", before, before},
                           {"from one half to the other", before, behind},
                           {"half the receivers", before, anywhere},
                           {"half the sources", anywhere, behind}};

/// Y of all three channels, [3][n][n].
std::vector<float> expansion(const TransferOperator& transfer) {
  const std::size_t n = transfer.patch_count();
  std::vector<float> y(3 * n * n);
  for (int c = 0; c < kChannelCount; ++c)
    transfer.expand(c, std::span(y).subspan(c * n * n, n * n));
  return y;
}

/// Relative difference of the entries that receivers and sources share; all others must be 0.
double entry_error(const Room& room, const TransferOperator& transfer) {
  const std::size_t n = transfer.patch_count();
  const PatchRoles& roles = transfer.roles();
  const std::vector<float> a = expansion(*room.dense), b = expansion(transfer);
  double error = 0, norm = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    const std::size_t i = k / n % n, j = k % n;
    if (roles.is_receiver(i) && roles.is_source(j)) {
      error += std::pow(static_cast<double>(a[k]) - b[k], 2);
      norm += std::pow(static_cast<double>(a[k]), 2);
    } else if (b[k] != 0) {
      return std::numeric_limits<double>::infinity();
    }
  }
  return std::sqrt(error / norm);
}

TEST(ReceiversAndSources, EntriesAreThoseOfTheWholeAtALowMultiplier) {
  for (const Choice& choice : {kChoices[1], kChoices[2]}) {
    SCOPED_TRACE(choice.name);
    const PatchRoles roles = roles_at(room().patches, choice.receivers, choice.sources);
    const HierarchicalOperator transfer(
        compress_transfer(*room().dense, room().patches, room().training, 1e-16, {}, roles));
    EXPECT_EQ(transfer.roles(), roles);
    EXPECT_LT(entry_error(room(), transfer), 1e-5);
  }
}

TEST(ReceiversAndSources, NoBlockIsStoredThatTheyDoNotShare) {
  for (const Choice& choice : kChoices) {
    SCOPED_TRACE(choice.name);
    const PatchRoles roles = roles_at(room().patches, choice.receivers, choice.sources);
    const auto storage =
        compress_transfer(*room().dense, room().patches, room().training, 1e-8, {}, roles);
    const auto any = [&](std::uint32_t begin, std::uint32_t count, std::uint8_t bit) {
      const std::size_t end = std::min<std::size_t>(begin + count, storage.patch.size());
      return std::any_of(storage.patch.begin() + begin,
                         storage.patch.begin() + static_cast<std::ptrdiff_t>(end),
                         [&](std::uint32_t p) { return roles.has(p, bit); });
    };
    for (const TransferBlock& b : storage.blocks) {
      const bool to_rows = any(b.row_begin, b.row_count, PatchRoles::kReceiver) &&
                           any(b.column_begin, b.column_count, PatchRoles::kSource);
      const bool to_columns = any(b.column_begin, b.column_count, PatchRoles::kReceiver) &&
                              any(b.row_begin, b.row_count, PatchRoles::kSource);
      EXPECT_TRUE(to_rows || to_columns);
    }
  }
}

TEST(ReceiversAndSources, BytesFallInProportionAtTheSameTolerance) {
  const HierarchicalSettings settings{.tolerance = 0.005};
  const FittingLights lights{room().training, room().validation};
  const auto whole = build_hierarchical_transfer(*room().dense, room().patches, lights, settings);
  // Half of both have a quarter of all pairs, but half of the near ones, which take the most; where
  // only the receivers are fewer, reciprocity had stored what is left out but once.
  for (const auto& [choice, part] : {std::pair(kChoices[0], 0.6), std::pair(kChoices[1], 0.5),
                                     std::pair(kChoices[2], 0.85), std::pair(kChoices[3], 0.85)}) {
    SCOPED_TRACE(choice.name);
    const PatchRoles roles = roles_at(room().patches, choice.receivers, choice.sources);
    const auto some =
        build_hierarchical_transfer(*room().dense, room().patches, lights, settings, {}, roles);
    // Sixteen lights shape it, of which sources are half, and others judge.
    EXPECT_LT(room().mean_error(*some, room().others), 1.2 * settings.tolerance);
    const double bytes = static_cast<double>(some->bytes()) / static_cast<double>(whole->bytes());
    RecordProperty(choice.name, std::to_string(bytes));
    EXPECT_LT(bytes, part);
    EXPECT_GT(bytes, 0.1);
  }
}

TEST(ReceiversAndSources, SameBitsForAnyNumberOfThreads) {
  const PatchRoles roles = roles_at(room().patches, before, anywhere);
  const auto compressed = [&](int threads) {
    const int usual = omp_get_max_threads();
    omp_set_num_threads(threads);
    auto storage =
        compress_transfer(*room().dense, room().patches, room().training, 1e-7, {}, roles);
    omp_set_num_threads(usual);
    return storage;
  };
  const auto one = compressed(1), four = compressed(4);
  EXPECT_TRUE(std::ranges::equal(one.values_f32, four.values_f32));
  EXPECT_EQ(one.patch, four.patch);
}

/// Of cells whose couplings were solved for, in a checkpoint.
int cell_count(const std::filesystem::path& folder) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    count += entry.path().filename().string().starts_with("cell_") ? 1 : 0;
  }
  return count;
}

TEST(ReceiversAndSources, OnlyTheirCouplingsAreSolvedFor) {
  const auto form_factors =
      compress_form_factors(room().exchange, room().patches, {room().training, room().validation},
                            {.tolerance = 1e-3, .precision = Precision::kF32});
  const auto build = [&](const PatchRoles& roles, const std::filesystem::path& cells) {
    MatrixFreeTransferSettings settings{.compression = {.tolerance = 0.01}};
    settings.roles = roles;
    settings.checkpoint = cells;
    return build_matrix_free_transfer(*form_factors, room().patches,
                                      {room().training, room().validation}, settings);
  };
  const test::TemporaryFolder folder;
  build({}, folder / "all");
  const auto corner = [](const Float3& p) { return p[2] < 1 && p[0] < 2; };
  for (const Choice& choice :
       {Choice{"few receivers", corner, anywhere}, Choice{"few sources", anywhere, corner}}) {
    SCOPED_TRACE(choice.name);
    const auto cells = folder / choice.name;
    const auto some = build(roles_at(room().patches, choice.receivers, choice.sources), cells);
    EXPECT_LT(cell_count(cells), cell_count(folder / "all"));
    EXPECT_LT(room().mean_error(*some, room().others), 0.015);
  }
}

}  // namespace
}  // namespace rebounce::test_restricted_transfer
