#include "precompute/outputs/receiver_rows.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "precompute/base/parallel_loop.h"
#include "precompute/base/parallel_progress.h"
#include "precompute/compression/form_factor_compression.h"
#include "precompute/lights/random_lights.h"
#include "precompute/outputs/receiver_sets.h"
#include "precompute/outputs/receiver_views.h"
#include "rebounce/error.h"

namespace rebounce {
namespace {

constexpr int kFewestReceiverRays = 64;
constexpr std::uint32_t kGroup = ReceiverRows::kGroup, kSetStep = ReceiverRows::kSetStep;
constexpr std::size_t kBatchGroups = 128;  // of which the rows are in memory at a time

// Lights to choose sets by, of those that operators are fitted to.
constexpr std::size_t kLights = 32;

// Errors are relative to the light at a receiver or, if that is more, to this part of the light in
// the scene's root mean square.
constexpr float kDim = 0.1F;

// Receivers whose light is looked at to decide whether rows are made.
constexpr std::size_t kJudged = 1024;

// Of light on single patches, beside lamps (lab/109).
constexpr double kSinglePatchWeight = 0.1;

constexpr float kLargestByte = 127;

/// Lights that the scene may have: what patches send, and what arrives there.
struct Lights {
  std::vector<std::vector<Float3>> radiosity;  ///< [lights][n] lx
  Eigen::MatrixXf irradiance;                  ///< [n][lights] lx, mean of the channels
  Eigen::VectorXf usual;                       ///< [lights] the root mean square over the area
};

Lights light_scene(const TransferData& data, const RayTracer& tracer, std::uint64_t seed) {
  const PatchTable& patches = data.patches;
  const auto drawn = draw_training_lights(data, tracer, seed, data.transfer->roles());
  const double whole = std::accumulate(patches.area.begin(), patches.area.end(), 0.0);
  const std::size_t count = std::min(kLights, drawn.size());
  std::vector<std::vector<Float3>> exitance, arriving;
  std::vector<float> workspace(data.transfer->workspace_size());
  for (std::size_t k = 0; k < count; ++k) {
    const std::vector<Float3>& light = drawn[k * drawn.size() / count];
    std::vector<Float3> arrives(patches.size());
    data.transfer->apply(light, arrives, workspace);
    if (arrives_nowhere(arrives, light, patches.area)) continue;
    exitance.push_back(light);
    arriving.push_back(std::move(arrives));
  }
  Lights lights;
  lights.radiosity = radiosities_of(*data.transfer, patches.reflectance, exitance);
  lights.irradiance.resize(static_cast<Eigen::Index>(patches.size()),
                           static_cast<Eigen::Index>(arriving.size()));
  lights.usual.resize(static_cast<Eigen::Index>(arriving.size()));
  for (std::size_t k = 0; k < arriving.size(); ++k) {
    double square = 0;
    for (std::size_t i = 0; i < patches.size(); ++i) {
      const auto& [r, g, b] = arriving[k][i];
      const float mean = (r + g + b) / kChannelCount;
      lights.irradiance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) = mean;
      square += static_cast<double>(patches.area[i]) * mean * mean;
    }
    lights.usual[static_cast<Eigen::Index>(k)] = static_cast<float>(std::sqrt(square / whole));
  }
  return lights;
}

/// What the row of one receiver adds.
struct AddedRow {
  ViewRow added;                ///< by position of the tree, ascending
  Eigen::VectorXf added_light;  ///< [lights] what it adds, lx
  Eigen::VectorXf light;        ///< [lights] that the receiver gets then, lx
  double gain = 0;              ///< root mean square of what they add, relative to that
};

class RowBuilder {
 public:
  RowBuilder(const TransferData& data, std::span<const std::uint32_t> shown_patch,
             const RowReceivers& receivers, const RowReceivers::Candidates& candidates,
             const RayTracer& tracer, const ReceiverRowSettings& settings, std::uint64_t seed)
      : data_(data),
        shown_patch_(shown_patch),
        receivers_(receivers),
        tracer_(tracer),
        settings_(settings),
        lights_(light_scene(data, tracer, seed)),
        sources_(data.patches, lights_.radiosity) {
    for (const std::uint32_t k : build_cluster_tree(candidates.place, kGroup, kGroup).patch) {
      receiver_.push_back(candidates.receiver[k]);
      share_.push_back(candidates.share[k]);
    }
  }

