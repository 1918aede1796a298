// Hierarchical operators that serve some receivers and sources alone.

#include "rebounce/scene_data.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/expect_error.h"
#include "tests/support/hierarchical_samples.h"
#include "tests/support/operator_checks.h"
#include "transfer/base/area_norm.h"
#include "transfer/format/hierarchical_encoding.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce::test_patch_roles {
namespace {

using test::expect_error;
using test::unaided_product;
using test::with_roles;

constexpr std::size_t kPatchCount = 777;

/// What the operator of all patches gives receivers of the light of sources.
std::vector<Float3> part_of_product(const HierarchicalOperator& whole, const PatchRoles& roles,
                                    std::vector<Float3> m0) {
  roles.keep(PatchRoles::kSource, m0);
  std::vector<Float3> h = unaided_product(whole, m0);
  roles.keep(PatchRoles::kReceiver, h);
  return h;
}

TEST(PatchRoles, CountsAndKeeps) {
  const PatchRoles all;
  EXPECT_TRUE(all.all_are_both());
  EXPECT_TRUE(all.is_receiver(3) && all.is_source(3));
  EXPECT_EQ(all.count(PatchRoles::kSource, 5), 5U);
  const PatchRoles roles{{0, 1, 2, 3}};
  EXPECT_EQ(roles.count(PatchRoles::kReceiver, 4), 2U);
  EXPECT_EQ(roles.count(PatchRoles::kSource, 4), 2U);
  std::vector<Float3> light(4, Float3{1, 1, 1});
  roles.keep(PatchRoles::kReceiver, light);
  EXPECT_EQ(light, (std::vector<Float3>{{0, 0, 0}, {1, 1, 1}, {0, 0, 0}, {1, 1, 1}}));
}

TEST(PatchRoles, AnApplyIsThatPartOfTheWhole) {
  for (const std::uint32_t matrices : {1U, 3U}) {
    const auto storage = test::random_hierarchical_storage(kPatchCount, matrices, 6);
    const auto some = with_roles(storage);
    const std::vector<Float3> m0 = test::random_light(kPatchCount, 1, 100);
    for (const auto& [precision, allowed] :
         {std::pair(Precision::kF32, 2e-6), std::pair(Precision::kF16, 2e-6),
          std::pair(Precision::kQ8, 5e-5)}) {
      const HierarchicalOperator whole(encode_values(storage, precision));
      const HierarchicalOperator op(encode_values(some, precision));
      EXPECT_EQ(op.roles(), some.roles);
      const std::vector<Float3> h = unaided_product(op, m0);
      EXPECT_LT(relative_difference(h, part_of_product(whole, some.roles, m0), storage.area),
                allowed);
      for (std::size_t i = 0; i < kPatchCount; ++i) {
        if (!some.roles.is_receiver(i)) {
          EXPECT_EQ(h[i], (Float3{0, 0, 0}));
        }
      }
    }
  }
}

TEST(PatchRoles, TheExpansionIsThatPartOfTheWhole) {
  const auto storage = test::random_hierarchical_storage(kPatchCount, 3, 6);
  const auto some = with_roles(storage);
  std::vector<float> whole(kPatchCount * kPatchCount), part(whole);
  HierarchicalOperator(storage).expand(1, whole);
  HierarchicalOperator(some).expand(1, part);
  for (std::size_t i = 0; i < kPatchCount; ++i) {
    for (std::size_t j = 0; j < kPatchCount; ++j) {
      const bool wanted = some.roles.is_receiver(i) && some.roles.is_source(j);
      ASSERT_EQ(part[i * kPatchCount + j], wanted ? whole[i * kPatchCount + j] : 0.0F);
    }
  }
}

TEST(PatchRoles, WhatIsNotWantedIsNotRead) {
  const auto storage = test::random_hierarchical_storage(kPatchCount, 3, 6);
  std::vector<std::uint32_t> all(storage.patch);
  const auto read = [&](const HierarchicalOperator& op) { return op.receivers(all).value_count(); };
  EXPECT_LT(static_cast<double>(read(HierarchicalOperator(with_roles(storage)))),
            0.8 * static_cast<double>(read(HierarchicalOperator(storage))));
}

TEST(PatchRoles, AskedForOthersTheyGetNoLight) {
  const auto some = with_roles(test::random_hierarchical_storage(kPatchCount, 2, 6));
  const HierarchicalOperator op(some);
  const std::vector<Float3> m0 = test::random_light(kPatchCount, 1, 100),
                            whole = unaided_product(op, m0);
  const std::vector<std::uint32_t> asked(some.patch.begin() + 200, some.patch.begin() + 500);
  constexpr Float3 kUnset = {-1, -2, -3};
  std::vector<Float3> h(kPatchCount, kUnset), expected(h);
  for (const std::uint32_t p : asked) expected[p] = whole[p];
  std::vector<float> workspace(op.workspace_size(), std::nanf(""));
  op.apply_to(op.receivers(asked), m0, h, workspace);
  EXPECT_LT(relative_difference(h, expected, some.area), 1e-6);
  for (std::size_t i = 0; i < kPatchCount; ++i) {
    EXPECT_EQ(h[i] == kUnset, expected[i] == kUnset);
    if (expected[i] == Float3{0, 0, 0}) {
      EXPECT_EQ(h[i], expected[i]);
    }
  }
}

TEST(PatchRoles, ThoseThatDoNotFitAreRefused) {
  const auto attempt = [](std::vector<std::uint8_t> role) {
    auto storage = test::random_hierarchical_storage(4, 1, 1);
    storage.roles.role = std::move(role);
    return [storage] { HierarchicalOperator{storage}; };
  };
  expect_error(attempt({3, 3, 3}), "3 roles for 4 patches");
  expect_error(attempt({3, 3, 3, 3, 3}), "5 roles for 4 patches");
  expect_error(attempt({3, 3, 4, 3}), "role of patch 2 is 4");
  expect_error(attempt({2, 2, 0, 2}), "no patch is a receiver");
  expect_error(attempt({1, 1, 0, 1}), "no patch is a source");
  HierarchicalOperator{test::random_hierarchical_storage(4, 1, 1)};
}

}  // namespace
}  // namespace rebounce::test_patch_roles
