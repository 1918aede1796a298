#include "precompute/base/process_memory.h"

#include <unistd.h>

#include <fstream>

namespace rebounce {

std::uint64_t resident_memory_bytes() {
  std::uint64_t all = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> all >> resident;
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGE_SIZE));
}

}  // namespace rebounce
