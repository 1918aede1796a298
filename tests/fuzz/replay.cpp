// Gives the inputs of a folder to a fuzz target, each once, without libFuzzer.

#include <algorithm>
#include <cstdio>
#include <exception>
#include <fstream>
#include <iterator>
#include <memory>
#include <vector>

#include "tests/fuzz/fuzz_target.h"

namespace {

std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  return files;
}

// In memory of exactly its size, so that a sanitizer sees what is read beyond it.
void give(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const std::vector<char> bytes(std::istreambuf_iterator<char>(stream), {});
  const auto exact = std::make_unique<std::uint8_t[]>(bytes.size());
  std::ranges::copy(bytes, exact.get());
  LLVMFuzzerTestOneInput(exact.get(), bytes.size());
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) {
    std::fprintf(stderr, "usage: %s FOLDER\n", arguments[0]);
    return 2;
  }
  std::size_t given = 0;
  for (const auto& file : files_in(arguments[1])) {
    std::printf("%s\n", file.filename().c_str());
    std::fflush(stdout);
    try {
      give(file);
    } catch (const std::exception& failure) {
      std::fprintf(stderr, "%s: not caught: %s\n", file.c_str(), failure.what());
      return 1;
    }
    ++given;
  }
  std::printf("%zu inputs\n", given);
  return given > 0 ? 0 : 1;
}
