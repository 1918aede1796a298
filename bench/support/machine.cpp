#include "bench/support/machine.h"

#include <ctime>
#include <fstream>
#include <thread>

#include "commit.h"

namespace rebounce::bench {
namespace {

std::string processor_model() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (!line.starts_with("model name")) continue;
    const std::size_t begin = line.find_first_not_of(" \t", line.find(':') + 1);
    if (begin != std::string::npos) return line.substr(begin);
  }
  return "unknown processor";
}

std::string compiler() {
#if defined(__clang__)
  return "clang " __clang_version__;
#else
  return "g++ " __VERSION__;
#endif
}

}  // namespace

Machine describe_machine() {
  return {.processor = processor_model(),
          .processor_count = static_cast<int>(std::thread::hardware_concurrency()),
          .compiler = compiler(),
          .build_type = REBOUNCE_BUILD_TYPE,
          .commit = REBOUNCE_COMMIT};
}

double processor_seconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

}  // namespace rebounce::bench
