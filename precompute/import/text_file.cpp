#include "precompute/import/text_file.h"

#include <fstream>
#include <ios>
#include <iterator>

#include "rebounce/error.h"

namespace rebounce {

std::string read_text_file(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw Error("cannot open " + path.string() + "; check the name");
  try {
    return {std::istreambuf_iterator<char>(stream), {}};
  } catch (const std::ios_base::failure& failure) {  // a folder opens, and cannot be read
    throw Error("cannot read " + path.string() + ": " + failure.code().message() +
                "; name a file that can be read");
  }
}

}  // namespace rebounce
