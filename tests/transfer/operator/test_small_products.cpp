// Which products share their loops out among threads.

#include <gtest/gtest.h>

#include <vector>

#include "transfer/operator/transfer_operator.h"

namespace rebounce::test_small_products {
namespace {

// Of a given size, and of one loop of eight tasks; keeps the scheduler that it was given.
class OneLoop final : public TransferOperator {
 public:
  explicit OneLoop(std::size_t bytes) : bytes_(bytes) {}

  std::size_t patch_count() const override { return 8; }
  std::size_t bytes() const override { return bytes_; }
  OperatorKind kind() const override { return OperatorKind::kDense; }
  std::size_t workspace_size() const override { return 0; }

  mutable Scheduler given{};

 private:
  void do_apply(std::span<const Float3> initial_exitance, std::span<Float3> indirect_irradiance,
                std::span<float> /*workspace*/, const Scheduler& scheduler) const override {
    given = scheduler;
    parallel_for(scheduler, 8,
                 [&](std::size_t i) { indirect_irradiance[i] = initial_exitance[i]; });
  }

  std::size_t bytes_;
};

// The scheduler that a product of `bytes` runs on if it is given this one.
Scheduler used_by(std::size_t bytes, const Scheduler& scheduler) {
  const OneLoop transfer(bytes);
  const std::vector<Float3> exitance(8, {1, 2, 3});
  std::vector<Float3> irradiance(8);
  transfer.apply(exitance, irradiance, {}, scheduler);
  EXPECT_EQ(irradiance, exitance);
  return transfer.given;
}

void run_here(void* /*user*/, std::uint32_t count, Scheduler::Task task, void* context) {
  for (std::uint32_t i = 0; i < count; ++i) task(context, i);
}

TEST(SmallProducts, StartNoThreads) {
  EXPECT_NE(used_by(100 * 1024, {}).parallel_for, nullptr);
  EXPECT_EQ(used_by(1024 * 1024, {}).parallel_for, nullptr);
}

TEST(SmallProducts, RunOnTheSchedulerOfTheCaller) {
  EXPECT_EQ(used_by(100 * 1024, {run_here}).parallel_for, run_here);
}

}  // namespace
}  // namespace rebounce::test_small_products
