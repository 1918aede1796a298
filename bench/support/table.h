#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace rebounce::bench {

/// Results by rows and named columns, for people and for programs. A cell is a string, a number or
/// nothing (null).
class Table {
 public:
  using Cell = nlohmann::json;

  explicit Table(std::vector<std::string> columns) : columns_(std::move(columns)) {}

  /// Appends a row of one cell per column.
  void add(std::vector<Cell> row);

  /// Aligned columns, numbers with four digits, for a terminal.
  std::string text() const;

  /// A line of names, then one line per row; numbers in full (RFC 4180).
  std::string csv() const;

 private:
  std::vector<std::string> columns_;
  std::vector<std::vector<Cell>> rows_;
};

}  // namespace rebounce::bench
