#include "runtime/demo/picture/default_view.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <vector>

#include "runtime/demo/picture/camera.h"
#include "runtime/demo/picture/candidate_view.h"
#include "runtime/demo/picture/view_score.h"

namespace rebounce {
namespace {

// Few rays choose the views that many rays choose from.
constexpr std::size_t kFinalists = 32;
constexpr int kColumnsAtFirst = 16, kRowsAtFirst = 12;
constexpr int kColumnsAtLast = 64, kRowsAtLast = 48;

// The box around the middle 98 % of the vertices along each axis: where the details are, as a house
// on wide ground.
Box busy_box(std::span<const Float3> position) {
  Box box;
  std::vector<float> value(position.size());
  const auto smallest_but = [&](double part) {
    const auto at =
        value.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(value.size() - 1));
    std::ranges::nth_element(value, at);
    return *at;
  };
  for (int axis = 0; axis < 3; ++axis) {
    std::ranges::transform(position, value.begin(),
                           [axis](const Float3& p) { return p[static_cast<std::size_t>(axis)]; });
    box.low[axis] = smallest_but(0.01);
    box.high[axis] = smallest_but(0.99);
  }
  return box;
}

std::vector<CandidateView> views_of(const DisplayMesh& mesh, const RayTracer& tracer,
                                    const Box& whole, const Viewer& viewer) {
  std::vector<CandidateView> views;
  for (const Box& box : {whole, busy_box(mesh.position)}) {
    for (const CandidateView& view : views_from_floors(mesh, tracer, box, viewer)) {
      views.push_back(view);
    }
    for (const CandidateView& view : views_from_outside(tracer, box)) views.push_back(view);
  }
  return views;
}

}  // namespace

Camera default_view(const DisplayMesh& mesh, const RayTracer& tracer) {
  if (mesh.position.empty()) return Camera{};
  const Box whole = box_around(mesh.position);
  const Viewer viewer = viewer_for(whole);
  const std::vector<CandidateView> views = views_of(mesh, tracer, whole, viewer);
  std::vector<float> score(views.size());
  std::vector<std::size_t> order(views.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto rank = [&](int columns, int rows) {
#pragma omp parallel for schedule(dynamic, 16)
    for (const std::size_t k : order) {
      score[k] = views[k].weight *
                 view_score(views[k].camera, mesh, tracer, viewer.eye_height, columns, rows);
    }
    std::ranges::stable_sort(order, std::greater<>(), [&](std::size_t k) { return score[k]; });
  };
  rank(kColumnsAtFirst, kRowsAtFirst);
  order.resize(std::min(order.size(), kFinalists));
  rank(kColumnsAtLast, kRowsAtLast);
  return views[order.front()].camera;
}

Camera default_camera(const TransferData& data, const RayTracer& tracer) {
  return data.cameras.empty() ? default_view(data.mesh, tracer) : data.cameras.front();
}

}  // namespace rebounce
