#include "precompute/base/csv_writer.h"

#include <gtest/gtest.h>

#include <charconv>

#include "tests/support/expect_error.h"
#include "tests/support/temporary_folder.h"

namespace rebounce::test_csv_writer {
namespace {

TEST(CsvWriter, PutsGroupsSideBySide) {
  const test::TemporaryFolder folder;
  const std::vector<float> area{0.5F, 2};
  const std::vector<float> color{0.1F, 1e-20F, -3, 1.0F / 3, 16777216, 0};
  write_csv(folder / "table.csv",
            std::vector<CsvColumns>{{{"area"}, area}, {{"red", "green", "blue"}, color}});
  EXPECT_EQ(test::read_bytes(folder / "table.csv"),
            "area,red,green,blue\n"
            "0.5,0.1,1e-20,-3\n"
            "2,0.33333334,16777216,0\n");
}

TEST(CsvWriter, RoundTripsMoreThanOneBuffer) {
  const test::TemporaryFolder folder;
  std::vector<float> values(20'000);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = 1.0F / static_cast<float>(i + 1);
  write_csv(folder / "table.csv", std::vector<CsvColumns>{{{"a", "b"}, values}});
  const std::string text = test::read_bytes(folder / "table.csv");
  ASSERT_TRUE(text.starts_with("a,b\n"));
  const char* at = text.data() + 4;
  for (const float value : values) {
    float read = 0;
    const auto result = std::from_chars(at, text.data() + text.size(), read);
    ASSERT_EQ(read, value);
    at = result.ptr + 1;
  }
  EXPECT_EQ(at, text.data() + text.size());
}

TEST(CsvWriter, WritesAHeaderWithoutRows) {
  const test::TemporaryFolder folder;
  write_csv(folder / "table.csv", std::vector<CsvColumns>{{{"a"}, {}}});
  EXPECT_EQ(test::read_bytes(folder / "table.csv"), "a\n");
}

TEST(CsvWriter, RefusesGroupsOfDifferentHeight) {
  const test::TemporaryFolder folder;
  const std::vector<float> two{1, 2};
  const std::vector<float> three{1, 2, 3};
  const std::vector<CsvColumns> uneven{{{"a"}, two}, {{"b"}, three}};
  test::expect_error([&] { write_csv(folder / "table.csv", uneven); }, "column b");
  const std::vector<CsvColumns> ragged{{{"a", "b"}, three}};
  test::expect_error([&] { write_csv(folder / "table.csv", ragged); }, "column a");
  EXPECT_TRUE(folder.names().empty());
}

}  // namespace
}  // namespace rebounce::test_csv_writer
