#include "precompute/base/json_text.h"

#include <gtest/gtest.h>

namespace rebounce::test_json_text {
namespace {

TEST(JsonText, NamesThatAreNotUtf8AreReplaced) {
  EXPECT_EQ(json_text("caf\xe9"), "\"caf\xef\xbf\xbd\"");
  EXPECT_EQ(json_text({{"a", 1}}, 2), "{\n  \"a\": 1\n}");
}

}  // namespace
}  // namespace rebounce::test_json_text
