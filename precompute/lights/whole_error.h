#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/exchange/pairs/hemisphere_exchange.h"
#include "precompute/lights/error_reference.h"
#include "precompute/lights/solve_batches.h"
#include "rebounce/build_report.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Estimates how far the light of an operator from links is from that of exact form factors.
///
/// Let F be the exact form factors, and B and H the radiosity and the indirect irradiance that the
/// links give. The residual r = F B - H is what one gather along links is off, and the light of F
/// differs from H by P r with P = (I - F rho)^-1. Rays into the hemispheres of some patches
/// estimate r without bias: the mean of B where they end, less H, divided by the probability that
/// the patch is among them (D. G. Horvitz and D. J. Thompson, "A generalization of sampling without
/// replacement from a finite universe", 1952). This is done kGroups times, with patches and rays
/// that are independent of each other. The product of what two groups say of P r is an estimate
/// without bias of its squared norm, to which the noise of neither adds. P is applied by an
/// operator or along the links, which changes the norm by as little as they are off. The confidence
/// is that of a jackknife over the groups (K. M. Wolter, "Introduction to Variance Estimation",
/// 1985). notes/concepts/errors.md explains it.
class WholeErrorEstimator {
 public:
  static constexpr std::size_t kGroups = 4;

  /// Patches and rays of each group.
  struct Sample {
    std::size_t patch_count = 65536;  ///< at most; of scenes with fewer, all
    int ray_count = 1024;             ///< of each of these patches
  };

  /// The sample for so many patches: as many rays as memory and noise ask for, or a `part` of them.
  static Sample sample_for(std::size_t patch_count, double part = 1);

  /// `data` must outlive the object. The same `seed` gives the same estimate.
  WholeErrorEstimator(const TransferData& data, const PatchRoles& roles, std::uint64_t seed,
                      const Sample& sample);

  /// Adds a light: its initial exitance, the indirect irradiance that the links give, and at
  /// receivers that of the operator; all [n] in lx.
  void add(std::span<const Float3> initial_exitance, std::span<const Float3> truth,
           std::span<const Float3> result);

  /// The errors over all lights, relative to the light that arrives: what the links give or, where
  /// that is more, what is missing less what they give. Zeros without any light. `shown_patch` [t]
  /// is that of PatchModel. `transfer` is that of the links, or of an operator that is near; a
  /// hundredth does not matter. No light may be added afterwards. Throws Cancelled if asked to
  /// stop.
  WholeError estimate(std::span<const std::uint32_t> shown_patch, const RayTracer& tracer,
                      const IrradiancesOf& transfer, const Progress& progress = {});

  /// The residual of `transfer`, relative to the reflected light, that suffices.
  static constexpr double kSpreadResidual = 1e-2;

 private:
  /// The products of the light that two groups find missing, and of that with the error of
  /// compression.
  struct Products {
    std::array<std::array<double, kGroups>, kGroups> of_groups{};
    std::array<double, kGroups> with_compression{};
    double of_compression = 0;
  };

  /// What rays of some patches of a group met.
  struct MetRows {
    std::size_t begin;                         ///< the first of the patches
    std::vector<std::vector<MetPatch>> patch;  ///< of each of them
    std::size_t end() const { return begin + patch.size(); }
  };

  MetRows trace(std::size_t group, std::size_t begin, std::size_t end,
                std::span<const std::uint32_t> shown_patch, const RayTracer& tracer,
                const Progress& progress) const;
  std::vector<std::vector<MetPatch>> met_by(std::size_t group, const MetRows& met,
                                            std::span<const std::uint32_t> row) const;
  std::vector<std::vector<Float3>> without_gathered(std::size_t group) const;
  void add_gathered(std::size_t group, const MetRows& met);
  void gather(std::span<const std::uint32_t> shown_patch, const RayTracer& tracer,
              const Progress& progress);
  std::vector<Float3> residual(std::size_t group, std::size_t light) const;
  void spread(const IrradiancesOf& transfer, std::size_t first, std::size_t count);
  Products products(std::size_t light, std::size_t place) const;

  const TransferData& data_;
  PatchRoles roles_;
  std::uint64_t seed_;
  int ray_count_;
  std::array<std::vector<std::uint32_t>, kGroups> patch_;  ///< of each group, ascending
  std::vector<std::vector<Float3>> truth_, radiosity_;     ///< of each light, until rays are traced
  std::vector<std::vector<Float3>>
      compression_;  ///< of each light: operator less links, at receivers
  std::array<std::vector<std::vector<Float3>>, kGroups> residual_;  ///< [group][patch][light]
  std::vector<std::vector<Float3>> missing_;  ///< of the lights at work, by light and group
  ErrorReference received_;
};

}  // namespace rebounce