  MadeReceiverRows build(const Progress& progress) {
    MadeReceiverRows made;
    if (settings_.least_error > 0) {
      made.error_without = error_without_rows();
      if (*made.error_without < settings_.least_error) return made;
    }
    make_rows(progress);
    if (rows_.group_count() > 0) made.rows = std::move(rows_);
    return made;
  }

 private:
  static constexpr double kPatchShare = 0.1;  // of the progress

  /// The sets of a group and its values in them.
  struct Group {
    std::vector<std::uint32_t> clusters, receivers;
    std::vector<float> scale;
    std::vector<std::int8_t> value;
  };

  void make_rows(const Progress& progress) {
    std::vector<std::uint32_t> all(data_.patches.size());
    std::iota(all.begin(), all.end(), 0U);
    look_from_patches(all, part_of(progress, 0, kPatchShare));
    rows_.patch = sources_.tree.patch;
    rows_.group_begin = {0};
    set_of_cluster_.assign(sources_.tree.clusters.size(), kNone);
    const Progress rest = part_of(progress, kPatchShare, 1);
    constexpr std::size_t kBatch = kBatchGroups * kGroup;
    const std::size_t count = receiver_.size();
    for (std::size_t begin = 0; begin < count; begin += kBatch) {
      report_progress(rest, static_cast<double>(begin) / static_cast<double>(count));
      add_batch(std::span(receiver_).subspan(begin, std::min(kBatch, count - begin)));
    }
  }

  void look_from_patches(std::span<const std::uint32_t> patches, const Progress& progress) {
    const std::size_t n = data_.patches.size();
    const PatchTriangles triangles(data_.mesh.triangle_patch, n);
    patch_rows_.resize(n);
    ParallelProgress parallel(progress, patches.size());
    parallel_loop(
        patches.size(), 16, [&] { return make_viewer(); },
        [&](std::size_t k, ReceiverViewer& viewer) {
          if (parallel.stopped()) return;
          ViewRow& row = patch_rows_[patches[k]];
          if (row.empty()) viewer.look_from_patch(triangles[patches[k]], row);
          parallel.advance();
        });
    parallel.finish();
  }

  ReceiverViewer make_viewer() const {
    return {data_.mesh, shown_patch_, data_.patches.size(), tracer_, settings_.ray_count};
  }

  /// That of MadeReceiverRows, from receivers spread over all.
  double error_without_rows() {
    const std::size_t step = std::max<std::size_t>(1, receiver_.size() / kJudged);
    std::vector<std::uint32_t> judged, seen;
    ViewRow weights;
    for (std::size_t k = step / 2; k < receiver_.size(); k += step) {
      judged.push_back(receiver_[k]);
      receivers_.find_weights(receiver_[k], weights);
      for (const ViewEntry& entry : weights) seen.push_back(entry.patch);
    }
    std::ranges::sort(seen);
    seen.erase(std::unique(seen.begin(), seen.end()), seen.end());
    look_from_patches(seen, {});
    const std::vector<AddedRow> found = compare_all(judged);
    Eigen::VectorXd square = Eigen::VectorXd::Zero(lights_.usual.size());
    for (std::size_t k = 0; k < found.size(); ++k) {
      const Eigen::VectorXf& added = found[k].added_light;
      if (added.size() == 0) continue;
      const double share = static_cast<double>(step) * share_[step / 2 + k * step] / whole_area();
      square += share * added.cwiseQuotient(lights_.usual).cwiseAbs2().cast<double>();
    }
    if (square.size() == 0) return 0;
    const auto middle = square.begin() + square.size() / 2;
    std::nth_element(square.begin(), middle, square.end());
    return std::sqrt(*middle);
  }

