#include "bench/support/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace rebounce::bench {
namespace {

std::string shown(const Table::Cell& cell) {
  if (cell.is_null()) return "";
  if (cell.is_string()) return cell.get<std::string>();
  return cell.is_number_float() ? fmt::format("{:.4g}", cell.get<double>()) : cell.dump();
}

std::string quoted(const Table::Cell& cell) {
  if (cell.is_null()) return "";
  // JSON has no such numbers.
  if (cell.is_number_float() && !std::isfinite(cell.get<double>())) return shown(cell);
  if (!cell.is_string()) return cell.dump();
  std::string text = cell.get<std::string>();
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  for (std::size_t at = 0; (at = text.find('"', at)) != std::string::npos; at += 2) {
    text.insert(at, 1, '"');
  }
  return '"' + text + '"';
}

template <typename Cells, typename ToText>
std::string comma_separated(const Cells& cells, const ToText& to_text) {
  std::string line;
  for (const auto& cell : cells) line += to_text(cell) + ',';
  line.back() = '\n';
  return line;
}

}  // namespace

void Table::add(std::vector<Cell> row) {
  assert(row.size() == columns_.size());
  rows_.push_back(std::move(row));
}

std::string Table::text() const {
  std::string text;
  std::vector<std::string> lines(rows_.size() + 1);
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    std::vector<std::string> column = {columns_[c]};
    bool number = true;
    for (const auto& row : rows_) {
      column.push_back(shown(row[c]));
      number = number && !row[c].is_string();
    }
    std::size_t width = 0;
    for (const std::string& cell : column) width = std::max(width, cell.size());
    for (std::size_t r = 0; r < lines.size(); ++r) {
      lines[r] += number ? fmt::format("{:>{}}  ", column[r], width)
                         : fmt::format("{:<{}}  ", column[r], width);
    }
  }
  for (const std::string& line : lines)
    text += line.substr(0, line.find_last_not_of(' ') + 1) + '\n';
  return text;
}

std::string Table::csv() const {
  std::string text = comma_separated(columns_, [](const std::string& name) { return name; });
  for (const auto& row : rows_) text += comma_separated(row, quoted);
  return text;
}

}  // namespace rebounce::bench
