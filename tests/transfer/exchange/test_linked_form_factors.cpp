// A product with links against the dense matrix that they stand for, and links in a file.

#include "transfer/exchange/linked_form_factors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "rebounce/error.h"
#include "tests/support/expect_error.h"
#include "tests/support/hierarchical_samples.h"
#include "tests/support/plain_data.h"
#include "tests/support/temporary_folder.h"
#include "transfer/base/bfloat16.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce::test_linked_form_factors {
namespace {

constexpr std::size_t kPatchCount = 4;

const std::vector<float> kArea = {1, 2, 3, 0.5F};
const std::vector<Float3> kCentroid = {{0, 0, 0}, {1, 0, 2}, {0, 3, 1}, {2, 2, 2}};

/// Nodes: 0 = {1, 2 children}, 1 = {3, 4}, 2 = {5, 6}; leaves 3 to 6 hold patches 2, 0, 3, 1.
FormFactorLinks sample_links() {
  FormFactorLinks links;
  links.patch = {2, 0, 3, 1};
  links.first_child = {1, 3, 5, kNone, kNone, kNone, kNone};
  links.count = {4, 2, 2, 1, 1, 1, 1};
  links.pair = {{1, 2}, {3, 4}, {5, 2}, {6, 6}};
  links.exchange_area = {0.7F, 0.2F, 0.3F, 0.1F};
  links.gradient = {{0.1F, -0.2F, 0.05F, 0.3F, 0.1F, -0.1F}, {}, {0, 0, 0, 0.2F, 0.1F, 0}, {}};
  links.scale = {1, 0.9F, 1.1F, 1.2F};
  return links;
}

std::vector<std::uint32_t> members_of(const FormFactorLinks& links, std::uint32_t node) {
  const std::vector<std::uint32_t> begin = {0, 0, 2, 0, 1, 2, 3};
  return {links.patch.begin() + begin[node], links.patch.begin() + begin[node] + links.count[node]};
}

struct Whole {
  double area = 0;
  std::array<double, 3> center{};
};

Whole whole_of(const std::vector<std::uint32_t>& members) {
  Whole whole;
  for (const std::uint32_t i : members) whole.area += kArea[i];
  for (const std::uint32_t i : members) {
    for (int k = 0; k < 3; ++k) whole.center[k] += kArea[i] * kCentroid[i][k] / whole.area;
  }
  return whole;
}

/// Gradients have the eight bits of a bfloat16.
double as_kept(float gradient) {
  return bfloat16_to_float(float_to_bfloat16(gradient));
}

/// F as the definition of a link has it.
std::array<std::array<double, kPatchCount>, kPatchCount> dense_of(const FormFactorLinks& links) {
  std::array<std::array<double, kPatchCount>, kPatchCount> f{};
  for (std::size_t l = 0; l < links.pair.size(); ++l) {
    const auto in_a = members_of(links, links.pair[l][0]),
               in_b = members_of(links, links.pair[l][1]);
    const Whole a = whole_of(in_a), b = whole_of(in_b);
    for (const std::uint32_t i : in_a) {
      for (const std::uint32_t j : in_b) {
        double exchange = links.exchange_area[l];
        for (int k = 0; k < 3; ++k) {
          exchange += as_kept(links.gradient[l][k]) * (kCentroid[i][k] - a.center[k]) +
                      as_kept(links.gradient[l][3 + k]) * (kCentroid[j][k] - b.center[k]);
        }
        exchange *= kArea[i] * kArea[j] / (a.area * b.area) * links.scale[i] * links.scale[j];
        f[i][j] += exchange / kArea[i];
        if (links.pair[l][0] != links.pair[l][1]) f[j][i] += exchange / kArea[j];
      }
    }
  }
  return f;
}

TEST(LinkedFormFactors, GatherIsTheDenseProduct) {
  const FormFactorLinks links = sample_links();
  const LinkedFormFactors form_factors(links, kArea, kCentroid);
  const std::vector<Float3> in = {{1, 0, 2}, {0.5F, 1, 0}, {3, 0, 1}, {0, 2, 4}};
  const std::vector<Float3> out = gather(form_factors, in);
  const auto f = dense_of(links);
  for (std::size_t i = 0; i < kPatchCount; ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      double wanted = 0;
      for (std::size_t j = 0; j < kPatchCount; ++j) wanted += f[i][j] * in[j][c];
      EXPECT_NEAR(out[i][c], wanted, 1e-6) << i;
    }
  }
}

