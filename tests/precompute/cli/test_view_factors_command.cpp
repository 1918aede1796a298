// `rebounce view-factors` as scripts see it: files for SciPy, MatrixMarket and u-DALES.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "tests/precompute/facets/city_facets.h"
#include "tests/support/command_line.h"
#include "tests/support/npz_reader.h"

namespace rebounce::test_view_factors_command {
namespace {

using test::Words;
using ViewFactorsCommand = test::CommandLine;

// Two unit squares that face each other at distance 1, and their view factor.
const std::string kSquares =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
    "f 1 2 3 4\nf 5 8 7 6\n";
constexpr double kFactor = 0.19982489569839;

// A unit cube seen from inside, for View3D.
const std::string kCube =
    "T cube\nF 3\nV 1 0 0 0\nV 2 1 0 0\nV 3 1 1 0\nV 4 0 1 0\nV 5 0 0 1\nV 6 1 0 1\nV 7 1 1 1\n"
    "V 8 0 1 1\nS 1 1 2 3 4 0 0 0.5 floor\nS 2 5 8 7 6 0 0 0.5 ceiling\n"
    "S 3 1 5 6 2 0 0 0.5 south\nS 4 3 7 8 4 0 0 0.5 north\nS 5 1 4 8 5 0 0 0.5 west\n"
    "S 6 2 6 7 3 0 0 0.5 east\nEnd of Data\n";

std::string text_of(const std::string& path) {
  return test::read_bytes(path);
}

TEST_F(ViewFactorsCommand, WritesWhatSciPyReads) {
  const auto summary =
      summary_of({"view-factors", write("squares.obj", kSquares), "-o", path("f.npz")});
  EXPECT_EQ(summary["facet_count"], 2);
  EXPECT_EQ(summary["factor_count"], 2);
  EXPECT_LT(summary["sum_error"], 1e-9);
  const auto arrays = test::unzip(path("f.npz"));
  EXPECT_EQ(test::npz_values<std::int64_t>(arrays, "indptr", "<i8"),
            (std::vector<std::int64_t>{0, 1, 2}));
  EXPECT_EQ(test::npz_values<std::int32_t>(arrays, "indices", "<i4"),
            (std::vector<std::int32_t>{1, 0}));
  EXPECT_EQ(test::npz_values<std::int64_t>(arrays, "shape", "<i8"),
            (std::vector<std::int64_t>{2, 2}));
  EXPECT_NE(arrays.at("format.npy").find("|S3"), std::string::npos);
  EXPECT_TRUE(arrays.at("format.npy").ends_with("csr"));
  const auto data = test::npz_values<double>(arrays, "data", "<f8");
  const auto sky = test::npz_values<double>(arrays, "sky", "<f8");
  for (const std::size_t i : {0, 1}) {
    EXPECT_NEAR(data[i], kFactor, 1e-4);
    EXPECT_NEAR(sky[i], 1 - kFactor, 1e-4);
  }
}

TEST_F(ViewFactorsCommand, WritesMatrixMarket) {
  summary_of({"view-factors", write("squares.obj", kSquares), "-o", path("f.mtx")});
  std::istringstream matrix(text_of(path("f.mtx")));
  std::string banner;
  std::getline(matrix, banner);
  EXPECT_EQ(banner, "%%MatrixMarket matrix coordinate real general");
  std::size_t rows = 0, columns = 0, entries = 0, i = 0, j = 0;
  double factor = 0;
  matrix >> rows >> columns >> entries >> i >> j >> factor;
  EXPECT_EQ((std::vector{rows, columns, entries, i, j}), (std::vector<std::size_t>{2, 2, 2, 1, 2}));
  EXPECT_NEAR(factor, kFactor, 1e-4);
  EXPECT_TRUE(text_of(path("f.sky.mtx"))
                  .starts_with("%%MatrixMarket matrix array real general\n2 1\n0.80"));
}

TEST_F(ViewFactorsCommand, WritesTheFilesOfUDales) {
  summary_of({"view-factors", write("squares.obj", kSquares), "-o", path("case"), "--case", "064"});
  std::istringstream matrix(text_of(path("case/vfsparse.inp.064")));
  std::size_t i = 0, j = 0;
  double factor = 0;
  matrix >> i >> j >> factor;
  EXPECT_EQ(i, 1U);
  EXPECT_EQ(j, 2U);
  EXPECT_NEAR(factor, kFactor, 1e-4);
  const std::string sky = text_of(path("case/svf.inp.064"));
  EXPECT_TRUE(sky.starts_with("# sky view factors\n0.80")) << sky;
  EXPECT_EQ(std::ranges::count(sky, '\n'), 3);
}

TEST_F(ViewFactorsCommand, FilesOfAStreetPassTheChecksOfUDales) {
  const Facets facets = test::street_canyon(1);
  std::ostringstream obj;
  for (const glm::dvec3& v : facets.vertex) obj << "v " << v.x << ' ' << v.y << ' ' << v.z << '\n';
  for (std::size_t k = 0; k < facets.size(); ++k) {
    obj << 'f';
    for (const std::uint32_t v : facets.corners(k)) obj << ' ' << v + 1;
    obj << '\n';
  }
  const auto summary = summary_of(
      {"view-factors", write("street.obj", obj.str()), "-o", path("street"), "--quality", "low"});
  EXPECT_GT(summary["dropped_pairs"], 0);
  EXPECT_LE(summary["dropped_of_row"], 5e-4);

  std::vector<double> area, sum;
  std::ifstream sky(path("street/svf.inp.001"));
  std::string comment;
  std::getline(sky, comment);
  for (std::size_t k = 0; k < facets.size(); ++k) {
    area.push_back(glm::length(facets.vector_area(k)));
    sky >> sum.emplace_back();
    ASSERT_GE(sum[k], 0);
    ASSERT_LE(sum[k], 1);
  }
  std::map<std::pair<std::size_t, std::size_t>, double> exchange;
  std::ifstream matrix(path("street/vfsparse.inp.001"));
  std::size_t i = 0, j = 0;
  double factor = 0;
  while (matrix >> i >> j >> factor) {
    ASSERT_GT(factor, 0);
    ASSERT_LE(factor, 1);
    ASSERT_LE(area[i - 1] * factor, std::min(area[i - 1], area[j - 1]));
    sum[i - 1] += factor;
    exchange[{i, j}] = area[i - 1] * factor;
  }
  EXPECT_EQ(exchange.size(), summary["factor_count"]);
  for (const auto& [pair, there] : exchange) {
    ASSERT_NEAR(exchange.at({pair.second, pair.first}), there, 1e-8 * there);
  }
  for (const double all : sum) ASSERT_NEAR(all, 1, 1e-3);
}

TEST_F(ViewFactorsCommand, AddsExchangeFactorsOfAnEnclosure) {
  const std::string cube = write("cube.vs3", kCube);
  summary_of(
      {"view-factors", cube, "-o", path("f.npz"), "--closed", "--exchange", "--quality", "low"});
  const auto arrays = test::unzip(path("f.npz"));
  const auto exchange = test::npz_values<float>(arrays, "exchange_factor", "<f4");
  ASSERT_EQ(exchange.size(), 36U);
  for (std::size_t i = 0; i < 6; ++i) {
    float sum = 0;
    for (std::size_t j = 0; j < 6; ++j) sum += exchange[6 * i + j];
    EXPECT_NEAR(sum, 1, 1e-4);
  }
  // Five walls that absorb half: the light of a wall comes back to it from these alone.
  EXPECT_LT(exchange[0], exchange[1]);
  expect_refused(
      {"view-factors", write("squares.obj", kSquares), "-o", path("g.npz"), "--exchange"},
      "--exchange needs --emissivity");
  const std::string of_two = write("emissivity.txt", "0.5 0.6");
  for (const auto& [emissivity, part] :
       {std::pair<std::string, std::string>{"0.005", "facet 1 is not in"},
        {of_two, "there are 2 emissivities for 6 facets"}}) {
    expect_refused({"view-factors", cube, "-o", path("g.npz"), "--closed", "--exchange",
                    "--emissivity", emissivity},
                   part);
  }
  expect_failure({"view-factors", cube, "-o", path("g.npz"), "--emissivity", "0.5"},
                 "--emissivity requires --exchange", test::kUsage);
}

TEST_F(ViewFactorsCommand, RefusesInOneLine) {
  const std::string squares = write("squares.obj", kSquares);
  expect_refused({"view-factors", squares, "-o", path("f.npz"), "--closed"}, "no enclosure");
  expect_refused({"view-factors", path("no.stl"), "-o", path("f.npz")}, "cannot open");
  expect_refused({"view-factors", write("bad.obj", "v 0 0\n"), "-o", path("f.npz")},
                 "bad.obj, line 1: a number is missing");
  expect_refused({"view-factors", squares, "-o", path("f.csv")}, "no format has names that end in");
  EXPECT_FALSE(std::filesystem::exists(path("f.csv")));
  std::filesystem::create_directory(path("f.sky.mtx"));
  expect_refused({"view-factors", squares, "-o", path("f.mtx")}, "f.sky.mtx: it is not a regular");
  EXPECT_FALSE(std::filesystem::exists(path("f.mtx")));
  expect_failure({"view-factors", squares, "-o", path("case"), "--case", "1"},
                 "must be three digits", test::kUsage);
}

}  // namespace
}  // namespace rebounce::test_view_factors_command
