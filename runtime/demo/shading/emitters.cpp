#include "runtime/demo/shading/emitters.h"

#include <algorithm>
#include <cmath>

#include "runtime/demo/image/srgb.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/triangle.h"

namespace rebounce {
namespace {

constexpr int kMaxLevel = 8;  // at most 4^8 pieces of one triangle

using Corners = std::array<glm::vec3, 3>;

double area_of_piece(const Corners& corner) {
  return area_of(TriangleCorners{corner[0], corner[1], corner[2]});
}

// The power of a triangle up to a common factor; 0 if it does not emit.
double power_of(const TransferData& data, std::uint32_t triangle) {
  const std::uint32_t patch = data.mesh.triangle_patch[triangle];
  if (patch == kNone) return 0;
  return area_of(corners_of(data.mesh, triangle)) * data.mesh.opacity.stopping_part(triangle) *
         luminance(to_glm(data.patches.emitted_exitance[patch]));
}

// The four quarters of a triangle: at its corners and in its centre.
std::array<Corners, 4> quarters(const Corners& t) {
  const glm::vec3 ab = 0.5F * (t[0] + t[1]), bc = 0.5F * (t[1] + t[2]), ca = 0.5F * (t[2] + t[0]);
  return {{{t[0], ab, ca}, {ab, t[1], bc}, {ca, bc, t[2]}, {bc, ca, ab}}};
}

}  // namespace

Emitters::Emitters(const TransferData& data, const DisplaySurface& surface, int piece_count) {
  std::vector<double> power(data.mesh.triangle.size());
  double total = 0;
  for (std::uint32_t t = 0; t < power.size(); ++t) total += power[t] = power_of(data, t);
  for (std::uint32_t t = 0; t < power.size(); ++t) {
    if (!(power[t] > 0)) continue;
    // Each level divides a piece into four.
    const double level = 0.5 * std::log2(piece_count * power[t] / total);
    add_pieces(surface, t, static_cast<int>(std::clamp<long>(std::lround(level), 0, kMaxLevel)));
  }
  find_shares();
  const auto wanted = static_cast<std::size_t>(piece_count);
  draw_count_ = static_cast<std::uint32_t>(pieces_.size() <= 2 * wanted ? pieces_.size() : wanted);
}

void Emitters::add_pieces(const DisplaySurface& surface, std::uint32_t triangle, int level) {
  // Barycentric weights of the pieces' corners, divided along with their positions.
  std::vector<Corners> weights{{glm::vec3(1, 0, 0), glm::vec3(0, 1, 0), glm::vec3(0, 0, 1)}};
  for (int k = 0; k < level; ++k) {
    std::vector<Corners> finer;
    for (const Corners& coarse : weights) {
      for (const Corners& quarter : quarters(coarse)) finer.push_back(quarter);
    }
    weights = std::move(finer);
  }
  const auto solid_part = static_cast<float>(surface.mesh().opacity.stopping_part(triangle));
  for (const Corners& weight : weights) {
    EmitterPiece piece;
    for (std::size_t k = 0; k < 3; ++k) {
      piece.corner[k] = surface.point_on(triangle, weight[k]).position;
    }
    const SurfacePoint middle =
        surface.point_on(triangle, (weight[0] + weight[1] + weight[2]) / 3.0F);
    piece.centroid = middle.position;
    piece.normal = middle.geometric_normal;
    piece.area = static_cast<float>(area_of_piece(piece.corner));
    piece.luminance = solid_part * surface.emitted_luminance(middle, std::sqrt(piece.area));
    if (piece.luminance != glm::vec3(0)) pieces_.push_back(piece);
  }
}

void Emitters::find_shares() {
  double total = 0;
  for (const EmitterPiece& piece : pieces_) {
    total += static_cast<double>(piece.area) * luminance(piece.luminance);
    power_end_.push_back(total);
  }
  for (double& end : power_end_) end /= total;
}

ChosenPiece Emitters::draw(std::uint32_t index, float shift) const {
  if (draw_count_ == pieces_.size()) return {&pieces_[index], 1};
  const double position = (index + static_cast<double>(shift)) / draw_count_;
  const auto end = std::upper_bound(power_end_.begin(), power_end_.end() - 1, position);
  const auto k = static_cast<std::size_t>(end - power_end_.begin());
  const double share = power_end_[k] - (k > 0 ? power_end_[k - 1] : 0);
  return {&pieces_[k], static_cast<float>(1 / (share * draw_count_))};
}

}  // namespace rebounce