TEST(LinkedFormFactors, OnePatchIsATree) {
  FormFactorLinks links;
  links.patch = {0};
  links.first_child = {kNone};
  links.count = {1};
  links.scale = {1};
  const LinkedFormFactors form_factors(links, std::vector<float>{2},
                                       std::vector<Float3>{{1, 1, 1}});
  EXPECT_EQ(gather(form_factors, std::vector<Float3>{{1, 2, 3}})[0], (Float3{0, 0, 0}));
}

TEST(LinkedFormFactors, RefuseWhatIsNotATreeWithLinks) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<std::function<void(FormFactorLinks&)>> damages = {
      [](auto& l) { l.patch.pop_back(); },      [](auto& l) { l.patch[0] = 4; },
      [](auto& l) { l.patch[0] = 0; },          [](auto& l) { l.first_child[0] = 0; },
      [](auto& l) { l.first_child[0] = 6; },    [](auto& l) { l.first_child[1] = kNone; },
      [](auto& l) { l.first_child[3] = 5; },    [](auto& l) { l.first_child.pop_back(); },
      [](auto& l) { l.count[0] = 3; },          [](auto& l) { l.count[1] = kNone; },
      [](auto& l) { l.count[3] = 2; },          [](auto& l) { l.count.pop_back(); },
      [](auto& l) { l.pair[0][1] = 7; },        [](auto& l) { l.pair.pop_back(); },
      [](auto& l) { l.exchange_area[1] = -1; }, [](auto& l) { l.exchange_area[1] = kNan; },
      [](auto& l) { l.gradient[0][4] = kNan; }, [](auto& l) { l.gradient.pop_back(); },
      [](auto& l) { l.scale[2] = -1; },         [](auto& l) { l.scale[2] = kNan; },
      [](auto& l) { l.scale.pop_back(); },
  };
  EXPECT_NO_THROW(check_links(sample_links(), kPatchCount));
  for (std::size_t k = 0; k < damages.size(); ++k) {
    FormFactorLinks links = sample_links();
    damages[k](links);
    EXPECT_THROW(check_links(links, kPatchCount), Error) << k;
  }
  EXPECT_THROW(check_links(sample_links(), 3), Error);
  EXPECT_THROW(LinkedFormFactors(sample_links(), kArea, std::vector<Float3>(3)), Error);
}

TransferData sample_data() {
  TransferData data = test::plain_data(kArea);
  data.patches.centroid = kCentroid;
  HierarchicalStorage storage = test::random_hierarchical_storage(kPatchCount, 1, 5);
  storage.area = kArea;
  data.transfer = std::make_shared<const HierarchicalOperator>(std::move(storage));
  return data;
}

TEST(LinkedFormFactors, AreInTheFileIfWanted) {
  const test::TemporaryFolder folder;
  TransferData data = sample_data();
  save_transfer_file(folder / "without", data);
  EXPECT_TRUE(load_transfer_file(folder / "without").links.empty());
  data.links = sample_links();
  save_transfer_file(folder / "with", data);
  const FormFactorLinks loaded = load_transfer_file(folder / "with").links;
  EXPECT_EQ(loaded.patch, data.links.patch);
  EXPECT_EQ(loaded.first_child, data.links.first_child);
  EXPECT_EQ(loaded.count, data.links.count);
  EXPECT_EQ(loaded.pair, data.links.pair);
  EXPECT_EQ(loaded.exchange_area, data.links.exchange_area);
  EXPECT_EQ(loaded.gradient, data.links.gradient);
  EXPECT_EQ(loaded.scale, data.links.scale);
}

TEST(LinkedFormFactors, ThatAreDamagedInAFileAreRefused) {
  const test::TemporaryFolder folder;
  TransferData data = sample_data();
  data.links = sample_links();
  data.links.pair[0][0] = 99;
  save_transfer_file(folder / "file", data);
  test::expect_error([&] { load_transfer_file(folder / "file"); },
                     "a link joins a node that does not exist");
}

}  // namespace
}  // namespace rebounce::test_linked_form_factors
