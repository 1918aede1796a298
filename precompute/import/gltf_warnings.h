#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace rebounce::gltf {

/// The warnings of an import: what it left out or changed. Entries are single lines, or lines that
/// count how often something happened, in the order of first appearance.
class Warnings {
 public:
  /// Adds a single line.
  void add(std::string line) { entries_.emplace_back(std::move(line), 0); }

  /// Counts `amount` more occurrences. `format` is a line with one {} for the total.
  void count(const std::string& format, std::size_t amount = 1);

  std::vector<std::string> lines() const;

 private:
  std::vector<std::pair<std::string, std::size_t>> entries_;  ///< a count of 0 marks a single line
};

}  // namespace rebounce::gltf
