#include <gtest/gtest.h>

#include <string>

#include "rebounce/error.h"

namespace rebounce::test_error {
namespace {

TEST(Error, NamesOutOfAFileDoNotBreakTheLine) {
  const std::string name("lam\n\0p\x1B[2J\x7F", 11);
  EXPECT_STREQ(Error("cannot open " + name + ".ies").what(), "cannot open lam  p [2J .ies");
}

TEST(Error, LosesTheEndOfLineOfALibrarysMessage) {
  EXPECT_STREQ(Unsupported("a line\r\n").what(), "a line");
  EXPECT_STREQ(Error("\n").what(), "");
}

TEST(Error, KeepsLettersOfAllLanguages) {
  EXPECT_STREQ(Error("салон-7.gltf: größer").what(), "салон-7.gltf: größer");
}

}  // namespace
}  // namespace rebounce::test_error
