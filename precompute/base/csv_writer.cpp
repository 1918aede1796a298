#include "precompute/base/csv_writer.h"

#include <array>
#include <cassert>
#include <charconv>

#include "rebounce/error.h"
#include "transfer/file/atomic_file.h"

namespace rebounce {
namespace {

constexpr std::size_t kBufferSize = std::size_t{1} << 16;

/// Gathers cells of a line until there are enough for one write.
class LineWriter {
 public:
  explicit LineWriter(AtomicFile& file) : file_(file) {}

  void cell(const std::string& text) {
    assert(text.find_first_of(",\"\r\n") == std::string::npos);
    separate();
    buffer_ += text;
  }

  void cell(float value) {
    separate();
    std::array<char, 32> digits;
    const auto result = std::to_chars(digits.data(), digits.data() + digits.size(), value);
    buffer_.append(digits.data(), result.ptr);
  }

  void end_line() {
    buffer_ += '\n';
    line_is_empty_ = true;
    if (buffer_.size() >= kBufferSize) flush();
  }

  void flush() {
    file_.write(std::as_bytes(std::span(buffer_)));
    buffer_.clear();
  }

 private:
  void separate() {
    if (!line_is_empty_) buffer_ += ',';
    line_is_empty_ = false;
  }

  AtomicFile& file_;
  std::string buffer_;
  bool line_is_empty_ = true;
};

std::size_t row_count(const std::filesystem::path& path, std::span<const CsvColumns> groups) {
  std::size_t rows = 0;
  for (const CsvColumns& group : groups) {
    assert(!group.names.empty());
    if (&group == &groups.front()) rows = group.values.size() / group.names.size();
    if (group.values.size() != rows * group.names.size()) {
      throw Error("cannot write " + path.string() + ": column " + group.names.front() +
                  " has a different number of rows; give all columns the same number");
    }
  }
  return rows;
}

}  // namespace

void write_csv(const std::filesystem::path& path, std::span<const CsvColumns> groups) {
  const std::size_t rows = row_count(path, groups);
  AtomicFile file(path);
  LineWriter lines(file);
  for (const CsvColumns& group : groups) {
    for (const std::string& name : group.names) lines.cell(name);
  }
  lines.end_line();
  for (std::size_t row = 0; row < rows; ++row) {
    for (const CsvColumns& group : groups) {
      const std::size_t width = group.names.size();
      for (const float value : group.values.subspan(row * width, width)) lines.cell(value);
    }
    lines.end_line();
  }
  lines.flush();
  file.commit();
}

}  // namespace rebounce
