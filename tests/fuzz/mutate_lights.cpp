// Changes the light file, the light path file or the IES file of an input.

#include <vector>

#include "tests/fuzz/json_mutation.h"

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t most, unsigned seed) {
  using namespace rebounce::fuzz;
  Random random(seed);
  std::vector<std::string> parts(1);
  for (std::size_t k = 0; k < size; ++k) {
    if (data[k] == 0 && parts.size() < 3) {
      parts.emplace_back();
    } else {
      parts.back() += static_cast<char>(data[k]);
    }
  }
  std::string& part = parts[below(random, parts.size())];
  part = mutated_json_text(part, random, most - size + part.size());
  std::string joined = parts.front();
  for (std::size_t k = 1; k < parts.size(); ++k) joined += '\0' + parts[k];
  return give_back(joined, data, most);
}
