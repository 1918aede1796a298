// The operator against physics, against Gauss-Seidel in double precision and against its equation.

#include "precompute/inverse/dense_transfer.h"

#include <gtest/gtest.h>

#include <numbers>

#include "precompute/lights/reference_solution.h"
#include "rebounce/error.h"
#include "tests/support/random_light.h"
#include "tests/support/solved_room.h"
#include "tests/support/with_threads.h"

namespace rebounce::test_dense_transfer {
namespace {

struct Solved : test::SolvedRoom {
  using SolvedRoom::SolvedRoom;
  std::vector<Float3> indirect(const std::vector<Float3>& m0) const { return product(*dense, m0); }
};

/// A room of coloured walls with a black and a nearly white block.
Scene colourful_room() {
  return test::furnished_room({0.7F, 0.5F, 0.2F}, {0, 0, 0}, {0.9F, 0.95F, 0.0F});
}

TEST(DenseTransfer, FurnaceIsUniform) {
  // Everything emits 1 and reflects rho: B = 1 / (1 - rho), so H = B.
  for (const float rho : {0.1F, 0.5F, 0.9F, 0.99F}) {
    Scene scene = test::empty_scene({rho, rho, rho});
    test::add_box(scene, {0, 0, 0}, {4, 3, 5}, true);
    test::add_box(scene, {1, 0.5, 1}, {2, 1.2, 2.5}, false);
    const Solved solved(scene, 500);
    const std::vector<Float3> h =
        solved.indirect(std::vector<Float3>(solved.patches.size(), {1, 1, 1}));
    // Row sums are 1 to 1e-6, and a closed room multiplies what they lack by 1 / (1 - rho).
    const float allowed = rho > 0.95F ? 1e-3F : 1e-4F;
    for (const Float3& value : h) EXPECT_NEAR(value[1] * (1 - rho), 1, allowed) << rho;
  }
}

TEST(DenseTransfer, CubeRowsOfTheTable) {
  // Unit cube, one face emits 1, one patch per face: what the patches of a face have in the mean,
  // as long as the light is uniform over each face; one patch per face is made by hand here.
  const double opposite = 0.199824895698387, adjacent = 0.200043776075403;
  struct Row {
    float rho;
    double top, bottom, side;
  };
  const std::vector<Row> rows = {{0, 1, 0, 0},
                                 {0.25F, 1.01587301794, 0.063452357715, 0.063501989419},
                                 {0.5F, 1.09090909811, 0.181745826108, 0.181836268946},
                                 {0.75F, 1.391304362, 0.521639830261, 0.521763951935},
                                 {0.9F, 2.37288137483, 1.52531055112, 1.52545201851},
                                 {0.99F, 17.3622704726, 16.5274251277, 16.5275760999}};
  for (const Row& row : rows) {
    PatchTable patches;
    patches.area.assign(6, 1.0F);
    patches.reflectance.assign(6, {row.rho, row.rho, row.rho});
    std::vector<std::uint64_t> begin = {0};
    std::vector<std::uint32_t> column;
    std::vector<float> exchange_area;
    for (std::uint32_t i = 0; i < 6; ++i) {
      for (std::uint32_t j = i + 1; j < 6; ++j) {
        column.push_back(j);
        exchange_area.push_back(static_cast<float>(i / 2 == j / 2 ? opposite : adjacent));
      }
      begin.push_back(column.size());
    }
    const ExchangeMatrix exchange{SharedArray(begin), SharedArray(column),
                                  SharedArray(exchange_area)};
    const auto transfer = build_dense_transfer(exchange, patches, Precision::kF32);
    std::vector<Float3> m0(6);
    m0[0] = {1, 1, 1};
    const std::vector<Float3> h = product(*transfer, m0);
    // Six-digit form factors, and 1 / (1 - rho) of them.
    const double allowed = 1e-6 / (1 - row.rho);
    EXPECT_NEAR(1 + row.rho * h[0][0], row.top, allowed);
    EXPECT_NEAR(row.rho * h[1][0], row.bottom, allowed);
    for (int side = 2; side < 6; ++side) EXPECT_NEAR(row.rho * h[side][0], row.side, allowed);
  }
}

TEST(DenseTransfer, CubeOfManyPatchesKeepsTheMeansOfItsFaces) {
  // Many patches resolve what one per face smears: the total must still be conserved.
  Scene scene = test::empty_scene({0.5F, 0.5F, 0.5F});
  test::add_box(scene, {0, 0, 0}, {1, 1, 1}, true);
  const Solved solved(scene, 600);
  std::vector<Float3> m0(solved.patches.size());
  double emitted = 0, absorbed = 0;
  for (std::size_t i = 0; i < m0.size(); ++i) {
    if (solved.patches.normal[i][1] > 0.9F) m0[i] = {1, 1, 1};
    emitted += solved.patches.area[i] * m0[i][0];
  }
  const std::vector<Float3> h = solved.indirect(m0);
  for (std::size_t i = 0; i < m0.size(); ++i) {
    absorbed += solved.patches.area[i] * (1 - 0.5) * h[i][0];
  }
  EXPECT_NEAR(absorbed / emitted, 1, 1e-5);
}

TEST(DenseTransfer, AgreesWithGaussSeidelInDoublePrecision) {
  const Solved solved(colourful_room(), 900);
  const ReferenceSolver reference(solved.exchange, solved.patches);
  for (int light = 0; light < 8; ++light) {
    std::vector<Float3> m0 = test::random_light(solved.patches.size(), light);
    if (light % 2 == 1) {  // a single patch, of each kind in turn
      const std::size_t lit = (97 * static_cast<std::size_t>(light)) % m0.size();
      m0.assign(m0.size(), {0, 0, 0});
      m0[lit] = {1, 2, 3};
    }
    const std::vector<Float3> truth = reference.indirect_irradiance(m0);
    EXPECT_LT(relative_difference(solved.indirect(m0), truth, solved.patches.area), 1e-5);
  }
}

TEST(DenseTransfer, SatisfiesItsEquation) {
  const Solved solved(colourful_room(), 500);
  EXPECT_LT(transfer_residual(*solved.dense, solved.exchange, solved.patches), 2e-6);
  const Solved half(colourful_room(), 500, Precision::kF16);
  EXPECT_LT(transfer_residual(*half.dense, half.exchange, half.patches), 1e-3);
}

TEST(DenseTransfer, SameBitsForAnyNumberOfThreads) {
  PatchModel model = make_patch_model(colourful_room(), {.patch_count = 600});
  const FormFactors f = compute_form_factors(model, test::make_tracer(model));
  for (const Arithmetic arithmetic : {Arithmetic::kDouble, Arithmetic::kSingle}) {
    const auto make = [&] {
      return build_dense_transfer(f.exchange, model.patches, Precision::kF32, {}, arithmetic);
    };
    const auto one = test::with_threads(1, make), four = test::with_threads(4, make);
    EXPECT_TRUE(std::ranges::equal(one->storage().tiles_f32, four->storage().tiles_f32));
  }
}

/// The largest relative difference of two operators' entries.
double largest_difference(const DenseOperator& a, const DenseOperator& b) {
  double largest = 0;
  for (std::uint32_t m = 0; m < a.storage().matrix_count; ++m) {
    for (std::size_t i = 0; i < a.patch_count(); ++i) {
      for (std::size_t j = 0; j <= i; ++j) {
        const double exact = b.symmetric_entry(m, i, j);
        const double error = std::abs(a.symmetric_entry(m, i, j) - exact);
        largest = std::max(largest, error == 0 ? 0 : error / exact);
      }
    }
  }
  return largest;
}

TEST(DenseTransfer, SinglePrecisionKeepsTheRelativeErrorOfEveryEntry) {
  // Black, nearly black and nearly white patches side by side.
  PatchModel model = make_patch_model(colourful_room(), {.patch_count = 900});
  const FormFactors f = compute_form_factors(model, test::make_tracer(model));
  for (std::size_t i = 0; i < model.patches.size(); i += 3) {
    model.patches.reflectance[i] =
        i % 2 == 0 ? Float3{1e-5F, 0.98F, 0} : Float3{0.98F, 1e-3F, 0.9F};
  }
  const auto build = [&](Arithmetic arithmetic) {
    return build_dense_transfer(f.exchange, model.patches, Precision::kF32, {}, arithmetic);
  };
  const auto exact = build(Arithmetic::kDouble), single = build(Arithmetic::kSingle);
  EXPECT_LT(largest_difference(*single, *exact), 1e-5);
  EXPECT_LT(transfer_residual(*single, f.exchange, model.patches), 1e-5);
}

TEST(DenseTransfer, SinglePrecisionInAWhiteFurnace) {
  Scene scene = test::empty_scene({0.99F, 0.99F, 0.99F});
  test::add_box(scene, {0, 0, 0}, {4, 3, 5}, true);
  const PatchModel model = make_patch_model(scene, {.patch_count = 700});
  const FormFactors f = compute_form_factors(model, test::make_tracer(model));
  const auto single =
      build_dense_transfer(f.exchange, model.patches, Precision::kF32, {}, Arithmetic::kSingle);
  const std::vector<Float3> m0(model.patches.size(), {1, 1, 1});
  for (const Float3& h : product(*single, m0)) EXPECT_NEAR(h[1] * 0.01F, 1, 1e-3);
}

TEST(DenseTransfer, GreyScenesStoreOneMatrix) {
  Scene scene = test::empty_scene({0.5F, 0.5F, 0.5F});
  test::add_box(scene, {0, 0, 0}, {1, 1, 1}, true);
  EXPECT_EQ(Solved(scene, 100).dense->storage().matrix_count, 1U);
  EXPECT_EQ(Solved(colourful_room(), 100).dense->storage().matrix_count, 3U);
}

TEST(DenseTransfer, IsForecastFromTheSpeedOfItsProducts) {
  for (const Arithmetic arithmetic : {Arithmetic::kDouble, Arithmetic::kSingle}) {
    EXPECT_GT(measure_tile_speed(arithmetic), 1e6);
  }
  constexpr double kSpeed = 1e9;
  EXPECT_EQ(forecast_dense_transfer(0, 3, kSpeed), 0);
  EXPECT_DOUBLE_EQ(forecast_dense_transfer(1000, 1, kSpeed), 2);
  EXPECT_DOUBLE_EQ(forecast_dense_transfer(4000, 3, kSpeed), 3 * 64 * 2);
  EXPECT_DOUBLE_EQ(forecast_dense_transfer(4000, 3, 2 * kSpeed), 3 * 64);
}

TEST(DenseTransfer, RefusesReflectancesThatMakeLightGrow) {
  Scene scene = test::empty_scene({0.5F, 0.5F, 0.5F});
  test::add_box(scene, {0, 0, 0}, {1, 1, 1}, true);
  PatchModel model = make_patch_model(scene, {.patch_count = 50});
  const FormFactors f = compute_form_factors(model, test::make_tracer(model));
  for (Float3& rho : model.patches.reflectance) rho = {1.2F, 1.2F, 1.2F};
  EXPECT_THROW(build_dense_transfer(f.exchange, model.patches, Precision::kF32), Error);
}

TEST(DenseTransfer, IntegratingSphere) {
  // A point light of flux 1 anywhere inside a sphere of radius 1: the indirect irradiance is
  // uniform, rho / (1 - rho) / (4 pi).
  Scene scene = test::empty_scene({0.5F, 0.5F, 0.5F});
  test::add_ball(scene, 24, 12, true);
  const Solved solved(scene, scene.triangle.size());
  const glm::dvec3 lamp(0.3, 0.2, -0.4);
  std::vector<Float3> m0;
  double total_area = 0;
  for (std::size_t i = 0; i < solved.patches.size(); ++i) {
    const glm::dvec3 d = lamp - to_dvec3(solved.patches.centroid[i]);
    const double r = glm::length(d);
    const double e =
        glm::dot(d, to_dvec3(solved.patches.normal[i])) / (r * r * r * 4 * std::numbers::pi);
    m0.push_back({static_cast<float>(0.5 * e), 0, 0});
    total_area += solved.patches.area[i];
  }
  const std::vector<Float3> h = solved.indirect(m0);
  // The polyhedron has less area than the sphere, and its light is as much denser.
  for (std::size_t i = 0; i < h.size(); ++i) EXPECT_NEAR(h[i][0] * total_area, 1, 0.03);
}

}  // namespace
}  // namespace rebounce::test_dense_transfer
