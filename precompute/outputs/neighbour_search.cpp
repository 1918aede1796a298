#include "precompute/outputs/neighbour_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "precompute/patches/element_neighbours.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"

namespace rebounce {
namespace {

constexpr float kCreaseCosine = 0.766F;  // 40 degrees: rounder shapes are meant to look smooth

// The largest distance of a patch from the plane of a vertex, as a fraction of the reach.
constexpr float kPlaneReach = 0.25F;

// Points that represent a patch.
constexpr std::size_t kSampleCount = 16;

// A flat surface has about 50 samples within the reach of a vertex and four times as many within
// twice the reach. Only folded surfaces (a carpet, leaves) have more (lab/030).
constexpr std::size_t kMostSamples = 512;

// Candidates that are examined for kMostSites visible ones; more are needed only where nearly all
// are hidden.
constexpr std::size_t kMostLooks = 4 * kMostSites;

}  // namespace

NeighbourSearch::NeighbourSearch(const DisplayMesh& mesh, const PatchTriangles& triangles,
                                 std::span<const float> area, std::span<const float> absorbed,
                                 const RayTracer& tracer)
    : absorbed_(absorbed), tracer_(tracer) {
  const std::size_t n = triangles.patch_count();
  samples_.resize(n * kSampleCount);
  positions_.resize(n * kSampleCount);
#pragma omp parallel for schedule(dynamic, 64)
  for (std::size_t i = 0; i < n; ++i) {
    std::array<PatchPoint, kSampleCount> points;
    spread_points(mesh, triangles[i], unit_square(mix_bits(i)), points);
    for (std::size_t k = 0; k < kSampleCount; ++k) {
      const std::size_t place = i * kSampleCount + k;
      samples_[place] = {to_glm(points[k].position), to_glm(points[k].normal),
                         static_cast<std::uint32_t>(i), area[i] / kSampleCount};
      positions_[place] = points[k].position;
    }
  }
  finder_.emplace(positions_);
}

std::vector<ReconstructionSite> NeighbourSearch::find(const Receiver& receiver,
                                                      std::span<const std::uint32_t> own,
                                                      float reach, Scratch& scratch) const {
  find_candidates(receiver, reach, scratch);
  std::vector<ReconstructionSite>& candidates = scratch.candidates_;
  std::ranges::sort(candidates, [](const ReconstructionSite& a, const ReconstructionSite& b) {
    return a.weight != b.weight ? a.weight > b.weight : a.patch < b.patch;
  });
  candidates.resize(std::min(candidates.size(), kMostLooks));
  scratch.in_sight_.assign(candidates.size(), 0);
  std::vector<ReconstructionSite> sites;
  for (std::size_t k = 0, looked = 0; k < candidates.size() && sites.size() < kMostSites; ++k) {
    if (k == looked) {
      looked = std::min(candidates.size(), looked + kMostSites - sites.size());
      look_at_next(receiver, k, looked, own, scratch);
    }
    if (scratch.in_sight_[k] != 0) sites.push_back(candidates[k]);
  }
  std::ranges::sort(sites, {}, &ReconstructionSite::patch);
  return sites;
}

void NeighbourSearch::find_candidates(const Receiver& receiver, float reach,
                                      Scratch& scratch) const {
  reach = finder_->within(to_float3(receiver.position), reach, kMostSamples, scratch.found_);
  scratch.candidates_.clear();
  for (const auto& [index, distance_squared] : scratch.found_) {
    const Sample& sample = samples_[index];
    if (glm::dot(sample.normal, receiver.normal) < kCreaseCosine) continue;
    if (absorbed_[sample.patch] > kMostlyCovered) continue;
    const float height = glm::dot(sample.position - receiver.position, receiver.normal);
    if (std::abs(height) <= kPlaneReach * reach) add(sample, distance_squared, reach, scratch);
  }
  for (const ReconstructionSite& site : scratch.candidates_) scratch.slot_[site.patch] = kNone;
}

/// Adds a sample to the share of its patch.
void NeighbourSearch::add(const Sample& sample, float distance_squared, float reach,
                          Scratch& scratch) const {
  std::uint32_t& slot = scratch.slot_[sample.patch];
  if (slot == kNone) {
    slot = static_cast<std::uint32_t>(scratch.candidates_.size());
    scratch.candidates_.push_back({sample.patch, 0, reach * reach, {}, {}});
  }
  ReconstructionSite& site = scratch.candidates_[slot];
  const float fall = 1 - distance_squared / (reach * reach);
  site.weight += sample.share * fall * fall;
  if (distance_squared > site.distance_squared) return;
  site.distance_squared = distance_squared;
  site.position = sample.position;
  site.normal = sample.normal;
}

/// Finds which of the candidates [begin, end) are visible.
void NeighbourSearch::look_at_next(const Receiver& receiver, std::size_t begin, std::size_t end,
                                   std::span<const std::uint32_t> own, Scratch& scratch) const {
  scratch.rays_.clear();
  const PatchPoint from{to_float3(receiver.inset), to_float3(receiver.normal)};
  const auto is_own = [&](const ReconstructionSite& site) {
    return std::ranges::find(own, site.patch) != own.end();
  };
  for (std::size_t k = begin; k < end; ++k) {
    const ReconstructionSite& site = scratch.candidates_[k];
    if (is_own(site)) continue;
    for (const Ray& ray :
         line_of_sight(from, {to_float3(site.position), to_float3(site.normal)}, tracer_)) {
      scratch.rays_.push_back(ray);
    }
  }
  tracer_.occluded(scratch.rays_);
  auto ray = scratch.rays_.begin();
  for (std::size_t k = begin; k < end; ++k) {
    if (is_own(scratch.candidates_[k])) {
      scratch.in_sight_[k] = 1;
      continue;
    }
    scratch.in_sight_[k] = std::none_of(ray, ray + 3, is_occluded) ? 1 : 0;
    ray += 3;
  }
}

}  // namespace rebounce
