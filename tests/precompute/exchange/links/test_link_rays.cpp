// Shadow rays between nodes: fewer tell of what kind the visibility is.

#include "precompute/exchange/links/link_rays.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>

#include "tests/support/test_scenes.h"

namespace rebounce::test_link_rays {
namespace {

constexpr std::array kCounts = {8, 32, 64, 256};

class LinkRaysOfRoom : public testing::Test {
 protected:
  using Wanted = LinkRays::Wanted;

  /// Calls `visit`(a, b) for pairs of nodes of all sizes.
  template <typename Visit>
  void for_each_pair(const Visit& visit) const {
    const auto count = static_cast<std::uint32_t>(tree_.nodes().size());
    for (std::uint32_t a = 1; a < count; a += 7) {
      for (std::uint32_t b = a + 1; b < count; b += 3) {
        if (!cannot_exchange(tree_[a], tree_[b])) visit(a, b);
      }
    }
  }

  const PatchModel model_ =
      make_patch_model(test::room_with_block({0.5F, 0.5F, 0.5F}), {.patch_count = 300});
  const RayTracer tracer_ = test::make_tracer(model_);
  const PatchGeometry geometry_{model_, tracer_};
  const ShadowRays shadow_rays_{geometry_, 1, 1e-3};
  const LinkTree tree_{model_, geometry_};
  const LinkRays rays_{tree_, shadow_rays_, tracer_, 1};
  LinkRays::Scratch scratch_;
};

TEST_F(LinkRaysOfRoom, FewerTellTheKind) {
  std::size_t mixed = 0, clear = 0, hidden = 0, all = 0, few = 0;
  for_each_pair([&](std::uint32_t a, std::uint32_t b) {
    const int count = kCounts[(a + b) % kCounts.size()];
    const LinkRays::Visibility visible = rays_.trace(a, b, count, Wanted::kVisibility, scratch_);
    ASSERT_EQ(scratch_.rays.size(), count);
    const LinkRays::Visibility kind = rays_.trace(a, b, count, Wanted::kKind, scratch_);
    ASSERT_LE(scratch_.rays.size(), count);
    ASSERT_EQ(kind.mixed, visible.mixed) << a << ", " << b;
    if (visible.mixed) {
      ++mixed;
      all += static_cast<std::size_t>(count);
      few += scratch_.rays.size();
    } else {
      ASSERT_EQ(scratch_.rays.size(), count);
      ASSERT_EQ(kind.part, visible.part);
      ++(visible.part > 0 ? clear : hidden);
    }
  });
  EXPECT_GT(mixed, 100U);
  EXPECT_GT(clear, 100U);
  EXPECT_GT(hidden, 100U);
  EXPECT_LT(2 * few, all);
}

}  // namespace
}  // namespace rebounce::test_link_rays
