#include "precompute/import/gltf_warnings.h"

#include <fmt/format.h>

#include <algorithm>

namespace rebounce::gltf {

void Warnings::count(const std::string& format, std::size_t amount) {
  if (amount == 0) return;
  const auto entry = std::find_if(entries_.begin(), entries_.end(), [&](const auto& candidate) {
    return candidate.second > 0 && candidate.first == format;
  });
  if (entry == entries_.end()) {
    entries_.emplace_back(format, amount);
  } else {
    entry->second += amount;
  }
}

std::vector<std::string> Warnings::lines() const {
  std::vector<std::string> lines;
  for (const auto& [text, amount] : entries_) {
    lines.push_back(amount == 0 ? text : fmt::format(fmt::runtime(text), amount));
  }
  return lines;
}

}  // namespace rebounce::gltf
