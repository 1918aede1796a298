#include "precompute/lights/reference_lighting.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "precompute/base/parallel_loop.h"
#include "precompute/lights/random_lights.h"
#include "transfer/base/area_norm.h"
#include "transfer/base/parallel.h"

namespace rebounce {
namespace {

// Number of lights that are multiplied at a time.
constexpr std::size_t kBatch = 64;

using Lights = std::span<const std::vector<Float3>>;

/// Computes one channel of the products with some lights.
void multiply_channel(const SymmetricMatrix& matrix, int channel, Lights lights,
                      std::span<std::vector<Float3>> results) {
  const std::span<const float> area = matrix.area();
  Eigen::MatrixXf x(area.size(), lights.size());
  parallel_for({}, lights.size(), [&](std::size_t k) {
    for (std::size_t i = 0; i < area.size(); ++i) {
      x(i, k) = std::sqrt(area[i]) * lights[k][i][channel];
    }
  });
  const Eigen::MatrixXf y = matrix.multiply(matrix.channel_matrix()[channel], x);
  parallel_for({}, lights.size(), [&](std::size_t k) {
    for (std::size_t i = 0; i < area.size(); ++i) {
      results[k][i][channel] = y(i, k) / std::sqrt(area[i]);
    }
  });
}

}  // namespace

std::vector<std::vector<Float3>> products(const SymmetricMatrix& matrix, Lights lights) {
  std::vector<std::vector<Float3>> results(lights.size(),
                                           std::vector<Float3>(matrix.area().size()));
  for (std::size_t begin = 0; begin < lights.size(); begin += kBatch) {
    const std::size_t count = std::min(kBatch, lights.size() - begin);
    for (int channel = 0; channel < kChannelCount; ++channel) {
      multiply_channel(matrix, channel, lights.subspan(begin, count),
                       std::span(results).subspan(begin, count));
    }
  }
  return results;
}

ReferenceLighting::ReferenceLighting(const SymmetricMatrix& matrix,
                                     std::vector<std::vector<Float3>> lights)
    : area_(matrix.area().begin(), matrix.area().end()) {
  std::erase_if(lights, [&](std::vector<Float3>& light) {
    matrix.roles().keep(PatchRoles::kSource, light);
    return !(area_norm(light, area_) > 0);
  });
  lights_ = sparse_lights(std::move(lights));
  truths_.reserve(lights_.size());
  for (std::size_t begin = 0; begin < lights_.size(); begin += kBatch) {
    const std::size_t count = std::min(kBatch, lights_.size() - begin);
    std::ranges::move(products(matrix, expanded(std::span(lights_).subspan(begin, count))),
                      std::back_inserter(truths_));
  }
  leave_out_dark();
  keep_received(matrix.roles());
}

void ReferenceLighting::append(const ReferenceLighting& other, std::size_t k) {
  lights_.push_back(other.lights_[k]);
  truths_.push_back(other.truths_[k]);
  received_.append(other.received_, k);
}

void ReferenceLighting::keep_received(const PatchRoles& roles) {
  for (std::vector<Float3>& truth : truths_) {
    const double all = area_norm(truth, area_);
    roles.keep(PatchRoles::kReceiver, truth);
    received_.add(area_norm(truth, area_), all);
  }
}

void ReferenceLighting::leave_out_dark() {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < lights_.size(); ++k) {
    if (arrives_nowhere(truths_[k], lights_[k].expanded(), area_)) continue;
    std::swap(lights_[kept], lights_[k]);
    std::swap(truths_[kept], truths_[k]);
    ++kept;
  }
  if (kept == 0) return;  // the matrix is zero: light arrives nowhere
  lights_.erase(lights_.begin() + static_cast<std::ptrdiff_t>(kept), lights_.end());
  truths_.resize(kept);
}

std::vector<double> ReferenceLighting::errors(const TransferOperator& transfer) const {
  struct Scratch {
    std::vector<Float3> result;
    std::vector<float> workspace;
  };
  std::vector<double> errors(lights_.size());
  parallel_loop(
      errors.size(), 1,
      [&] {
        return Scratch{std::vector<Float3>(area_.size()),
                       std::vector<float>(transfer.workspace_size())};
      },
      [&](std::size_t k, Scratch& scratch) {
        transfer.apply(lights_[k].expanded(), scratch.result, scratch.workspace);
        errors[k] = received_.error(k, area_distance(scratch.result, truths_[k], area_));
      });
  return errors;
}

Eigen::MatrixXd ReferenceLighting::normalised_lights(std::span<const std::uint32_t> patch,
                                                     std::size_t position_count) const {
  Eigen::MatrixXd result(static_cast<Eigen::Index>(position_count),
                         static_cast<Eigen::Index>(lights_.size()));
  for (std::size_t k = 0; k < lights_.size(); ++k) {
    result.col(static_cast<Eigen::Index>(k)) = normalised_light(k, patch, position_count);
  }
  return result;
}

Eigen::VectorXd ReferenceLighting::normalised_light(std::size_t k,
                                                    std::span<const std::uint32_t> patch,
                                                    std::size_t position_count) const {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(position_count));
  const double norm = received_.reference(k);
  if (norm == 0) return result;
  const std::vector<Float3> light = lights_[k].expanded();
  for (std::size_t i = 0; i < patch.size(); ++i) {
    const Float3& m0 = light[patch[i]];
    result[static_cast<Eigen::Index>(i)] =
        std::sqrt(area_[patch[i]]) * (m0[0] + m0[1] + m0[2]) / (kChannelCount * norm);
  }
  return result;
}

}  // namespace rebounce
