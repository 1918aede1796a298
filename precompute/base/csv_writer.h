#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace rebounce {

/// Columns that stand side by side in a table.
struct CsvColumns {
  std::vector<std::string> names;  ///< [k] header cells, without commas, quotes or line ends
  std::span<const float> values;   ///< [n][k] row-major
};

/// Writes a table of `groups` side by side: a header line, then n lines of comma-separated
/// decimals, each the shortest that reads back as the same float. The file is written whole or not
/// at all (see AtomicFile). Throws Error if the file cannot be written or the groups differ in
/// their number of rows.
void write_csv(const std::filesystem::path& path, std::span<const CsvColumns> groups);

}  // namespace rebounce