  /// What rows of these receivers add.
  std::vector<AddedRow> compare_all(std::span<const std::uint32_t> receivers) const {
    std::vector<AddedRow> found(receivers.size());
    const double sight = mean_patch_size();
    struct Scratch {
      ReceiverViewer viewer;
      std::vector<double> sum;
    };
    parallel_loop(
        receivers.size(), 16,
        [&] {
          return Scratch{make_viewer(), std::vector<double>(data_.patches.size(), 0.0)};
        },
        [&](std::size_t k, Scratch& scratch) {
          ViewRow row;
          receivers_.look(receivers[k], sight, scratch.viewer, row);
          if (!row.empty()) found[k] = compare(receivers[k], row, scratch.sum);
        });
    return found;
  }

  void add_batch(std::span<const std::uint32_t> receivers) {
    const std::vector<AddedRow> found = compare_all(receivers);
    std::vector<std::uint32_t> kept;
    for (std::uint32_t k = 0; k < found.size(); ++k) {
      if (found[k].gain > settings_.tolerance) kept.push_back(k);
    }
    std::vector<Group> groups((kept.size() + kGroup - 1) / kGroup);
    parallel_loop(groups.size(), [&](std::size_t g) {
      const std::span<const std::uint32_t> all(kept);
      const std::size_t first = g * kGroup;
      groups[g] = make_group(receivers, found,
                             all.subspan(first, std::min<std::size_t>(kGroup, all.size() - first)));
    });
    for (const Group& group : groups) append(group);
  }

  /// The row less those of the patches in the weights of the receiver. `sum` [n] is zero before and
  /// after.
  AddedRow compare(std::uint32_t receiver, const ViewRow& row, std::vector<double>& sum) const {
    AddedRow result;
    ViewRow weights;
    receivers_.find_weights(receiver, weights);
    std::vector<std::uint32_t> touched;
    const auto add = [&](const ViewRow& from, double weight) {
      for (const auto& [patch, part] : from) {
        const std::uint32_t p = sources_.position[patch];
        if (sum[p] == 0) touched.push_back(p);
        sum[p] += weight * part;
      }
    };
    result.light.setZero(lights_.usual.size());
    add(row, 1);
    for (const auto& [patch, weight] : weights) {
      add(patch_rows_[patch], -static_cast<double>(weight));
      result.light += weight * lights_.irradiance.row(patch).transpose();
    }
    std::ranges::sort(touched);
    Eigen::VectorXf added = Eigen::VectorXf::Zero(lights_.usual.size());
    for (const std::uint32_t p : touched) {
      if (sum[p] == 0) continue;
      const auto part = static_cast<float>(sum[p]);
      sum[p] = 0;
      result.added.push_back({p, part});
      added += part * sources_.light.row(p).transpose();
    }
    result.light = (result.light + added).cwiseMax(kDim * lights_.usual);
    result.added_light = added;
    if (added.size() > 0) {
      result.gain = std::sqrt(added.cwiseQuotient(result.light).squaredNorm() /
                              static_cast<float>(added.size()));
    }
    return result;
  }

