#include "lit_truth.h"

#include <algorithm>
#include <cmath>

#include "rebounce/precompute/random_lights.h"
#include "rebounce/transfer/area_norm.h"

namespace rebounce {
namespace {

// Lights that the matrix is read for at a time.
constexpr std::size_t kBatch = 64;

}  // namespace

LitTruth::LitTruth(const SymmetricMatrix& matrix, std::span<const std::vector<Float3>> lights)
    : area_(matrix.area().begin(), matrix.area().end()) {
  for (const std::vector<Float3>& light : lights) {
    matrix.roles().keep(PatchRoles::kSource, lights_.emplace_back(light));
    if (!(area_norm(lights_.back(), area_) > 0)) lights_.pop_back();
  }
  truths_.assign(lights_.size(), std::vector<Float3>(area_.size()));
  for (int channel = 0; channel < kChannelCount; ++channel) {
    for (std::size_t begin = 0; begin < lights_.size(); begin += kBatch) {
      light_channel(matrix, channel, begin, std::min(lights_.size(), begin + kBatch));
    }
  }
  leave_out_dark();
  keep_received(matrix.roles());
}

void LitTruth::keep_received(const PatchRoles& roles) {
  for (std::vector<Float3>& truth : truths_) {
    const double all = area_norm(truth, area_);
    roles.keep(PatchRoles::kReceiver, truth);
    received_.add(area_norm(truth, area_), all);
  }
}

void LitTruth::leave_out_dark() {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < lights_.size(); ++k) {
    if (arrives_nowhere(truths_[k], lights_[k], area_)) continue;
    std::swap(lights_[kept], lights_[k]);
    std::swap(truths_[kept], truths_[k]);
    ++kept;
  }
  if (kept == 0) return;  // light arrives nowhere: the matrix is zero
  lights_.resize(kept);
  truths_.resize(kept);
}

void LitTruth::light_channel(const SymmetricMatrix& matrix, int channel, std::size_t begin,
                             std::size_t end) {
  Eigen::MatrixXf x(area_.size(), end - begin);
  for (std::size_t k = begin; k < end; ++k) {
    for (std::size_t i = 0; i < area_.size(); ++i) {
      x(i, k - begin) = std::sqrt(area_[i]) * lights_[k][i][channel];
    }
  }
  const Eigen::MatrixXf y = matrix.multiply(matrix.channel_matrix()[channel], x);
  for (std::size_t k = begin; k < end; ++k) {
    for (std::size_t i = 0; i < area_.size(); ++i) {
      truths_[k][i][channel] = y(i, k - begin) / std::sqrt(area_[i]);
    }
  }
}

std::vector<double> LitTruth::errors(const TransferOperator& transfer) const {
  std::vector<double> errors;
  errors.reserve(lights_.size());
  for (std::size_t k = 0; k < lights_.size(); ++k) {
    errors.push_back(
        received_error(product(transfer, lights_[k]), truths_[k], area_, received_.reference(k)));
  }
  return errors;
}

Eigen::MatrixXd LitTruth::normalised_lights(std::span<const std::uint32_t> patch,
                                            std::size_t position_count) const {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(position_count),
                                                 static_cast<Eigen::Index>(lights_.size()));
  for (std::size_t k = 0; k < lights_.size(); ++k) {
    const double norm = received_.reference(k);
    if (norm == 0) continue;
    for (std::size_t i = 0; i < patch.size(); ++i) {
      const Float3& m0 = lights_[k][patch[i]];
      result(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) =
          std::sqrt(area_[patch[i]]) * (m0[0] + m0[1] + m0[2]) / (kChannelCount * norm);
    }
  }
  return result;
}

}  // namespace rebounce
