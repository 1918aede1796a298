#include "precompute/outputs/mean_preservation.h"

#include <algorithm>
#include <cmath>

#include "runtime/rays/float3_glm.h"
#include "runtime/rays/triangle.h"

namespace rebounce {
namespace {

constexpr int kStepCount = 2;  // lab/026

// New weights before weights of the same patch are merged: a patch may have a hundred thousand
// triangles.
constexpr std::size_t kMostPending = 4096;

/// Sorts the weights and merges those of the same patch.
void collect(VertexWeights& weight) {
  std::ranges::stable_sort(weight, {}, &PatchWeight::patch);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < weight.size(); ++k) {
    if (kept > 0 && weight[kept - 1].patch == weight[k].patch) {
      weight[kept - 1].weight += weight[k].weight;
    } else {
      weight[kept++] = weight[k];
    }
  }
  weight.resize(kept);
}

void append(VertexWeights& sum, double factor, const VertexWeights& weight) {
  for (const PatchWeight& w : weight) sum.push_back({w.patch, factor * w.weight});
}

/// The mean light shown on the triangles of a patch. Empty if some vertex shows nothing or uses
/// patches that are not `good`.
VertexWeights shown_mean(const DisplayMesh& mesh, std::span<const std::uint32_t> triangles,
                         std::span<const std::uint8_t> good,
                         const std::vector<VertexWeights>& weight) {
  const auto is_good = [&](const PatchWeight& w) { return good[w.patch] != 0; };
  double area = 0;
  for (const std::uint32_t t : triangles) area += area_of(corners_of(mesh, t));
  VertexWeights mean;
  std::size_t collected = 0;
  for (const std::uint32_t t : triangles) {
    const double part = area_of(corners_of(mesh, t)) / (3 * area);
    for (const std::uint32_t v : mesh.triangle[t]) {
      if (weight[v].empty() || !std::ranges::all_of(weight[v], is_good)) return {};
      append(mean, part, weight[v]);
    }
    if (mean.size() > collected + kMostPending) {
      collect(mean);
      collected = mean.size();
    }
  }
  collect(mean);
  return mean;
}

/// Keeps the largest `count` weights, ascending by patch, scaled to a sum of 1.
void keep_largest(VertexWeights& weight, std::size_t count) {
  if (weight.size() > count) {
    std::ranges::stable_sort(weight, [](const PatchWeight& a, const PatchWeight& b) {
      return std::abs(a.weight) > std::abs(b.weight);
    });
    weight.resize(count);
    std::ranges::sort(weight, {}, &PatchWeight::patch);
  }
  double sum = 0;
  for (const PatchWeight& w : weight) sum += w.weight;
  for (PatchWeight& w : weight) w.weight /= sum;
}

double negative_sum(const VertexWeights& weight) {
  double sum = 0;
  for (const PatchWeight& w : weight) sum += std::max(0.0, -w.weight);
  return sum;
}

VertexWeights sum_of(VertexWeights weight, double factor, const VertexWeights& change) {
  append(weight, factor, change);
  collect(weight);
  return weight;
}

/// Adds as much of `change` as certainly stays within `most_negative`: negative_sum is convex.
VertexWeights change_weights(const VertexWeights& weight, const VertexWeights& change,
                             double most_negative) {
  VertexWeights changed = sum_of(weight, 1, change);
  const double before = negative_sum(weight), after = negative_sum(changed);
  if (after <= most_negative) return changed;
  if (before >= most_negative) return weight;
  return sum_of(weight, (most_negative - before) / (after - before), change);
}

/// Adds to each patch's contribution the difference between its value and the mean shown on its
/// triangles.
void add_what_is_lost(const DisplayMesh& mesh, const PatchTriangles& triangles,
                      std::span<const std::uint8_t> good, const MeanPreservation& settings,
                      std::vector<VertexWeights>& weight) {
  std::vector<VertexWeights> mean(triangles.patch_count());
#pragma omp parallel for schedule(dynamic, 16)
  for (std::size_t i = 0; i < mean.size(); ++i) {
    if (good[i] != 0) mean[i] = shown_mean(mesh, triangles[i], good, weight);
  }
#pragma omp parallel for schedule(dynamic, 256)
  for (std::size_t v = 0; v < weight.size(); ++v) {
    VertexWeights change;
    for (const PatchWeight& w : weight[v]) {
      if (mean[w.patch].empty()) continue;
      change.push_back(w);
      append(change, -w.weight, mean[w.patch]);
    }
    weight[v] = change_weights(weight[v], change, settings.most_negative);
    keep_largest(weight[v], settings.most_patches);
  }
}

}  // namespace

void preserve_patch_means(const DisplayMesh& mesh, const PatchTriangles& triangles,
                          std::span<const std::uint8_t> good, const MeanPreservation& settings,
                          std::vector<VertexWeights>& weight) {
  for (int step = 0; step < kStepCount; ++step) {
    add_what_is_lost(mesh, triangles, good, settings, weight);
  }
}

}  // namespace rebounce