  GroupRows rows_of(std::span<const AddedRow> found, std::span<const std::uint32_t> kept) const {
    GroupRows rows;
    for (const std::uint32_t k : kept) {
      for (const ViewEntry& entry : found[k].added) rows.position.push_back(entry.patch);
    }
    std::ranges::sort(rows.position);
    rows.position.erase(std::unique(rows.position.begin(), rows.position.end()),
                        rows.position.end());
    rows.part.setZero(static_cast<Eigen::Index>(kept.size()),
                      static_cast<Eigen::Index>(rows.position.size()));
    rows.light.setZero(lights_.usual.size());
    for (std::size_t i = 0; i < kept.size(); ++i) {
      Eigen::Index column = 0;
      for (const auto& [position, part] : found[kept[i]].added) {
        while (rows.position[static_cast<std::size_t>(column)] != position) ++column;
        rows.part(static_cast<Eigen::Index>(i), column) = part;
      }
      rows.light += found[kept[i]].light.cwiseAbs2();
    }
    rows.light = (rows.light / static_cast<float>(kept.size())).cwiseSqrt();
    return rows;
  }

  Group make_group(std::span<const std::uint32_t> receivers, std::span<const AddedRow> found,
                   std::span<const std::uint32_t> kept) const {
    const GroupRows rows = rows_of(found, kept);
    Group group;
    for (const std::uint32_t k : kept) group.receivers.push_back(receivers[k]);
    group.clusters =
        choose_sets(sources_, rows, {settings_.tolerance, settings_.most_sets, kSinglePatchWeight});
    round(parts_of_sets(rows, group.clusters), group);
    return group;
  }

  /// The parts of the sets [receivers][sets] that the receivers of a group see more than by their
  /// weights.
  Eigen::MatrixXf parts_of_sets(const GroupRows& rows,
                                std::span<const std::uint32_t> clusters) const {
    Eigen::MatrixXf parts(rows.part.rows(), static_cast<Eigen::Index>(clusters.size()));
    Eigen::Index first = 0;
    for (Eigen::Index j = 0; j < parts.cols(); ++j) {
      const Cluster& cluster = sources_.tree.clusters[clusters[static_cast<std::size_t>(j)]];
      const auto end = std::ranges::lower_bound(rows.position, cluster.begin + cluster.count);
      const Eigen::Index last = end - rows.position.begin();
      parts.col(j) = rows.part.middleCols(first, last - first).rowwise().sum();
      first = last;
    }
    return parts;
  }

  /// Rounds the parts of the sets to bytes.
  void round(const Eigen::MatrixXf& parts, Group& group) const {
    const auto sets = static_cast<std::size_t>(parts.cols());
    const std::size_t padded = (sets + kSetStep - 1) / kSetStep * kSetStep;
    group.value.assign(padded * kGroup, 0);
    group.scale.assign(padded, 0.0F);
    Eigen::MatrixXf rounded(parts.rows(), parts.cols());
    for (Eigen::Index j = 0; j < parts.cols(); ++j) {
      const float scale = parts.col(j).cwiseAbs().maxCoeff() / kLargestByte;
      group.scale[static_cast<std::size_t>(j)] = scale;
      rounded.col(j) = scale > 0 ? Eigen::VectorXf((parts.col(j) / scale).array().round())
                                 : Eigen::VectorXf::Zero(parts.rows());
    }
    keep_sums(parts, group.scale, rounded);
    for (std::size_t j = 0; j < sets; ++j) {
      for (Eigen::Index i = 0; i < parts.rows(); ++i) {
        group.value[ReceiverRows::value_index(j, static_cast<std::size_t>(i))] =
            static_cast<std::int8_t>(rounded(i, static_cast<Eigen::Index>(j)));
      }
    }
  }

