#include <unistd.h>

#include <string>
#include <system_error>

#include "tests/fuzz/fuzz_target.h"

namespace rebounce::fuzz {
namespace fs = std::filesystem;

InputFolder::InputFolder() {
  const fs::path memory = "/dev/shm";
  const fs::path parent = fs::is_directory(memory) ? memory : fs::temp_directory_path();
  path_ = parent / ("rebounce-fuzz-" + std::to_string(::getpid()));
  fs::create_directories(path_);
}

InputFolder::~InputFolder() {
  std::error_code error;
  fs::remove_all(path_, error);
}

fs::path InputFolder::write(const char* name, Bytes bytes) const {
  fs::path path = path_ / name;
  std::FILE* file = std::fopen(path.c_str(), "wb");
  require(file != nullptr, "a file of an input can be made");
  require(std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size(),
          "a file of an input can be written");
  std::fclose(file);
  return path;
}

}  // namespace rebounce::fuzz
