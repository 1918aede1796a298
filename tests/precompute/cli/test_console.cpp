// What long work tells of itself where there is no terminal, as in a log.

#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>

#include "precompute/cli/console.h"

namespace rebounce::cli::test_console {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;
using std::chrono::seconds;

/// A file without a name that closes and removes itself.
class Log {
 public:
  std::FILE* file() const { return file_.get(); }
  std::string text() const {
    std::string text(static_cast<std::size_t>(std::ftell(file())), '\0');
    std::rewind(file());
    EXPECT_EQ(std::fread(text.data(), 1, text.size(), file()), text.size());
    return text;
  }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, Close> file_{std::tmpfile()};
};

TEST(ProgressBar, PrintsLinesWhereThereIsNoTerminal) {
  Log log;
  ProgressBar bar(true, log.file(), seconds(0));
  EXPECT_TRUE(bar.update("links", 0.01));
  EXPECT_TRUE(bar.update("operator", 0));
  std::this_thread::sleep_for(milliseconds(600));
  EXPECT_TRUE(bar.update("operator", 0.5));
  EXPECT_TRUE(bar.update("operator", 1));
  const std::string text = log.text();
  EXPECT_TRUE(text.starts_with("links: 1 %\noperator: 0 %\noperator: 50 %, ")) << text;
  EXPECT_TRUE(text.ends_with(" s left\n")) << text;
}

TEST(ProgressBar, KeepsItsLinesApart) {
  Log log;
  ProgressBar bar(true, log.file(), hours(1));
  for (int k = 0; k < 100; ++k) EXPECT_TRUE(bar.update(k < 50 ? "links" : "operator", 0.01 * k));
  EXPECT_EQ(log.text(), "");
}

TEST(ProgressBar, SaysNothingWhereNoneIsWanted) {
  Log log;
  ProgressBar bar(false, log.file(), seconds(0));
  EXPECT_TRUE(bar.update("operator", 0.5));
  EXPECT_EQ(log.text(), "");
}

}  // namespace
}  // namespace rebounce::cli::test_console