  /// Changes rounded values by 1 until the sum of each row is what it was, so that even light stays
  /// exact. Sets with large scales come first; a value of 0 stays, since its receiver may not see
  /// the set.
  static void keep_sums(const Eigen::MatrixXf& parts, std::span<const float> scale,
                        Eigen::MatrixXf& rounded) {
    std::vector<Eigen::Index> order(static_cast<std::size_t>(parts.cols()));
    std::iota(order.begin(), order.end(), Eigen::Index{0});
    std::ranges::stable_sort(order, std::ranges::greater(),
                             [&](Eigen::Index j) { return scale[static_cast<std::size_t>(j)]; });
    for (Eigen::Index i = 0; i < parts.rows(); ++i) {
      double missing = 0;
      for (const Eigen::Index j : order) {
        missing += static_cast<double>(parts(i, j)) -
                   static_cast<double>(scale[static_cast<std::size_t>(j)]) * rounded(i, j);
      }
      for (const Eigen::Index j : order) {
        const float step = scale[static_cast<std::size_t>(j)];
        const float changed = rounded(i, j) + (missing > 0 ? 1.0F : -1.0F);
        if (std::abs(missing) <= 0.5 * step || rounded(i, j) == 0 ||
            std::abs(changed) > kLargestByte) {
          continue;
        }
        rounded(i, j) = changed;
        missing -= missing > 0 ? step : -step;
      }
    }
  }

  void append(const Group& group) {
    if (group.clusters.empty()) return;
    for (std::size_t j = 0; j < group.scale.size(); ++j) {
      const std::uint32_t cluster = group.clusters[std::min(j, group.clusters.size() - 1)];
      if (set_of_cluster_[cluster] == kNone) {
        set_of_cluster_[cluster] = static_cast<std::uint32_t>(rows_.set.size());
        const Cluster& range = sources_.tree.clusters[cluster];
        rows_.set.push_back({range.begin, range.begin + range.count});
      }
      rows_.entry_set.push_back(set_of_cluster_[cluster]);
    }
    rows_.scale.insert(rows_.scale.end(), group.scale.begin(), group.scale.end());
    rows_.value.insert(rows_.value.end(), group.value.begin(), group.value.end());
    rows_.receiver.insert(rows_.receiver.end(), group.receivers.begin(), group.receivers.end());
    rows_.group_begin.push_back(static_cast<std::uint32_t>(rows_.entry_set.size()));
    rows_.receiver.resize(std::size_t{kGroup} * rows_.group_count(), kNone);
  }

  double whole_area() const { return sources_.area_before.back(); }
  double mean_patch_size() const {
    return std::sqrt(whole_area() / static_cast<double>(data_.patches.size()));
  }

  const TransferData& data_;
  std::span<const std::uint32_t> shown_patch_;
  const RowReceivers& receivers_;
  const RayTracer& tracer_;
  const ReceiverRowSettings& settings_;
  const Lights lights_;
  const ReceiverSources sources_;
  std::vector<std::uint32_t> receiver_;  ///< those that may get rows, neighbours after each other
  std::vector<double> share_;            ///< m² of the surface that each shows
  std::vector<ViewRow> patch_rows_;      ///< [n]
  std::vector<std::uint32_t> set_of_cluster_;
  ReceiverRows rows_;
};

}  // namespace

void check_receiver_rows(const ReceiverRowSettings& settings) {
  if (settings.ray_count < kFewestReceiverRays) {
    throw Error("rows of receivers: ray_count must be at least 64");
  }
  if (!(settings.tolerance >= 0)) {
    throw Error("rows of receivers: tolerance must be at least 0");
  }
  if (settings.most_sets < kSetStep || settings.most_sets > ReceiverRows::kMostSets) {
    throw Error("rows of receivers: most_sets must be from 4 to 1024");
  }
  if (!(settings.least_error >= 0)) {
    throw Error("rows of receivers: least_error must be at least 0");
  }
}

MadeReceiverRows make_receiver_rows(const TransferData& data,
                                    std::span<const std::uint32_t> shown_patch,
                                    const RowReceivers& receivers, const RayTracer& tracer,
                                    const ReceiverRowSettings& settings, std::uint64_t seed,
                                    const Progress& progress) {
  check_receiver_rows(settings);
  if (!data.transfer) throw Error("rows of receivers need an operator; make one");
  const RowReceivers::Candidates candidates = receivers.candidates();
  if (candidates.receiver.empty()) return {};
  return RowBuilder(data, shown_patch, receivers, candidates, tracer, settings, seed)
      .build(progress);
}

}  // namespace rebounce
