#include "precompute/base/npz_writer.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/support/expect_error.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/npz_reader.h"
#include "tests/support/temporary_folder.h"

namespace rebounce::test_npz_writer {
namespace {

using test::expect_error;
using test::Npy;
using test::parse_npy;
using test::unzip;
using Names = std::vector<std::string>;

const std::vector<Float3> kTriples{{1, 2, 3}, {4, 5, 0.1F}};
const std::vector<double> kDoubles{0.1, -1e300, 3, 4, 5, 6};
const std::vector<std::uint32_t> kIndices{1, 0xFFFFFFFF, 3};
const std::vector<std::uint64_t> kCounts{~std::uint64_t{0}};

std::vector<NumpyArray> sample_arrays() {
  return {numpy_array("direct_irradiance", kTriples),
          numpy_array<double>("doubles", {1, 2, 3}, kDoubles),
          numpy_array<std::uint32_t>("indices", {3}, kIndices),
          numpy_array<std::uint64_t>("count", {}, kCounts),
          numpy_array("nothing", std::span<const Float3>())};
}

template <typename T>
std::string raw(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

TEST(NpzWriter, WritesWhatTheNpyFormatSays) {
  const test::TemporaryFolder folder;
  write_npz(folder / "arrays.npz", sample_arrays());
  const auto files = unzip(folder / "arrays.npz");
  ASSERT_EQ(files.size(), 5U);

  const struct {
    const char *name, *type, *shape;
    std::string data;
  } expected[] = {{"direct_irradiance", "<f4", "(2, 3)", raw(kTriples)},
                  {"doubles", "<f8", "(1, 2, 3)", raw(kDoubles)},
                  {"indices", "<u4", "(3,)", raw(kIndices)},
                  {"count", "<u8", "()", raw(kCounts)},
                  {"nothing", "<f4", "(0, 3)", ""}};
  for (const auto& array : expected) {
    SCOPED_TRACE(array.name);
    const Npy npy = parse_npy(files.at(std::string(array.name) + ".npy"));
    EXPECT_EQ(npy.version, 1);
    EXPECT_EQ(npy.header, std::string("{'descr': '") + array.type +
                              "', 'fortran_order': False, 'shape': " + array.shape + ", }");
    EXPECT_EQ(npy.data, array.data);
  }
}

TEST(NpzWriter, UsesVersionTwoForALongHeader) {
  const test::TemporaryFolder folder;
  const std::vector<float> one{7};
  write_npz(folder / "long.npz",
            std::vector{numpy_array<float>("long", std::vector<std::size_t>(30'000, 1), one)});
  const Npy npy = parse_npy(unzip(folder / "long.npz").at("long.npy"));
  EXPECT_EQ(npy.version, 2);
  EXPECT_GT(npy.header.size(), 65'535U);
  EXPECT_EQ(npy.data, raw(one));
}

TEST(NpzWriter, GivesTheSameBytesEveryTime) {
  const test::TemporaryFolder folder;
  write_npz(folder / "first.npz", sample_arrays());
  write_npz(folder / "second.npz", sample_arrays());
  EXPECT_EQ(test::read_bytes(folder / "first.npz"), test::read_bytes(folder / "second.npz"));
}

TEST(NpzWriter, NumpyReadsIt) {
  // NumPy is the system's (./dev test installs it), whatever else is called python3; a packager's
  // machine may have none, and nothing but this test needs it.
  if (std::system("/usr/bin/python3 -c 'import numpy' >/dev/null 2>&1") != 0) {
    GTEST_SKIP() << "needs python3 with numpy";
  }
  const test::TemporaryFolder folder;
  write_npz(folder / "arrays.npz", sample_arrays());
  test::write_bytes(folder / "read.py", R"(
import sys
import numpy as np
arrays = np.load(sys.argv[1], allow_pickle=False)
assert set(arrays) == {"direct_irradiance", "doubles", "indices", "count", "nothing"}
triples = np.array([[1, 2, 3], [4, 5, 0.1]], np.float32)
assert arrays["direct_irradiance"].dtype == np.float32
assert np.array_equal(arrays["direct_irradiance"], triples)
doubles = np.array([0.1, -1e300, 3, 4, 5, 6]).reshape(1, 2, 3)
assert np.array_equal(arrays["doubles"], doubles)
assert arrays["indices"].dtype == np.uint32 and list(arrays["indices"]) == [1, 2**32 - 1, 3]
assert arrays["count"].shape == () and arrays["count"] == np.uint64(2**64 - 1)
assert arrays["nothing"].shape == (0, 3)
)");
  const std::string command = "/usr/bin/python3 '" + (folder / "read.py").string() + "' '" +
                              (folder / "arrays.npz").string() + "'";
  EXPECT_EQ(std::system(command.c_str()), 0);
}

TEST(NpzWriter, RefusesAShapeThatIsNotTheDatas) {
  const test::TemporaryFolder folder;
  expect_error(
      [&] { write_npz(folder / "x.npz", std::vector{numpy_array<double>("x", {7}, kDoubles)}); },
      "array x");
  EXPECT_TRUE(folder.names().empty());
}

TEST(NpzWriter, LeavesTheTargetAloneWhenItFails) {
  const test::TemporaryFolder folder;
  test::write_bytes(folder / "x.npz", "old");
  const auto twice =
      std::vector{numpy_array<double>("x", {6}, kDoubles), numpy_array<double>("x", {6}, kDoubles)};
  expect_error([&] { write_npz(folder / "x.npz", twice); }, "cannot write");
  {
    const std::vector<float> large(100'000);
    const test::FileSizeLimit limit(65'536);
    expect_error(
        [&] {
          write_npz(folder / "x.npz", std::vector{numpy_array<float>("x", {large.size()}, large)});
        },
        "cannot write");
  }
  EXPECT_EQ(test::read_bytes(folder / "x.npz"), "old");
  EXPECT_EQ(folder.names(), Names{"x.npz"});
  expect_error([&] { write_npz(folder / "none/x.npz", sample_arrays()); }, "create the folder");
}

}  // namespace
}  // namespace rebounce::test_npz_writer
