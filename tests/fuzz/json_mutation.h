#pragma once

// Changes of JSON that stay JSON: what gets past a parser, to the checks behind it.

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <random>
#include <string>

/// libFuzzer's own change of bytes, in place; returns how many there are then, at most `most`.
extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);

namespace rebounce::fuzz {

using Random = std::minstd_rand;

/// A number below `count`, which is at least 1.
inline std::size_t below(Random& random, std::size_t count) {
  return random() % count;
}

/// Changes bytes as libFuzzer does, up to `most` of them.
std::string mutated_bytes(std::string bytes, std::size_t most);

/// Changes one value of `root`: another number, text or kind, none, twice, or that of another
/// place.
void mutate_json(nlohmann::json& root, Random& random);

/// Changes `text`, as JSON where it is some, and at times as bytes.
std::string mutated_json_text(const std::string& text, Random& random, std::size_t most);

/// Copies `mutated` to where libFuzzer takes it from. What is longer than `most` is cut off.
std::size_t give_back(const std::string& mutated, std::uint8_t* data, std::size_t most);

}  // namespace rebounce::fuzz
