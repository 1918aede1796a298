#include "precompute/outputs/receiver_sets.h"

#include <algorithm>
#include <queue>

namespace rebounce {
namespace {

double mean_reflectance(const PatchTable& patches) {
  double sum = 0, area = 0;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const auto& [r, g, b] = patches.reflectance[i];
    sum += static_cast<double>(patches.area[i]) * (r + g + b) / kChannelCount;
    area += patches.area[i];
  }
  return sum / area;
}

/// A cluster with the columns [first, last) of a group that lie in it.
struct Candidate {
  double error;
  std::uint32_t cluster;
  std::size_t first, last;

  bool operator<(const Candidate& other) const {
    return error != other.error ? error < other.error : cluster > other.cluster;
  }
};

class SetChoice {
 public:
  SetChoice(const ReceiverSources& sources, const GroupRows& rows,
            const ReceiverSetSettings& settings)
      : sources_(sources), rows_(rows), settings_(settings) {
    const auto columns = static_cast<Eigen::Index>(rows.position.size());
    lit_.resize(columns, sources.light.cols());
    area_.resize(columns);
    weight_.resize(columns);
    const double whole = sources.area_before.back();
    for (Eigen::Index k = 0; k < columns; ++k) {
      const std::uint32_t p = rows.position[static_cast<std::size_t>(k)];
      lit_.row(k) = sources.light.row(p).array() / rows.light.transpose().array();
      const double area = sources.area_before[p + 1] - sources.area_before[p];
      const double there = rows.part.col(k).cast<double>().squaredNorm() /
                           static_cast<double>(rows.part.rows()) / (area * area);
      const double light = there + sources.everywhere * sources.everywhere;
      area_[k] = area;
      weight_[k] = light > 0 ? 1 / (whole * area * light) : 0;
    }
  }

  std::vector<std::uint32_t> choose() {
    add(0, 0, rows_.position.size());
    const double enough = settings_.tolerance * settings_.tolerance;
    while (!open_.empty() && chosen_ < settings_.most_sets && error_ > enough) divide_worst();
    std::vector<std::uint32_t> sets(std::move(leaves_));
    for (; !open_.empty(); open_.pop()) sets.push_back(open_.top().cluster);
    std::ranges::sort(sets, {}, [&](std::uint32_t c) { return sources_.tree.clusters[c].begin; });
    return sets;
  }

 private:
  void divide_worst() {
    const Candidate worst = open_.top();
    open_.pop();
    --chosen_;
    error_ -= worst.error;
    const std::uint32_t child = sources_.tree.clusters[worst.cluster].first_child;
    const std::uint32_t border = sources_.tree.clusters[child + 1].begin;
    const auto middle = std::lower_bound(rows_.position.begin(), rows_.position.end(), border);
    const auto split = static_cast<std::size_t>(middle - rows_.position.begin());
    add(child, worst.first, split);
    add(child + 1, split, worst.last);
  }

  void add(std::uint32_t cluster, std::size_t first, std::size_t last) {
    if (first == last) return;
    ++chosen_;
    if (sources_.tree.clusters[cluster].is_leaf()) {
      leaves_.push_back(cluster);
      return;
    }
    const double error = error_of(sources_.tree.clusters[cluster], first, last);
    error_ += error;
    open_.push({error, cluster, first, last});
  }

  /// The mean square of the relative error at a receiver, if a cluster shines evenly.
  double error_of(const Cluster& cluster, std::size_t first, std::size_t last) const {
    const auto begin = static_cast<Eigen::Index>(cluster.begin);
    const Eigen::Index end = begin + static_cast<Eigen::Index>(cluster.count);
    const auto from = static_cast<Eigen::Index>(first);
    const auto count = static_cast<Eigen::Index>(last - first);
    const double area =
        sources_.area_before[cluster.begin + cluster.count] - sources_.area_before[cluster.begin];
    const auto part = rows_.part.middleCols(from, count);
    const Eigen::VectorXf all = part.rowwise().sum();
    const Eigen::VectorXf mean =
        ((sources_.light_before.row(end) - sources_.light_before.row(begin)) / area)
            .cast<float>()
            .transpose()
            .cwiseQuotient(rows_.light);
    // Column by column, so that the sum has one order whatever BLAS is loaded.
    Eigen::MatrixXf off = -all * mean.transpose();
    for (Eigen::Index k = 0; k < count; ++k) off.noalias() += part.col(k) * lit_.row(from + k);
    const double receivers = static_cast<double>(part.rows());
    const double of_lights = static_cast<double>(off.squaredNorm()) /
                             static_cast<double>(std::max<Eigen::Index>(off.cols(), 1));
    return (of_lights + settings_.single_patch * of_single_patches(part, all, from, count, area)) /
           receivers;
  }

  /// The sum over receivers of that under lights that fall on a single patch of the cluster.
  double of_single_patches(const auto& part, const Eigen::VectorXf& all, Eigen::Index from,
                           Eigen::Index count, double area) const {
    double sum = 0, seen_area = 0;
    for (Eigen::Index k = 0; k < count; ++k) {
      const double share = area_[from + k] / area;
      const double square =
          (part.col(k) - static_cast<float>(share) * all).template cast<double>().squaredNorm();
      sum += weight_[from + k] * square;
      seen_area += area_[from + k];
    }
    const double everywhere = sources_.everywhere * sources_.everywhere;
    if (everywhere == 0) return sum;
    const double unseen = std::max(area - seen_area, 0.0) / (area * area);
    return sum +
           all.cast<double>().squaredNorm() * unseen / (sources_.area_before.back() * everywhere);
  }

  const ReceiverSources& sources_;
  const GroupRows& rows_;
  const ReceiverSetSettings& settings_;
  Eigen::MatrixXf lit_;            ///< [columns][lights] relative to rows_.light
  Eigen::VectorXd area_, weight_;  ///< [columns] m²; of a squared error under a light on it alone
  std::priority_queue<Candidate> open_;
  std::vector<std::uint32_t> leaves_;
  std::uint32_t chosen_ = 0;
  double error_ = 0;  ///< of all in open_
};

}  // namespace

ReceiverSources::ReceiverSources(const PatchTable& patches,
                                 std::span<const std::vector<Float3>> radiosity)
    : tree(build_cluster_tree(patches, 1, 1)),
      position(patches.size()),
      area_before(patches.size() + 1, 0.0),
      light(patches.size(), radiosity.size()),
      light_before(Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(patches.size()) + 1,
                                         static_cast<Eigen::Index>(radiosity.size()))) {
  for (std::size_t p = 0; p < patches.size(); ++p) {
    const std::uint32_t i = tree.patch[p];
    const auto row = static_cast<Eigen::Index>(p);
    position[i] = static_cast<std::uint32_t>(p);
    area_before[p + 1] = area_before[p] + static_cast<double>(patches.area[i]);
    for (std::size_t k = 0; k < radiosity.size(); ++k) {
      const auto& [r, g, b] = radiosity[k][i];
      light(row, static_cast<Eigen::Index>(k)) = (r + g + b) / kChannelCount;
    }
    light_before.row(row + 1) = light_before.row(row) + static_cast<double>(patches.area[i]) *
                                                            light.row(row).cast<double>();
  }
  const double reflectance = mean_reflectance(patches);
  everywhere = reflectance / (1 - reflectance) / area_before.back();
}

std::vector<std::uint32_t> choose_sets(const ReceiverSources& sources, const GroupRows& rows,
                                       const ReceiverSetSettings& settings) {
  if (rows.position.empty()) return {};
  return SetChoice(sources, rows, settings).choose();
}

}  // namespace rebounce
