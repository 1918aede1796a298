#pragma once

// The program `rebounce` as scripts see it: exit status, what it prints where, what it writes.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/subprocess.h"
#include "tests/support/temporary_folder.h"

namespace rebounce::test {

using Names = std::vector<std::string>;
using Words = std::vector<std::string>;

inline constexpr int kDone = 0, kBadInput = 1, kUsage = 2;
inline constexpr int kPatchCount = 300;

inline const std::string kScenes = REBOUNCE_SOURCE_DIR "/tests/scenes/";
inline const std::string kScene = kScenes + "cornell_box.gltf";
inline const std::string kLights = kScenes + "ceiling_point.lights.json";

/// The words, and an option with its value unless they say otherwise.
inline Words with_option(Words words, const std::string& option, const std::string& value) {
  if (std::ranges::find(words, option) == words.end()) {
    words.insert(words.end(), {option, value});
  }
  return words;
}

/// Words of a build with few rays, which does not look whether vertices need rows of their own,
/// unless the words say otherwise.
inline Words quick(Words words) {
  return with_option(with_option(std::move(words), "--quality", "low"), "--receivers-at",
                     "patches");
}

inline bool is_one_line(const std::string& text) {
  return !text.empty() && text.find('\n') == text.size() - 1;
}

class CommandLine : public testing::Test {
 protected:
  Outcome run(Words words) {
    words.insert(words.begin(), REBOUNCE_PROGRAM);
    return Subprocess(words, printed_ / "out", printed_ / "err").finish();
  }

  /// Runs what must succeed with --json; its summary.
  nlohmann::json summary_of(Words words) {
    words.emplace_back("--json");
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.exit_code, kDone) << outcome.err;
    nlohmann::json summary = nlohmann::json::parse(outcome.out, nullptr, false);
    EXPECT_TRUE(summary.is_object()) << outcome.out;
    return summary;
  }

  /// Runs what must fail: with this status, and one line that holds `part`.
  void expect_failure(const Words& words, const std::string& part, int exit_code = kBadInput) {
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    EXPECT_EQ(outcome.out, "") << part;
    EXPECT_TRUE(is_one_line(outcome.err)) << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with("rebounce: ")) << outcome.err;
    EXPECT_NE(outcome.err.find(part), std::string::npos) << outcome.err << "lacks " << part;
  }

  /// Runs what must fail because of its input, without a file.
  void expect_refused(Words words, const std::string& part) {
    const Names before = folder_.names();
    words.emplace_back("--quiet");
    expect_failure(words, part);
    EXPECT_EQ(folder_.names(), before) << part;
  }

  /// Precomputes a scene, quickly; its transfer file.
  std::string precompute(const std::string& name, const Words& options = {},
                         const std::string& scene = kScene) {
    Words words = {"precompute", scene, "-o", path(name), "--quiet"};
    words.insert(words.end(), options.begin(), options.end());
    const Outcome outcome =
        run(quick(with_option(words, "--patches", std::to_string(kPatchCount))));
    EXPECT_EQ(outcome.exit_code, kDone) << outcome.err;
    EXPECT_EQ(outcome.out + outcome.err, "");
    return path(name);
  }

  /// The same file, for tests of what is done with it: one that an earlier test has left for
  /// others, or it is left for them.
  std::string built(const std::string& name, const Words& options = {},
                    const std::string& scene = kScene) {
    namespace fs = std::filesystem;
    const fs::path folder = fs::path(REBOUNCE_BINARY_DIR) / "tests" / "built",
                   shared = folder / (name_of_program() + name_of_build(options, scene));
    if (fs::exists(shared)) {
      fs::copy_file(shared, path(name));
      return path(name);
    }
    precompute(name, options, scene);
    fs::create_directories(folder);
    // Those of older programs.
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
      if (!entry.path().filename().string().starts_with(name_of_program())) {
        fs::remove(entry.path());
      }
    }
    const fs::path unfinished = shared.string() + "." + std::to_string(::getpid());
    fs::copy_file(path(name), unfinished);
    fs::rename(unfinished, shared);
    return path(name);
  }

  std::string write(const std::string& name, const std::string& text) {
    write_bytes(folder_ / name, text);
    return path(name);
  }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  static std::string time_of(const std::string& file) {
    return std::to_string(std::filesystem::last_write_time(file).time_since_epoch().count());
  }

  /// Differs from one build of the program to the next.
  static std::string name_of_program() { return time_of(REBOUNCE_PROGRAM) + "-"; }

  static std::string name_of_build(const Words& options, const std::string& scene) {
    std::string words = scene + time_of(scene);
    for (const std::string& option : options) words += ' ' + option;
    return std::to_string(std::hash<std::string>()(words));
  }

  const TemporaryFolder folder_;   // what the program is asked to write
  const TemporaryFolder printed_;  // what it prints
};

}  // namespace rebounce::test
