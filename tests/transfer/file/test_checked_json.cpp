#include "transfer/file/checked_json.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/support/expect_error.h"

namespace rebounce::test_checked_json {
namespace {

using test::expect_error;

/// `count` names of an object, each with `value`.
std::string object_of(int count, const std::string& value) {
  std::string text = "{";
  for (int k = 0; k < count; ++k) {
    text += (k > 0 ? ",\"" : "\"") + std::to_string(k) + "\":" + value;
  }
  return text + "}";
}

TEST(CheckedJson, RefusesDepthAndKeysThatAppearTwice) {
  EXPECT_EQ(parse_untrusted_json(R"({"a":[1,{"b":2}]})", 3)["a"][1]["b"], 2);
  expect_error([] { parse_untrusted_json(R"({"a":[1,{"b":2}]})", 2); }, "nested more than 2 deep");
  expect_error([] { parse_untrusted_json(R"({"a":1,"a":2})", 2); }, "appears twice");
  expect_error([] { parse_untrusted_json(R"({"a":1)", 2); }, "not valid JSON");
}

TEST(CheckedJson, RefusesWhatTheParserWouldTakeHoursFor) {
  EXPECT_EQ(parse_untrusted_json(object_of(2000, "{}"), 2).size(), 2000U);
  EXPECT_EQ(parse_untrusted_json(object_of(100'000, "1"), 2).size(), 100'000U);
  expect_error([] { parse_untrusted_json(object_of(100'000, "{}"), 2); }, "too many objects");
  std::string list = "[{}";
  for (int k = 0; k < 100'000; ++k) list += ",{}";
  expect_error([&] { parse_untrusted_json(list + "]", 2); }, "too many objects");
}

}  // namespace
}  // namespace rebounce::test_checked_json
