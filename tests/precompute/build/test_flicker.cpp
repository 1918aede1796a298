// A light that moves in small steps: what is shown follows it, without flicker.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "rebounce/engine.h"
#include "runtime/outputs/vertex_light.h"
#include "tests/support/built_scene.h"

namespace rebounce::test_flicker {
namespace {

const std::shared_ptr<const TransferData>& cornell_box() {
  static const auto data = std::make_shared<const TransferData>(
      test::built_scene("cornell_box.gltf", test::quick_settings(500)));
  return data;
}

/// One light state, whose emitting surfaces are off.
class Film {
 public:
  Film() : engine_(cornell_box()), vertex_(cornell_box()->mesh.position.size()) {
    engine_.set_emission_scale(3, {0, 0, 0});
  }

  /// The lamp at `part` of its way: low over the floor, past both blocks.
  const std::vector<Float3>& frame(double part) {
    Light lamp;
    lamp.position = {static_cast<float>(0.05 + 0.45 * part), 0.25F,
                     static_cast<float>(0.05 - 0.15 * std::sin(6 * part))};
    engine_.relight({&lamp, 1}, {});
    reconstruct_at_vertices(engine_.data().mesh, engine_.indirect_irradiance(), vertex_);
    return vertex_;
  }

  /// What every vertex shows where each patch receives 1 lx and vertices add up absolute values.
  std::vector<double> largest_response() {
    const std::vector<Float3> one(engine_.data().patches.size(), Float3{1, 1, 1});
    engine_.relight(one);
    const DisplayMesh& mesh = engine_.data().mesh;
    std::vector<double> response(vertex_.size(), 0.0);
    for (std::size_t v = 0; v < response.size(); ++v) {
      for (std::uint32_t k = mesh.weight_begin[v]; k < mesh.weight_begin[v + 1]; ++k) {
        const Float3& h = engine_.indirect_irradiance()[mesh.weight_patch[k]];
        response[v] += std::abs(mesh.weight[k]) * std::ranges::max(h);
      }
    }
    return response;
  }

  std::span<const Float3> direct() const { return engine_.direct_irradiance(); }

 private:
  Engine engine_;
  std::vector<Float3> vertex_;
};

double largest_change(std::span<const Float3> a, std::span<const Float3> b) {
  double largest = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    for (std::size_t c = 0; c < 3; ++c) {
      largest = std::max(largest, std::abs(static_cast<double>(a[k][c]) - b[k][c]));
    }
  }
  return largest;
}

TEST(Flicker, VerticesChangeNoMoreThanTheLightOnThePatches) {
  // H = Y rho E and the vertices' weights w are linear, and Y >= 0: with e the largest change of
  // direct light on any patch, vertex v changes by at most e times the sum over patches i of
  // |w(v, i)| (Y rho 1)(i). That is at most 2 rho / (1 - rho): rows of F add up to at most 1, and
  // negative weights to no more than -1/2.
  Film film;
  const std::vector<double> response = film.largest_response();
  constexpr int kFrames = 200;
  std::vector<Float3> vertex = film.frame(0);
  std::vector<Float3> direct(film.direct().begin(), film.direct().end());
  double closest = 0;
  for (int k = 1; k <= kFrames; ++k) {
    const std::vector<Float3>& next = film.frame(static_cast<double>(k) / kFrames);
    const double change = largest_change(direct, film.direct());
    EXPECT_GT(change, 0);
    for (std::size_t v = 0; v < next.size(); ++v) {
      for (std::size_t c = 0; c < 3; ++c) {
        const double moved = std::abs(static_cast<double>(next[v][c]) - vertex[v][c]);
        ASSERT_LE(moved, response[v] * change * (1 + 1e-4) + 1e-6);
        if (response[v] > 0) closest = std::max(closest, moved / (response[v] * change));
      }
    }
    vertex = next;
    direct.assign(film.direct().begin(), film.direct().end());
  }
  std::printf("the largest change is %.3f of its bound\n", closest);
}

/// The sum of the absolute changes of all vertices over a film, in parts of their mean value.
double total_variation(Film& film, int frames) {
  std::vector<Float3> before = film.frame(0);
  double sum = 0, mean = 0;
  for (int k = 1; k <= frames; ++k) {
    const std::vector<Float3>& now = film.frame(static_cast<double>(k) / frames);
    for (std::size_t v = 0; v < now.size(); ++v) {
      sum += std::abs(static_cast<double>(now[v][1]) - before[v][1]);
      mean += now[v][1] / frames;
    }
    before = now;
  }
  return sum / mean;
}

TEST(Flicker, SmallerStepsDoNotAddMovement) {
  // What follows the lamp moves as far in many small steps as in few; noise that is drawn anew for
  // each frame would move four times as far in four times the steps.
  Film film;
  const double few = total_variation(film, 50), many = total_variation(film, 200);
  std::printf("total variation: %.4f in 50 steps, %.4f in 200\n", few, many);
  EXPECT_GE(few, 0.2);
  EXPECT_LE(many, 1.05 * few);
}

TEST(Flicker, ThereAndBackGivesTheSameBits) {
  Film film;
  constexpr int kFrames = 40;
  std::vector<std::vector<Float3>> there;
  for (int k = 0; k <= kFrames; ++k) there.push_back(film.frame(static_cast<double>(k) / kFrames));
  for (int k = kFrames; k >= 0; --k) {
    ASSERT_EQ(film.frame(static_cast<double>(k) / kFrames), there[static_cast<std::size_t>(k)]);
  }
}

}  // namespace
}  // namespace rebounce::test_flicker
