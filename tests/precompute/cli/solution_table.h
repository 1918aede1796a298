#pragma once

// The tables that `rebounce solve` writes.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace rebounce::test {

/// A table of numbers under a line of names.
struct Table {
  std::vector<std::string> names;
  std::vector<std::vector<double>> rows;
};

inline Table read_csv(const std::string& path) {
  std::istringstream lines(read_bytes(path));
  Table table;
  std::string line, cell;
  std::getline(lines, line);
  for (std::istringstream cells(line); std::getline(cells, cell, ',');) table.names.push_back(cell);
  while (std::getline(lines, line)) {
    std::vector<double>& row = table.rows.emplace_back();
    for (std::istringstream cells(line); std::getline(cells, cell, ',');) {
      row.push_back(std::stod(cell));
    }
  }
  return table;
}

/// Largest difference in columns [first, first + 3), as a part of the largest value there.
inline double difference(const Table& a, const Table& b, std::size_t first) {
  double largest = 0, apart = 0;
  for (std::size_t i = 0; i < a.rows.size(); ++i) {
    for (std::size_t c = first; c < first + 3; ++c) {
      largest = std::max(largest, a.rows[i].at(c));
      apart = std::max(apart, std::abs(a.rows[i].at(c) - b.rows[i].at(c)));
    }
  }
  EXPECT_GT(largest, 0);
  return apart / largest;
}

}  // namespace rebounce::test
